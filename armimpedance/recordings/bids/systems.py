"""Systems that recorded: one of motion capture, an EMG amplifier, a physiological record.

Each has its own clock. What its channels are is read at once, their values when they are asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import is_number
from armimpedance.recordings.bids.dataset import Person
from armimpedance.recordings.bids.edf import open_edf, same_rates
from armimpedance.recordings.bids.names import BidsName
from armimpedance.recordings.bids.tsv import headed_rows, is_missing, numbers

_REQUIRED: Final = ("name", "component", "type", "tracked_point", "units")
_LOWEST_RATE_HZ, _LARGEST_RATE_HZ = 1e-3, 1e7


@dataclass(frozen=True)
class Channel:
    """One column of values.

    Attributes
    ----------
    name : str
    kind : str
        Its type in BIDS, such as "POS"; "" where it has none.
    unit : str or None
    component, point, frame : str
        Axis, tracked point and reference frame of a channel of motion; "" where there is none.
    """

    name: str
    kind: str = ""
    unit: str | None = None
    component: str = ""
    point: str = ""
    frame: str = ""


@dataclass(frozen=True)
class System:
    """Channels on one clock.

    Attributes
    ----------
    name : str
        The tracking system's label, or "emg", "physio", with the recording's label.
    sort : {"motion", "emg", "physio"}
    file : BidsName
    channels : tuple of Channel
    rate_hz : float
    start_s : float
        Time of the first sample, where the file itself tells it.
    read : callable
        Values (N, len(indices)) of the channels of these indices, NaN where one is missing.
    sidecar : mapping
    axes : mapping
        Reference frame -> the directions of its axes, such as "ALS".
    notes : tuple of str
        What a reader of the recording must know.
    """

    name: str
    sort: Literal["motion", "emg", "physio"]
    file: BidsName
    channels: tuple[Channel, ...]
    rate_hz: float
    read: Callable[[Sequence[int]], FloatArray]
    start_s: float = 0.0
    sidecar: Mapping[str, Any] = field(default_factory=dict)
    axes: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def of_kind(self, kind: str) -> list[int]:
        """Indices of the channels of one type."""
        return [i for i, channel in enumerate(self.channels) if channel.kind == kind]


def motion_system(file: BidsName, person: Person) -> System:
    """A tracking system.

    Raises
    ------
    InputError
        Its channels or its rate are not described.
    """
    described = person.describing(file, "channels", ".tsv")
    if not described:
        expected = "a _channels.tsv that names its columns"
        raise InputError("no description of its channels", file=file.path, expected=expected)
    table = described[-1].path
    channels = tuple(_channel(row) for row in headed_rows(table, _REQUIRED))
    _check_names(channels, table)
    sidecar = person.sidecar(file)
    names = [channel.name for channel in channels]
    return System(
        name=file.entities.get("tracksys", "motion"),
        sort="motion",
        file=file,
        channels=channels,
        rate_hz=_rate(sidecar, file),
        read=lambda wanted: numbers(file.path, names, wanted),
        sidecar=sidecar,
        axes=_axes(person.sidecar(file, "channels")),
        notes=_bad_channels(headed_rows(table)),
    )


def _channel(row: Mapping[str, str]) -> Channel:
    def cell(name: str) -> str:
        text = row.get(name, "")
        return "" if is_missing(text) else text

    return Channel(
        name=row["name"],
        kind=cell("type").upper(),
        unit=cell("units") or None,
        component=cell("component").lower(),
        point=cell("tracked_point"),
        frame=cell("reference_frame"),
    )


def _check_names(channels: Sequence[Channel], file: object) -> None:
    names = [channel.name for channel in channels]
    if not names:
        raise InputError("no channels", file=file, expected="one row a channel")
    seen: set[str] = set()
    for row, name in enumerate(names, start=2):
        if name in seen or not name or not name.isprintable():
            problem = f"a channel called {name!r:.60}" + (" stands twice" if name in seen else "")
            raise InputError(problem, file=file, row=row, column="name", expected="other names")
        seen.add(name)


def _bad_channels(rows: Sequence[Mapping[str, str]]) -> tuple[str, ...]:
    bad = [row["name"] for row in rows if row.get("status", "").lower() == "bad"]
    return (f"Marked as bad in the dataset: {', '.join(bad)}.",) if bad else ()


def _rate(sidecar: Mapping[str, Any], file: BidsName) -> float:
    """The rate that time stamps show, else the nominal one."""
    nominal, shown = (sidecar.get(k) for k in ("SamplingFrequency", "SamplingFrequencyEffective"))
    rate = shown if is_number(shown) and shown else nominal
    if not is_number(rate) or not _LOWEST_RATE_HZ < float(rate) < _LARGEST_RATE_HZ:  # type: ignore[arg-type]
        told = "is missing" if rate is None else f"is {rate!r:.40}"
        place = file.path.with_suffix("").with_suffix(".json")
        expected = "samples a second, in this file or in one above it"
        raise InputError(told, file=place, column="SamplingFrequency", expected=expected)
    return float(rate)  # type: ignore[arg-type]


def _axes(described: Mapping[str, Any]) -> dict[str, str]:
    """Reference frame -> the directions of its axes."""
    frames = described.get("reference_frame")
    levels = frames.get("Levels") if isinstance(frames, dict) else None
    if not isinstance(levels, dict):
        return {}
    told = {k: v.get("SpatialAxes") for k, v in levels.items() if isinstance(v, dict)}
    return {name: axes.upper() for name, axes in told.items() if isinstance(axes, str)}


def emg_systems(file: BidsName, person: Person) -> list[System]:
    """The signals of an EMG file, one system for each rate.

    The unit is the one in the file's own header: what `_channels.tsv` calls V is often uV there.

    Raises
    ------
    InputError
    """
    edf = open_edf(file.path)
    described = person.describing(file, "channels", ".tsv")
    rows = headed_rows(described[-1].path, ("name", "type")) if described else []
    named = len(rows) == len(edf.labels)
    channels = [
        Channel(
            name=rows[i]["name"] if named else label,
            kind=rows[i]["type"].upper() if named else "",
            unit=edf.units[i] or (rows[i].get("units") if named else None),
        )
        for i, label in enumerate(edf.labels)
    ]
    _check_names(channels, described[-1].path if named else file.path)
    notes = _bad_channels(rows)
    if rows and not named:
        told = f"{len(rows)} channels are described, {len(channels)} are in {file.path.name}"
        notes += (f"{told}: the names are the signals' own.",)
    groups = same_rates(edf.rates_hz, edf.lengths)
    label = file.entities.get("recording")
    name = "emg" if label is None else f"emg-{label}"
    return [
        System(
            name=name if len(groups) == 1 else f"{name}-{number}",
            sort="emg",
            file=file,
            channels=tuple(channels[i] for i in group),
            rate_hz=edf.rates_hz[group[0]],
            read=lambda wanted, group=group: np.column_stack(  # type: ignore[misc]
                [edf.read(group[i]) for i in wanted]
            ),
            notes=notes,
        )
        for number, group in enumerate(groups, start=1)
    ]


def physio_system(file: BidsName, person: Person) -> System:
    """A record beside the others: `_physio.tsv.gz` with its columns in a JSON file.

    Raises
    ------
    InputError
    """
    sidecar = person.sidecar(file)
    place = file.path.name
    names = sidecar.get("Columns")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        expected = "a JSON file beside it with the names of its columns"
        raise InputError("Columns is missing", file=file.path, expected=expected)
    start = sidecar.get("StartTime", 0.0)
    if not is_number(start):
        raise InputError(f"StartTime {start!r:.40}", file=place, expected="a number, s")
    label = file.entities.get("recording")
    channels = tuple(Channel(name, unit=_physio_unit(sidecar.get(name))) for name in names)
    _check_names(channels, file.path)
    return System(
        name="physio" if label is None else f"physio-{label}",
        sort="physio",
        file=file,
        channels=channels,
        rate_hz=_rate(sidecar, file),
        read=lambda wanted: numbers(file.path, names, wanted),
        start_s=float(start),
        sidecar=sidecar,
    )


def _physio_unit(described: object) -> str | None:
    unit = None
    if isinstance(described, dict):
        unit = described.get("Units", described.get("Unit"))
    return unit if isinstance(unit, str) and not is_missing(unit) else None
