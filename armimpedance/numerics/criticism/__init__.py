"""Every assumption of an analysis held against the data, and what then may be done."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
