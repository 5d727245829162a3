"""Verbs, command, text, tables, plots and page of one joint under a random perturbation."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
