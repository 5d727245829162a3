"""Inertia, viscosity and stiffness of the human arm from small disturbances.

Nothing is imported here: each room is imported where it is used, so that
``armimpedance --help`` starts as fast as the interpreter.
"""

__version__ = "0.1.0"
