"""What a stationary fit doubts: late answers, channels out of step, stiffness over amplitude."""
