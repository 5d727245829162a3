"""A folder of people to one table: the same commands for each, repeated only where needed."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
