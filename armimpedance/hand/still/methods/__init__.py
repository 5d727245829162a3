"""Estimators of hand impedance, one file each with its record METHOD; nothing else lies here."""
