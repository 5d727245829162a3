"""Muscles of an arm over posture and activation together."""
