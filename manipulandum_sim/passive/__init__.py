"""A relaxed arm under motion capture."""
