"""Recordings as a folder of three tables: metadata, trials, samples."""
