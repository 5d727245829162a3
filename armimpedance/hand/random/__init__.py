"""A hand, or a joint of two axes, under a random perturbation: M, B, K and a delayed reflex."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
