"""Models of joint impedance: moment arms over posture, muscle stiffness over activation."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
