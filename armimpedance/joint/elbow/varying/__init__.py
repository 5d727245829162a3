"""B and K of one joint over time, with bands: one file a method, and their table."""
