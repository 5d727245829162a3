"""Recording folders with three tables: metadata, trials, samples."""
