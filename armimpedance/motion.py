"""Records of a moving body: its skeleton, markers on it, its joint motion. No algorithms.

World frame: x forward, y to the left, z up, m. At zero coordinates the body stands upright with
the arms hanging, and all segments' frames are parallel to the world's. A hinge turns about an axis
that is fixed in the frame the hinges before it have reached; a hinge's sign is in its axis, so that
flexion is positive where its name says flexion.

Sizes: N samples in all trials of a recording, T trials, P markers, n coordinates, K force plates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

import numpy as np
import pandas as pd

from armimpedance.errors import RecordError
from armimpedance.records import FloatArray, IntArray, Subject, frozen_array

#: m/s^2, along -z (standard gravity).
GRAVITY_M_S2: Final = 9.80665

#: A floating root's coordinates: place, then turns about z, y, x, each carried by those before.
ROOT_TRANSLATIONS: Final = ("x", "y", "z")
ROOT_TURNS: Final = ("rz", "ry", "rx")

#: A force plate's columns: force, then moment about the plate's origin, in the world's frame.
WRENCH: Final = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True)
class Hinge:
    """One angle of a joint, rad, about a unit axis (3,)."""

    name: str
    axis: FloatArray

    def __post_init__(self) -> None:
        axis = frozen_array(self.axis, f"axis of {self.name}", (3,))
        object.__setattr__(self, "axis", axis)
        if abs(float(axis @ axis) - 1) > 1e-9:
            raise RecordError(
                f"axis of {self.name} has length {np.sqrt(axis @ axis):g}", expected="1"
            )


@dataclass(frozen=True)
class Segment:
    """A rigid body and the joint that holds it to its parent.

    Attributes
    ----------
    name : str
    parent : str or None
        None for the root alone.
    origin_m : (3,)
        Joint centre in the parent's frame; the segment's own frame starts there. 0 for the root.
    hinges : tuple of Hinge
        From the parent outwards; none for the root.
    mass_kg : float
        0 where it is not known.
    com_m : (3,)
        In the segment's frame.
    inertia_kgm2 : (3, 3)
        About the centre of mass, axes of the segment's frame.
    """

    name: str
    parent: str | None
    origin_m: FloatArray
    hinges: tuple[Hinge, ...] = ()
    mass_kg: float = 0.0
    com_m: FloatArray = field(default_factory=lambda: np.zeros(3))
    inertia_kgm2: FloatArray = field(default_factory=lambda: np.zeros((3, 3)))

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "hinges", tuple(self.hinges))
        for name, shape in (("origin_m", (3,)), ("com_m", (3,)), ("inertia_kgm2", (3, 3))):
            put(self, name, frozen_array(getattr(self, name), f"{name} of {self.name}", shape))
        if not (np.isfinite(self.mass_kg) and self.mass_kg >= 0):
            raise RecordError(f"mass of {self.name} is {self.mass_kg} kg", expected="0 or more")
        if not np.allclose(self.inertia_kgm2, self.inertia_kgm2.T, atol=1e-12):
            raise RecordError(f"inertia of {self.name} is not symmetric")


@dataclass(frozen=True)
class MarkerSite:
    """Where a marker sits: a point (3,) in a segment's frame, m."""

    name: str
    segment: str
    position_m: FloatArray

    def __post_init__(self) -> None:
        place = frozen_array(self.position_m, f"position of {self.name}", (3,))
        object.__setattr__(self, "position_m", place)


@dataclass(frozen=True)
class Skeleton:
    """A tree of segments, parents first, and the markers on it.

    Attributes
    ----------
    segments : tuple of Segment
    markers : tuple of MarkerSite
    floating : bool
        The root moves freely (six coordinates before all others) or is the world.
    """

    segments: tuple[Segment, ...]
    markers: tuple[MarkerSite, ...] = ()
    floating: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", tuple(self.segments))
        object.__setattr__(self, "markers", tuple(self.markers))
        root = self.segments[0] if self.segments else None
        if root is None or root.parent is not None or root.hinges or root.origin_m.any():
            expected = "first a segment without parent and hinges, its origin 0"
            raise RecordError("a skeleton without a root", expected=expected)
        seen: set[str] = set()
        for i, segment in enumerate(self.segments):
            if segment.name in seen:
                raise RecordError(f"segment {segment.name} stands twice in a skeleton")
            if i > 0 and segment.parent not in seen:
                raise RecordError(f"{segment.name}: no segment {segment.parent!r} before it")
            if i > 0 and not segment.hinges:
                raise RecordError(f"{segment.name} has no hinge", expected="one or more")
            seen.add(segment.name)
        for site in self.markers:
            if site.segment not in seen:
                raise RecordError(f"marker {site.name}: no segment {site.segment!r}")
        for what, names in (("marker", self.marker_names), ("coordinate", self.coordinates)):
            if len(set(names)) != len(names):
                raise RecordError(f"two {what}s of one name in a skeleton")

    @property
    def root_coordinates(self) -> tuple[str, ...]:
        """Names of the six of a floating root; none of a fixed one."""
        root = self.segments[0].name
        return tuple(f"{root}_{c}" for c in ROOT_TRANSLATIONS + ROOT_TURNS) if self.floating else ()

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the n coordinates: the root's six, then every hinge in the segments' order."""
        hinges = tuple(h.name for s in self.segments for h in s.hinges)
        return self.root_coordinates + hinges

    @property
    def columns(self) -> tuple[str, ...]:
        """The coordinates' columns on disk: ``_m`` for the root's place, ``_rad`` for angles."""
        places = len(ROOT_TRANSLATIONS) if self.floating else 0
        names = self.coordinates
        return tuple(f"{c}_m" if i < places else f"{c}_rad" for i, c in enumerate(names))

    @property
    def marker_names(self) -> tuple[str, ...]:
        """Names of the markers."""
        return tuple(m.name for m in self.markers)

    @property
    def mass_kg(self) -> float:
        """Of all segments."""
        return float(sum(s.mass_kg for s in self.segments))

    def index(self, segment: str) -> int:
        """Which segment bears this name.

        Raises
        ------
        RecordError
            None does.
        """
        names = [s.name for s in self.segments]
        if segment not in names:
            raise RecordError(f"no segment {segment!r}", expected=f"one of {', '.join(names)}")
        return names.index(segment)

    def coordinate(self, name: str) -> int:
        """Which coordinate bears this name.

        Raises
        ------
        RecordError
            None does.
        """
        if name not in self.coordinates:
            known = ", ".join(self.coordinates)
            raise RecordError(f"no coordinate {name!r}", expected=f"one of {known}")
        return self.coordinates.index(name)


@dataclass(frozen=True)
class EmgSignals:
    """Raw EMG at its own rate.

    Attributes
    ----------
    sample_rate_hz : float
    offsets : (T + 1,) int
        Samples of trial t: ``offsets[t]:offsets[t + 1]``; may be none.
    signals : (Ne, m)
    muscles : tuple of m str
    unit : {"V", "normalised"}
        In V, the maximum is in the trial table (``mvc_<muscle>_V``).
    """

    sample_rate_hz: float
    offsets: IntArray
    signals: FloatArray
    muscles: tuple[str, ...]
    unit: Literal["V", "normalised"] = "normalised"

    def __post_init__(self) -> None:
        put = object.__setattr__
        _check_rate(self.sample_rate_hz)
        put(self, "muscles", tuple(self.muscles))
        put(self, "offsets", frozen_array(self.offsets, "EMG offsets", (None,), np.int64))
        shape = (int(self.offsets[-1]), len(self.muscles))
        put(self, "signals", frozen_array(self.signals, "EMG signals", shape))


class _InTrials:
    """What a recording of samples in trials can say of them."""

    trials: pd.DataFrame
    offsets: IntArray

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.trials)

    def samples_of(self, row: int) -> slice:
        """The samples of the trial in row `row` (from 0) of the trial table."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))


@dataclass(frozen=True)
class MarkerRecording(_InTrials):
    """Markers of a motion-capture session, samples of all trials one after another.

    Attributes
    ----------
    sample_rate_hz : float
    trials : DataFrame (T rows)
        ``trial`` (int, unique), ``condition`` (str) and whatever else is known. Not to be changed.
    offsets : (T + 1,) int
    time_s : (N,)
        Each trial's own clock.
    positions : (N, P, 3)
        m, in the world's frame; NaN in all three where a marker was not seen.
    names : tuple of P str
    skeleton : Skeleton or None
        Of the subject, with the markers' places, where it is known.
    wrenches : (N, K, 6) or None
        Force plates at the markers' rate, as in `MotionRecording`.
    plate_origins_m : (K, 3) or None
    emg : EmgSignals or None
    subject : Subject
    provenance : tuple of str
    """

    sample_rate_hz: float
    trials: pd.DataFrame
    offsets: IntArray
    time_s: FloatArray
    positions: FloatArray
    names: tuple[str, ...]
    skeleton: Skeleton | None = None
    wrenches: FloatArray | None = None
    plate_origins_m: FloatArray | None = None
    emg: EmgSignals | None = None
    subject: Subject = field(default_factory=Subject)
    provenance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        samples = _check_trials(self)
        put(self, "names", tuple(self.names))
        if len(set(self.names)) != len(self.names):
            raise RecordError("two markers of one name")
        put(self, "positions", _with_gaps(self.positions, samples, len(self.names)))
        _check_plates(self, samples)


@dataclass(frozen=True)
class MotionRecording(_InTrials):
    """Joint motion of a skeleton, with what was measured beside it.

    Attributes
    ----------
    sample_rate_hz : float
    trials : DataFrame (T rows)
        As in `MarkerRecording`.
    offsets : (T + 1,) int
    time_s : (N,)
    coordinates : (N, n)
        In the order of `skeleton.coordinates`; m and rad, angles without jumps of a full turn.
    skeleton : Skeleton
    wrenches : (N, K, 6) or None
        Force (N) and moment (Nm) **by each plate on the body**, world frame, the moment about the
        plate's origin.
    plate_origins_m : (K, 3) or None
    torque : (N, n) or None
        Generalised forces by motors or muscles, where they are measured (robots, simulations).
    emg : EmgSignals or None
    subject : Subject
    provenance : tuple of str
    """

    sample_rate_hz: float
    trials: pd.DataFrame
    offsets: IntArray
    time_s: FloatArray
    coordinates: FloatArray
    skeleton: Skeleton
    wrenches: FloatArray | None = None
    plate_origins_m: FloatArray | None = None
    torque: FloatArray | None = None
    emg: EmgSignals | None = None
    subject: Subject = field(default_factory=Subject)
    provenance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        samples = _check_trials(self)
        shape = (samples, len(self.skeleton.coordinates))
        put(self, "coordinates", frozen_array(self.coordinates, "coordinates", shape))
        if self.torque is not None:
            put(self, "torque", frozen_array(self.torque, "torque", shape))
        _check_plates(self, samples)

    def select(self, rows: Sequence[int]) -> MotionRecording:
        """The motion, plates and torque of these trials only (rows from 0); EMG stays behind."""
        parts = [self.samples_of(row) for row in rows]
        index = np.concatenate([np.arange(p.start, p.stop) for p in parts])
        return replace(
            self,
            trials=self.trials.iloc[list(rows)],
            offsets=np.concatenate([[0], np.cumsum([p.stop - p.start for p in parts])]),
            time_s=self.time_s[index],
            coordinates=self.coordinates[index],
            wrenches=None if self.wrenches is None else self.wrenches[index],
            torque=None if self.torque is None else self.torque[index],
            emg=None,
        )


def _check_rate(rate_hz: float) -> None:
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise RecordError(f"sample rate {rate_hz} Hz", expected="a positive number")


def _check_trials(recording: Any) -> int:
    """Check the trial table, offsets and clock; the number of samples."""
    put = object.__setattr__
    _check_rate(recording.sample_rate_hz)
    trials = recording.trials.reset_index(drop=True).copy()
    put(recording, "trials", trials)
    for column in ("trial", "condition"):
        if column not in trials:
            raise RecordError("no such column in the trial table", column=column)
    if len(trials) == 0 or trials["trial"].duplicated().any():
        raise RecordError("no trials, or one of them twice", expected="one row per trial")
    offsets = frozen_array(recording.offsets, "offsets", (len(trials) + 1,), np.int64)
    put(recording, "offsets", offsets)
    if offsets[0] != 0 or (np.diff(offsets) <= 0).any():
        raise RecordError("a trial has no samples", expected="rising offsets from 0")
    samples = int(offsets[-1])
    put(recording, "time_s", frozen_array(recording.time_s, "time_s", (samples,)))
    put(recording, "provenance", tuple(recording.provenance))
    if recording.emg is not None and len(recording.emg.offsets) != len(offsets):
        raise RecordError("EMG of another number of trials", expected=f"{len(trials)}")
    return samples


def _check_plates(recording: Any, samples: int) -> None:
    if (recording.wrenches is None) != (recording.plate_origins_m is None):
        raise RecordError("wrenches without the plates' origins, or the other way round")
    if recording.wrenches is None:
        return
    put = object.__setattr__
    origins = frozen_array(recording.plate_origins_m, "plate_origins_m", (None, 3))
    put(recording, "plate_origins_m", origins)
    wrenches = frozen_array(recording.wrenches, "wrenches", (samples, len(origins), 6))
    put(recording, "wrenches", wrenches)


def _with_gaps(values: FloatArray, samples: int, markers: int) -> FloatArray:
    """Read-only copy (N, P, 3); a marker is seen in all three axes or in none."""
    array = np.array(values, dtype=np.float64)
    if array.shape != (samples, markers, 3):
        raise RecordError(
            f"positions have shape {array.shape}", expected=f"shape ({samples}, {markers}, 3)"
        )
    lost = np.isnan(array).any(axis=2)
    if not np.isnan(array[lost]).all() or not np.isfinite(array[~lost]).all():
        raise RecordError(
            "a marker with a part of its coordinates", expected="three finite numbers or none"
        )
    array.flags.writeable = False
    return array
