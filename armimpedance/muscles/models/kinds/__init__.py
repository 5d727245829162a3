"""The kinds of models: one file a kind, each with its record `MODEL`."""
