"""The share while the robot moves: one update a sample."""
