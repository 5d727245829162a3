"""What is in an NWB file: time series, their clocks, and trials."""
