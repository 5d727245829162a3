"""The shapes of disturbances: one file a shape, each with its record `SHAPE`.

The simulator has shapes of its own under the same names; a test compares them.
"""
