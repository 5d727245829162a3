"""Geometry and inertia of the arm: what maps hand, joints and muscles onto one another."""
