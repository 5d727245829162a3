"""Stiffness and viscosity as linear laws of EMG amplitudes, and the index of co-contraction."""
