"""A robot for arm therapy with people in it."""
