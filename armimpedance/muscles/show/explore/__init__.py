"""An arm to play with: models and measured estimates in a page that computes their numbers."""
