"""Drawings of records and results: each takes its axes and returns them. matplotlib lives here."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
