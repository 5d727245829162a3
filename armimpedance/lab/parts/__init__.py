"""What the commands of the virtual laboratory share."""
