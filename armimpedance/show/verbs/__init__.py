"""Parts that every verb shares: reading, the gate before a fit, results with names."""
