"""An experiment that chooses its next push: what was measured, what is wished, what to do next."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
