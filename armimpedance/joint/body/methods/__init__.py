"""The ways to base parameters, one file each; its record `METHOD` is the entry."""
