"""Muscles: joint impedance over posture and activation, also live."""
