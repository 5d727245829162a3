"""One script per figure of a source."""
