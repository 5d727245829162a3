"""The hand at rest, reaching, at random: M, B, K; to joints and muscles; groups; plans."""
