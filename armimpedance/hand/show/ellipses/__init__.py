"""Ellipses: one, many over the workspace, over levels and fields."""
