"""What a file holds and a recording of it does not: said in its provenance, listed by `inspect`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

_BEGINNING: Final = "Not taken: "


def not_taken(what: Sequence[str], why: str) -> tuple[str, ...]:
    """A sentence of the provenance on what was not taken, and why; none where that is nothing.

    Parameters
    ----------
    what : sequence of str
        Names of channels, groups or columns.
    why : str
        Such as "no meaning was given to them".

    Returns
    -------
    tuple of str
        One sentence or none.

    Examples
    --------
    >>> not_taken(["ACH3", "Gaze_X"], "no meaning was given to them")
    ('Not taken: ACH3, Gaze_X (no meaning was given to them).',)
    """
    return (f"{_BEGINNING}{', '.join(what)} ({why}).",) if what else ()


def told_not_taken(provenance: Iterable[str]) -> tuple[str, ...]:
    """What these sentences say was not taken, without their beginning.

    Parameters
    ----------
    provenance : iterable of str

    Returns
    -------
    tuple of str
    """
    return tuple(s.removeprefix(_BEGINNING) for s in provenance if s.startswith(_BEGINNING))
