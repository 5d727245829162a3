"""What estimators weigh with: rows in modes, the noise of a recording, the expected motion."""
