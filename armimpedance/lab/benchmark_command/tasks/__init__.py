"""The tasks of the benchmark: one file a task, with the record TASK."""
