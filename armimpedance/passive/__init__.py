"""Passive joints: stiffness, viscosity and friction of a relaxed limb (Venture, elbow)."""
