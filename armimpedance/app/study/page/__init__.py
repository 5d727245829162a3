"""The page of many sessions: who can be used, who failed and why, who is unlike the others."""
