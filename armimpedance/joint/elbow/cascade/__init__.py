"""Intrinsic and reflex pathways of one joint, each with a course over time or another variable."""
