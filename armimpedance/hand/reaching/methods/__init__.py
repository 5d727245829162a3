"""Estimators of a moving hand's impedance, one file each."""
