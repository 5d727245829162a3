"""Geometry and inertia of the arm: what maps hand, joints and muscles onto one another."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
