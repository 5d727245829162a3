"""Inertia, viscosity and stiffness of the human arm from small disturbances.

    import armimpedance as ai

    session = ai.read("session")
    hand = ai.estimate(session)
    hand["relaxed"].stiffness
    ai.plot_ellipses(hand)

Every name is loaded when it is first used, so that ``armimpedance --help`` starts as fast as the
interpreter. What stands in the rooms is imported from them, as in
``from armimpedance.joint.elbow import JointSamples``.
"""

import ast
from importlib import import_module
from pathlib import Path

__version__ = "0.1.0"

# Name -> room, from the stub, which type checkers read too: one list. The rooms' own faces use
# lazy_loader; here the standard library is enough.
_STUB = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
_ROOMS = {
    alias.name: f"{__name__}.{node.module}"
    for node in _STUB.body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}

__all__ = sorted(_ROOMS)  # noqa: PLE0605 - the names stand in the stub


def __getattr__(name: str) -> object:
    """A name of the face, loaded from its room when it is first used."""
    if name not in _ROOMS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_ROOMS[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
