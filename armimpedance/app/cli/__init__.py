"""The commands: the only place that wires all stages."""
