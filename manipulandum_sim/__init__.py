"""Simulated subjects and rigs -> (Recording, Truth). Own dynamics: nothing of the analysis."""
