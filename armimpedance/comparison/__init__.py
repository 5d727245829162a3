"""Differences between groups of trials: intervals, permutation tests, several subjects."""
