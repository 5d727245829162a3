"""Pictures of a session and of a group's fit: what was measured, what an estimate makes of it."""
