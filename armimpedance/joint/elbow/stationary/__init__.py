"""I, B and K of one joint at an operating point: one file a method, and their table."""
