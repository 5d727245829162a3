"""Files whose columns get their meaning from a mapping; one file per kind."""
