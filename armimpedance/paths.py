"""Names for several files or folders, as short as tells them apart. Standard library only."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armimpedance.errors import InputError


def distinct_names(paths: Sequence[Path]) -> list[str]:
    """A name for each path: its own, with as many folders before it as make all different.

    Parameters
    ----------
    paths : sequence of Path

    Returns
    -------
    list of str
        Such as ``["monday/session", "tuesday/session"]``.

    Raises
    ------
    InputError
        One place is given twice.
    """
    places = [path.resolve() for path in paths]
    for number, place in enumerate(places):
        if place in places[:number]:
            raise InputError("is given twice", file=paths[number], expected="each input once")
    names = [place.parts for place in places]
    for length in range(1, max(map(len, names), default=0) + 1):
        short = ["/".join(parts[-length:]) for parts in names]
        if len(set(short)) == len(short):
            return short
    return [str(path) for path in paths]
