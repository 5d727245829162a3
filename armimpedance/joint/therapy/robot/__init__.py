"""Calibration of the empty therapy robot: friction, cables, counterbalance spring."""
