"""Inertia, viscosity and stiffness of the human arm from small disturbances.

    import armimpedance as ai

    session = ai.read("session")
    hand = ai.estimate(session)
    hand["relaxed"].stiffness
    ai.plot_ellipses(hand)

Every name is loaded when it is first used, so that ``armimpedance --help`` starts as fast as the
interpreter. Three topics have a verb and a room of one name: ``ai.elbow``, ``ai.passive`` and
``ai.body`` are the verbs; what stands in the rooms is imported from them, as in
``from armimpedance.elbow import ElbowFit``.
"""

import sys
from types import ModuleType

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


class _Face(ModuleType):
    """A module whose names are not hidden by rooms: importing ``armimpedance.elbow`` would do so."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in __all__ and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Face
