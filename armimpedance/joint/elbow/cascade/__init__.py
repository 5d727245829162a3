"""Intrinsic and reflex pathways of one joint, varying over time or another variable."""
