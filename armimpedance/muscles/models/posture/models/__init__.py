"""The models over posture: one file a model, each with its record `MODEL`."""
