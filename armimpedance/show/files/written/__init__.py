"""What a result file holds before it has a format: tables, intervals, checks, methods."""
