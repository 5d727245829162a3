"""One joint under a random perturbation: I, B, K, their change in time, and EMG (Ruiz 2011)."""
