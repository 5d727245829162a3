"""A calibration of the live stiffness: `armimpedance plan --live`."""
