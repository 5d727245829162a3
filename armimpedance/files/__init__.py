"""Results and models as files: written whole, and read back without loss."""
