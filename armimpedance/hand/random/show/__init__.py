"""Presentation of the hand under random perturbations: verb, command, text, table, plot, page."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
