"""The figures after Ruiz (2011)."""
