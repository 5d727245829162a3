"""An open benchmark: what it asks, submissions, their scores, the table."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
