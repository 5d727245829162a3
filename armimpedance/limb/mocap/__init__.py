"""From markers to joint angles: gaps bridged, a natural posture found by least squares."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
