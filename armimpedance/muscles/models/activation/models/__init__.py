"""The models over activation: one file a model, each with its record `MODEL`."""
