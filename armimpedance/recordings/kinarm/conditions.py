"""What the conditions of a Kinarm exam are, in words: its own names, else what its settings are.

Protocols that differ in the direction of the disturbance only are one condition: eight pushes at
one place are eight rows of the table and one experiment.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from armimpedance.recordings.kinarm.directions import ends_of, force_columns, force_of
from armimpedance.recordings.kinarm.tables import Protocol, Value, is_load, plain

#: Columns of a load that its name holds.
_MOST_COLUMNS: Final = 3


def condition_names(protocols: Sequence[Protocol]) -> tuple[list[str], list[str]]:
    """The condition of each trial, and remarks.

    Parameters
    ----------
    protocols : sequence of Protocol
        Of every trial of the exam, so that a condition keeps its name whichever are chosen.

    Returns
    -------
    tuple of list of str, list of str
    """
    names, remarks = [""] * len(protocols), list[str]()
    # Pushes and trials without one are two kinds of unnamed protocols.
    kinds = [(p.name, not p.name and p.direction is not None) for p in protocols]
    for kind in dict.fromkeys(kinds):
        rows = [i for i, each in enumerate(kinds) if each == kind]
        made, remark = _names([protocols[i] for i in rows])
        remarks += remark
        for i, name in zip(rows, made, strict=True):
            names[i] = name
    return names, remarks


def _names(alike: Sequence[Protocol]) -> tuple[list[str], list[str]]:
    """Names of protocols of one stated name; without one, all with a direction or all without."""
    stated = alike[0].name
    features = [dict(_features(protocol)) for protocol in alike]
    labels = list(dict.fromkeys(label for each in features for label in each))
    varying = [n for n in labels if len({each.get(n) for each in features}) > 1]
    words = [" ".join(each[n] for n in varying if n in each) for each in features]
    rows = sorted({protocol.row for protocol in alike})
    if stated:
        if not varying:
            return [stated] * len(alike), []
        told = f"Conditions: trial protocols named {stated} differ in {', '.join(varying)}."
        return [f"{stated} {each}".strip() for each in words], [told]
    pooled = len(set(words)) < len(rows) and any(p.direction is not None for p in alike)
    if not pooled:
        return [" ".join([f"TP_{p.row}", *_told(p)]) for p in alike], []
    remark = "Conditions: trial protocols that differ in direction only are together."
    together = f"TP_{rows[0]} to TP_{rows[-1]}"
    return [each or together for each in words], [remark]


def _features(protocol: Protocol) -> Iterator[tuple[str, str]]:
    """What a protocol is beside its direction: a setting's label, and the setting in words."""
    direction = protocol.direction
    for name, value in protocol.settings.items():
        label, source = plain(name), direction is not None and name == direction.source
        if source and direction is not None and direction.kind == "stated":
            continue
        if name in protocol.loads:
            yield from _of_load(protocol, name, at=not source)
        elif is_load(name):
            yield label, f"no {label}" if value == 0.0 else f"{label} {_number(value)}"
        elif source and direction is not None and direction.size is not None:
            yield label, f"target {_cm(direction.size)} cm"
        elif name in protocol.targets:
            yield label, f"{label} {_place(protocol, name)}"
        else:
            yield label, f"{label} {_number(value)}"


def _of_load(protocol: Protocol, name: str, *, at: bool) -> Iterator[tuple[str, str]]:
    """A load in words: its force in N, and what else its row of the table says."""
    label, load = plain(name), protocol.loads[name]
    force = force_of(load, protocol.side)
    if force is not None:
        size = f"{label} {np.hypot(*force):.4g} N"
        yield label, f"{size} at {_degrees(*force)} deg" if at and any(force) else size
    for column, value in load.items():
        if column not in (force_columns(load) or ()):
            yield f"{label}_{plain(column)}", f"{label} {plain(column)} {_number(value)}"


def in_words(protocol: Protocol) -> str:
    """A protocol's name, else its targets and loads; "" where the tables say neither."""
    return protocol.name or " ".join(_told(protocol))


def _told(protocol: Protocol) -> Iterator[str]:
    """A protocol of its own in a few words: from where to where, with which load."""
    first, last = ends_of(protocol.targets)
    start, end = protocol.ways.get(first or ""), protocol.ways.get(last or "")
    if start is not None and end is not None:
        way = end[0] - start[0], end[1] - start[1]
        told = f"target {_cm(float(np.hypot(*way)))} cm"
        yield f"{told} at {_degrees(*way)} deg" if any(way) else told
    elif first and last:
        yield f"target {_number(protocol.settings[first])} to {_number(protocol.settings[last])}"
    else:
        yield from (f"{plain(name)} {_place(protocol, name)}" for name in protocol.targets)
    for name in protocol.loads:
        words = dict(_of_load(protocol, name, at=True))
        # Of a load that is no force, what it is: a viscosity, torques.
        columns = [w for label, w in words.items() if not w.endswith(" 0")][:_MOST_COLUMNS]
        plainly = f"{plain(name)} {_number(protocol.settings[name])}"
        yield words.get(plain(name), ", ".join(columns) or plainly)


def _place(protocol: Protocol, name: str) -> str:
    place = protocol.targets[name]
    if place is None:
        return _number(protocol.settings[name])
    return " ".join(_cm(each) for each in place) + " cm"


def _degrees(x: float, y: float) -> str:
    return f"{round(float(np.rad2deg(np.arctan2(y, x))), 1) % 360.0:g}"


def _cm(metres: float) -> str:
    return f"{round(100.0 * metres, 2) + 0.0:g}"


def _number(value: Value) -> str:
    return value if isinstance(value, str) else f"{value:g}"
