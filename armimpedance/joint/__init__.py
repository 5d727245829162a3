"""Joints: one under a random perturbation, relaxed ones, a body, a therapy robot."""
