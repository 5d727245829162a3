"""Estimators of hand impedance, one file each, and the table that lists them."""
