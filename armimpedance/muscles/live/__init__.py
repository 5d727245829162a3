"""Stiffness of the hand live, from posture and muscle activity: one update a sample."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
