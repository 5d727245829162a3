"""Presentation shared by the topics of the hand: results, tables, ellipses."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
