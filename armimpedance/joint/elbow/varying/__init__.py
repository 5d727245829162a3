"""B and K of one joint over time, with bands; the methods and their table."""
