"""A hand under random forces or displacements in two and three axes, for seconds to minutes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
