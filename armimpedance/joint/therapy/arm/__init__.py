"""Calibration of a person's relaxed arm in the robot."""
