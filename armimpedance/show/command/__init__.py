"""Parts that several commands share: input, checks, progress."""
