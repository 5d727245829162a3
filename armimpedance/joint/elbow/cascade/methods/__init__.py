"""The methods for two pathways with courses, one file each."""
