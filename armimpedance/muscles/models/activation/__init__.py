"""Joint stiffness and viscosity over muscle activation at one posture."""
