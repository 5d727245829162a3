"""From raw EMG to muscle activation with its uncertainty."""
