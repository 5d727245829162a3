"""The figures after Venture's poster on human-like systems."""
