"""A body on two force plates."""
