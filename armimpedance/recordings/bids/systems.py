"""Systems that recorded in a BIDS dataset, and their signals in EDF and BDF files.

Each system has its own clock. The description of its channels is read at once, their values when
they are requested.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, needed
from armimpedance.core.json_text import is_number
from armimpedance.recordings.bids.dataset import Person
from armimpedance.recordings.bids.tsv import BidsName, headed_rows, is_missing, numbers

# Signals in EDF and BDF files: the header is checked against the file, then edfio reads them.

_FIXED_BYTES: Final = 256
_MOST_SIGNALS: Final = 8192
_ROUNDING: Final = 1e-12
#: Bytes per sample.
_WIDTH: Final = {".edf": 2, ".bdf": 3}


@dataclass(frozen=True)
class EdfFile:
    """The signals of a file, which are not read yet.

    `labels`, `units`: as in the file.
    `lengths`: number of samples of each signal.
    `read`: function that returns the values (N,) of the signal of an index, in its unit.
    """

    labels: tuple[str, ...]
    units: tuple[str, ...]
    rates_hz: tuple[float, ...]
    lengths: tuple[int, ...]
    read: Callable[[int], FloatArray]


def open_edf(file: Path) -> EdfFile:
    """Open a file whose name ends in .edf or .bdf.

    Raises InputError: it is no such file, is shorter than its header says, or has gaps between its
    records.
    """
    _check_sizes(file)
    edfio = needed("edfio", "bids", file)
    reader = edfio.read_bdf if file.suffix.lower() == ".bdf" else edfio.read_edf
    edf = _guarded(lambda: reader(file, header_encoding="latin-1"), file)
    signals = _guarded(lambda: list(edf.signals), file)

    def read(index: int) -> FloatArray:
        values = _guarded(lambda: np.asarray(signals[index].data, dtype=np.float64), file)
        if not np.isfinite(values).all():
            label = str(signals[index].label)
            raise InputError("not finite", file=file, column=label, expected="a range of values")
        return values

    described = _guarded(lambda: [_described(s, edf.num_data_records) for s in signals], file)
    labels, units, rates, lengths = zip(*described, strict=True) if described else ((),) * 4
    return EdfFile(labels, units, rates, lengths, read)


def _described(signal: Any, records: int) -> tuple[str, str, float, int]:
    rate = float(signal.sampling_frequency)
    if not (np.isfinite(rate) and rate > 0):
        raise ValueError(f"a rate of {rate} Hz")
    # 700 samples in the file's 1.4 s are exactly 500 Hz, not the nearest double
    integer = round(rate)
    rate = float(integer) if abs(rate - integer) <= _ROUNDING * rate else rate
    length = int(signal.samples_per_data_record) * int(records)
    return str(signal.label), str(signal.physical_dimension).strip(), rate, length


def _guarded(call: Callable[[], Any], file: Path) -> Any:
    """Call edfio; whatever goes wrong in it is reported as an error of the file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return call()
        except InputError:
            raise
        except Exception as error:
            reason = " ".join(str(error).split())[:120] or type(error).__name__
            raise InputError(f"cannot be read: {reason}", file=file, expected="EDF") from None


def _check_sizes(file: Path) -> None:
    """Compare the counts in a header with the size of the file before they are used."""
    width = _WIDTH.get(file.suffix.lower())
    if width is None:
        raise InputError("is neither .edf nor .bdf", file=file)
    try:
        with file.open("rb") as stream:
            fixed = stream.read(_FIXED_BYTES)
            signals = _count(fixed[252:256], "the number of signals", file)
            if not 0 < signals <= _MOST_SIGNALS:
                raise InputError(f"{signals} signals", file=file, expected="from 1 on")
            described = stream.read(signals * _FIXED_BYTES)
        size = file.stat().st_size
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None
    header = _FIXED_BYTES * (signals + 1)
    if (
        len(described) < signals * _FIXED_BYTES
        or _count(fixed[184:192], "the header", file) != header
    ):
        raise InputError("a broken header", file=file, expected=f"{header} bytes of header")
    if fixed[192:197] in (b"EDF+D", b"BDF+D"):
        expected = "records without gaps (EDF+C)"
        raise InputError("records with gaps between them", file=file, expected=expected)
    counts = [described[216 * signals + 8 * i :][:8] for i in range(signals)]
    record = sum(_count(text, "samples in a record", file) for text in counts) * width
    records = _count(fixed[236:244], "the number of records", file)
    if records < 0 or record <= 0 or header + records * record > size:
        problem = f"{records} records of {record} bytes in a file of {size}"
        raise InputError(problem, file=file, expected="a whole file")


def _count(text: bytes, quantity: str, file: Path) -> int:
    try:
        return int(text.decode("ascii").strip())
    except ValueError:
        raise InputError(f"{quantity} is {text!r}", file=file, expected="a whole number") from None


def same_rates(rates: Sequence[float], lengths: Sequence[int]) -> list[list[int]]:
    """Group the indices of the signals by rate and length: one clock per group."""
    groups: dict[tuple[float, int], list[int]] = {}
    for index, key in enumerate(zip(rates, lengths, strict=True)):
        groups.setdefault(key, []).append(index)
    return list(groups.values())


_REQUIRED: Final = ("name", "component", "type", "tracked_point", "units")
_LOWEST_RATE_HZ, _LARGEST_RATE_HZ = 1e-3, 1e7


@dataclass(frozen=True)
class Channel:
    """One column of values.

    `kind`: its type in BIDS, such as "POS"; "" if it has none.
    `component`, `point`, `frame`: axis, tracked point and reference frame of a motion channel; ""
    if there is none.
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

    `name`: the tracking system's label, or "emg", "physio", with the recording's label.
    `start_s`: time of the first sample, if the file states it.
    `read`: function that returns the values (N, len(indices)) of the channels of some indices; NaN
    for missing values.
    `axes`: reference frame -> the directions of its axes, such as "ALS".
    `notes`: remarks for the recording.
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
    """Open a tracking system.

    Raises InputError: its channels or its rate are not described.
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
            problem = f"a channel called {name!r:.60}" + (" appears twice" if name in seen else "")
            raise InputError(problem, file=file, row=row, column="name", expected="other names")
        seen.add(name)


def _bad_channels(rows: Sequence[Mapping[str, str]]) -> tuple[str, ...]:
    bad = [row["name"] for row in rows if row.get("status", "").lower() == "bad"]
    return (f"Marked as bad in the dataset: {', '.join(bad)}.",) if bad else ()


def _rate(sidecar: Mapping[str, Any], file: BidsName) -> float:
    """Rate from time stamps if it is stated, else the nominal rate, Hz."""
    nominal, effective = (
        sidecar.get(k) for k in ("SamplingFrequency", "SamplingFrequencyEffective")
    )
    rate = effective if is_number(effective) and effective else nominal
    if not is_number(rate) or not _LOWEST_RATE_HZ < float(rate) < _LARGEST_RATE_HZ:  # type: ignore[arg-type]
        problem = "is missing" if rate is None else f"is {rate!r:.40}"
        json_file = file.path.with_suffix("").with_suffix(".json")
        expected = "samples a second, in this file or in one above it"
        raise InputError(problem, file=json_file, column="SamplingFrequency", expected=expected)
    return float(rate)  # type: ignore[arg-type]


def _axes(described: Mapping[str, Any]) -> dict[str, str]:
    """Map of reference frames to the directions of their axes."""
    frames = described.get("reference_frame")
    levels = frames.get("Levels") if isinstance(frames, dict) else None
    if not isinstance(levels, dict):
        return {}
    directions = {k: v.get("SpatialAxes") for k, v in levels.items() if isinstance(v, dict)}
    return {name: axes.upper() for name, axes in directions.items() if isinstance(axes, str)}


def emg_systems(file: BidsName, person: Person) -> list[System]:
    """Open the signals of an EMG file, as one system for each rate.

    Units are those in the file's own header, since `_channels.tsv` often states V for uV.
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
        counts = f"{len(rows)} channels are described, {len(channels)} are in {file.path.name}"
        notes += (f"{counts}: the names are the signals' own.",)
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
    """Open a further record: `_physio.tsv.gz` with the names of its columns in a JSON file."""
    sidecar = person.sidecar(file)
    file_name = file.path.name
    names = sidecar.get("Columns")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        expected = "a JSON file beside it with the names of its columns"
        raise InputError("Columns is missing", file=file.path, expected=expected)
    start = sidecar.get("StartTime", 0.0)
    if not is_number(start):
        raise InputError(f"StartTime {start!r:.40}", file=file_name, expected="a number, s")
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
