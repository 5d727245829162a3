"""A hand on a planar manipulandum."""
