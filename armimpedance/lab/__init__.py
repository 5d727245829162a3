"""The virtual laboratory: the only package that imports the simulator."""
