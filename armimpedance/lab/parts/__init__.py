"""Common parts of the commands of the virtual laboratory."""
