"""I, B and K of one joint at an operating point; the methods and their table."""
