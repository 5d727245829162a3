"""A page to work in, for people who do not program."""
