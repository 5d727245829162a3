"""Joint stiffness and viscosity over posture."""
