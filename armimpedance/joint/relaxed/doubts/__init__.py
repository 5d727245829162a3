"""Tests of the assumptions of a passive joint's model."""
