"""Stiffness and viscosity as laws of EMG amplitudes, and the index of co-contraction."""
