"""What several commands share: input, checks, progress."""
