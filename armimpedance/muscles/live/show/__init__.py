"""All forms of live impedance: the command, the plan of its calibration."""
