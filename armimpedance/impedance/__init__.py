"""Inertia, viscosity and stiffness from disturbances: builders of W and y, one file a method."""
