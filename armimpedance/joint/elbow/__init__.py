"""One joint under a random perturbation: I, B, K, their change in time, and EMG (Ruiz 2011)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
