"""Body dynamics: base parameters from motion and contact forces (Venture, poster)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
