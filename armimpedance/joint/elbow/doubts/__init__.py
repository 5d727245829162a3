"""Tests of a stationary fit's assumptions: late answers (reflexes), skew, effects of amplitude."""
