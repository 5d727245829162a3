"""Adaptive experiments: choose the next pushes from the trials so far and the requirements."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
