"""Recordings and results in the forms that data repositories ask for."""
