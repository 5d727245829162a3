"""What the model of a passive joint takes for granted, held against the data."""
