"""From a `Recording` to what can be fitted: windows, smoothing, derivatives, EMG, validity."""
