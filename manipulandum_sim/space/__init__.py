"""A hand on a robot of three axes: a spatial arm with gravity, its muscles and its truth."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
