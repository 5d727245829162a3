"""Files that hold columns without a meaning of their own, one file a kind; a mapping tells it."""
