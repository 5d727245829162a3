"""Where the sessions of a study are worked on: one file an engine."""
