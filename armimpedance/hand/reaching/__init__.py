"""Impedance of a hand that moves: reaches, some of them pushed."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
