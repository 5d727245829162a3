"""Trials aligned at their onsets, and detection of trials that are unlike the others."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, IntArray
from armimpedance.core.conventions import Kind
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Recording, Response
from armimpedance.hand.still.estimation import groups_of
from armimpedance.hand.still.stochastic import stochastic_response
from armimpedance.numerics.signals import (
    beyond_the_others,
    choose_span,
    cut_windows,
    disturbance_times,
    respond,
)

#: The state before the onset is a mean over this long (s), as in the estimate.
REST_S = 0.1
#: Random courses are drawn for this long (s): a longer course would be a black area.
SHOWN_S = 1.0
#: More points of one trial than this cannot be distinguished in print.
MOST_POINTS = 240


@dataclass(frozen=True)
class Aligned(FrozenRecord):
    """Trials around their onsets, minus the mean of the rest before.

    `lag_s` (S,): time from the onset; for a stochastic perturbation from the trial's start.
    `moved`, `pushed` (T, S, d): displacement (m or rad) and force by the limb (N or N m), minus
    their mean at rest.
    `trial` (T,) int: numbers of the trials.
    `used` (T,) bool: False if an estimate leaves the trial out.
    `duration_s` (T,): from the onset to the disturbance's end; the trial's length for a stochastic
    one.
    `direction` (T,) int or None: trials of the same number have the same disturbance.
    `direction_names`: their names, such as ``45°``.
    """

    lag_s: Annotated[FloatArray, "S"]
    moved: Annotated[FloatArray, "T S d"]
    pushed: Annotated[FloatArray, "T S d"]
    trial: Annotated[IntArray, "T"]
    used: Annotated[BoolArray, "T"]
    duration_s: Annotated[FloatArray, "T"]
    direction: Annotated[IntArray, "T"] | None = None
    direction_names: tuple[str, ...] = ()

    @property
    def rest(self) -> BoolArray:
        """True for samples before the onset; all False for a stochastic perturbation."""
        return self.lag_s <= 0 if self.lag_s[0] < 0 else np.zeros(len(self.lag_s), dtype=bool)

    def thin(self) -> slice:
        """Samples to draw: random courses in full for their first second, others thinned out."""
        if not self.rest.any():
            return slice(int(np.searchsorted(self.lag_s, SHOWN_S)))
        return slice(None, None, max(1, len(self.lag_s) // MOST_POINTS))


def rows_of(recording: Recording, keys: Mapping[str, Any]) -> IntArray:
    """Rows of the trial table that a group's keys select; keys that are no columns are ignored.

    Raises InputError: no trial is of that group.
    """
    columns = [name for name in keys if name in recording.trials]
    wanted = [str(keys[name]) for name in columns]
    for group_keys, rows in groups_of(recording, columns):
        if [str(group_keys[name]) for name in columns] == wanted:
            return np.asarray(rows, dtype=np.int64)
    named = ", ".join(f"{name} {keys[name]}" for name in columns)
    raise InputError(f"no trial of {named}", expected="a group of this recording")


def aligned_group(recording: Recording, keys: Mapping[str, Any]) -> Aligned:
    """Align all trials of one group, also those that an estimate leaves out.

    `keys`: the group's columns of the trial table, as in an estimate.
    Raises InputError: no trial is of that group, or no onset is stated or detected.
    """
    return align(recording, rows_of(recording, keys))


def align(recording: Recording, rows: IntArray | None = None) -> Aligned:
    """Align all trials of these rows, also those that an estimate leaves out.

    Raises InputError: no onset is stated or detected.
    """
    rows = np.arange(recording.n_trials) if rows is None else np.asarray(rows)
    if recording.perturbation == "stochastic":
        return _from_start(recording, rows)
    timing = disturbance_times(recording)
    window = cut_windows(recording, rows, timing)
    start = recording.offsets[rows]
    first = start + np.round(
        (timing.onset_s[rows] - recording.time_s[start]) * recording.sample_rate_hz
    ).astype(np.int64)
    lag = np.round(window.lag_s * recording.sample_rate_hz).astype(np.int64)
    # A trial that is too short is continued by its first or last sample.
    index = np.clip(first[:, None] + lag, start[:, None], recording.offsets[rows + 1][:, None] - 1)
    rest = (lag <= 0) & (lag >= -REST_S * recording.sample_rate_hz)
    moved, pushed = (_less_rest(s[index], rest) for s in (recording.position, recording.force))
    return Aligned(
        lag_s=window.lag_s,
        moved=moved,
        pushed=pushed,
        trial=window.trial,
        used=window.usable,
        duration_s=window.duration_s,
        direction=window.disturbance,
        direction_names=_direction_names(recording, rows),
    )


def _from_start(recording: Recording, rows: IntArray) -> Aligned:
    """Trials of a stochastic perturbation, cut to the shortest, minus their means."""
    length = int(np.diff(recording.offsets)[rows].min())
    index = recording.offsets[rows][:, None] + np.arange(length)
    everywhere = np.ones(length, dtype=bool)
    return Aligned(
        lag_s=np.arange(length) / recording.sample_rate_hz,
        moved=_less_rest(recording.position[index], everywhere),
        pushed=_less_rest(recording.force[index], everywhere),
        trial=recording.trials["trial"].to_numpy(dtype=np.int64)[rows],
        used=np.ones(len(rows), dtype=bool),
        duration_s=np.full(len(rows), length / recording.sample_rate_hz),
    )


def _less_rest(signal: FloatArray, rest: BoolArray) -> FloatArray:
    return np.asarray(signal - signal[:, rest].mean(axis=1, keepdims=True))


def _direction_names(recording: Recording, rows: IntArray) -> tuple[str, ...]:
    """Names in the order of the window's numbers: by rising angle from 0°.

    In space, first by rising elevation: azimuth and angle above the plane.
    """
    if "direction_deg" not in recording.trials:
        return ()
    degrees = recording.trials["direction_deg"].to_numpy(dtype=float, na_value=np.nan)[rows]
    if not np.isfinite(degrees).all():
        return ()
    around = np.round(degrees % 360.0, 3) % 360.0
    if "elevation_deg" not in recording.trials:
        return tuple(f"{angle:g}°" for angle in np.unique(around))
    above = recording.trials["elevation_deg"].to_numpy(dtype=float, na_value=0.0)[rows]
    both = np.unique(np.stack([np.round(above, 3), around], axis=1), axis=0)
    return tuple(f"{azimuth:.3g}°, {up:+.3g}°" for up, azimuth in both)


def outlying_trials(recording: Recording, keys: Mapping[str, Any] | None = None) -> tuple[int, ...]:
    """Numbers of trials whose motion or force differs from others of the same disturbance.

    A trial is unlike the others if its distance from their median course is more than twice the
    distance that nine in ten of them do not exceed. Each condition is judged separately. Trials
    that estimates leave out anyway are not listed, nor any with fewer than five trials.

    Parameters
    ----------
    recording : Recording
    keys : mapping, optional
        Columns and values of one group, as `ImpedanceEstimate.keys`; default: all conditions.

    Returns
    -------
    tuple of int
        In the order of the trial table.

    Raises
    ------
    InputError
        No trial is of that group, or no onset is stated or detected.
    """
    groups = [rows for _, rows in groups_of(recording, ("condition",))]
    if keys is not None:
        groups = [rows_of(recording, keys)]
    return tuple(int(n) for rows in groups for n in outlying(align(recording, rows)))


def outlying(aligned: Aligned) -> IntArray:
    """Numbers of the trials of one group that are unlike the others; see `outlying_trials`."""
    labels = aligned.direction
    if labels is None:
        if not aligned.rest.any():
            # Random courses have no common median; only their size can be compared.
            return aligned.trial[_far(_spread(aligned.moved)) | _far(_spread(aligned.pushed))]
        labels = _by_peak(aligned)
    far = np.zeros(len(aligned.trial), dtype=bool)
    for signal in (aligned.moved, aligned.pushed):
        middle = np.zeros_like(signal)
        for label in np.unique(labels):
            own = labels == label
            middle[own] = np.median(signal[own & aligned.used], axis=0) if own.sum() > 2 else np.nan
        distance = np.nan_to_num(_spread(signal - middle))
        far |= _far(np.where(aligned.used, distance, 0.0))
    return np.asarray(aligned.trial[far & aligned.used])


def _far(values: FloatArray) -> BoolArray:
    return beyond_the_others(values)


def _spread(signal: FloatArray) -> FloatArray:
    """Root mean square over samples and axes, (T,)."""
    return np.asarray(np.sqrt((signal**2).mean(axis=(1, 2))))


def _by_peak(aligned: Aligned) -> IntArray:
    """Label of each trial: the eighth of the circle (or the sign) of its largest displacement."""
    far = np.linalg.norm(aligned.moved, axis=2).argmax(axis=1)
    peak = aligned.moved[np.arange(len(far)), far]
    if peak.shape[1] == 1:
        return np.asarray(peak[:, 0] > 0, dtype=np.int64)
    return np.asarray(
        np.round(np.arctan2(peak[:, 1], peak[:, 0]) / (np.pi / 4)) % 8, dtype=np.int64
    )


def chosen(aligned: Aligned, outliers: Collection[int] | None) -> BoolArray:
    """True for the trials to be marked, (T,): the listed ones, by default the outlying ones."""
    marked = outlying(aligned) if outliers is None else np.array(list(outliers), dtype=np.int64)
    return np.isin(aligned.trial, marked)


# The force of each trial as measured and as predicted from the motion by an estimate.

#: Rows per smoothing kernel: a fit needs a sixth of them, a smooth picture more.
ROWS_PER_KERNEL = 80


@dataclass(frozen=True)
class FittedForce(FrozenRecord):
    """Measured and fitted force of a group's usable trials (blocks of a stochastic perturbation).

    `lag_s` (S,), `trial` (T,) int.
    `measured`, `fitted` (T, S, d): force by the limb, offset and ramp removed from both, N or N m.
    `direction` (T,) int or None: trials of the same number have the same disturbance.
    `unit_name`: "trial", or "block" of a stochastic perturbation.
    """

    lag_s: Annotated[FloatArray, "S"]
    measured: Annotated[FloatArray, "T S d"]
    fitted: Annotated[FloatArray, "T S d"]
    trial: Annotated[IntArray, "T"]
    rate_hz: float
    kind: Kind
    direction: Annotated[IntArray, "T"] | None = None
    unit_name: str = "trial"

    @property
    def residual(self) -> FloatArray:
        """Measured minus fitted force, (T, S, d)."""
        return np.asarray(self.measured - self.fitted)

    @property
    def explained(self) -> FloatArray:
        """Share of each trial's force that the fit explains, (T,): 1 - residual² / measured²."""
        whole = (self.measured**2).sum(axis=(1, 2))
        residual = (self.residual**2).sum(axis=(1, 2))
        return np.asarray(1 - residual / np.where(whole > 0, whole, np.inf))


def fitted_force(recording: Recording, estimate: ImpedanceEstimate) -> FittedForce:
    """Measured force of each trial, and that predicted from its motion by M, B and K.

    Raises InputError: no trial of the recording is of the estimate's group.
    """
    rows = rows_of(recording, estimate.keys)
    stochastic = recording.perturbation == "stochastic"
    direction = None
    if stochastic:
        response = stochastic_response(recording.select(rows))
    else:
        window = cut_windows(recording, rows)
        response = respond(window, choose_span(window, rows_per_kernel=ROWS_PER_KERNEL))
        direction = window.disturbance
    used = response.usable
    return FittedForce(
        lag_s=response.lag_s,
        measured=response.force[used],
        fitted=predicted_force(response, estimate)[used],
        trial=response.trial[used] + (1 if stochastic else 0),
        rate_hz=response.sample_rate_hz,
        kind=recording.kind,
        direction=None if direction is None else direction[used],
        unit_name="block" if stochastic else "trial",
    )


def predicted_force(response: Response, estimate: ImpedanceEstimate) -> FloatArray:
    """Force by the limb predicted from the motion by M (with the handle), B and K, (T, S, d)."""
    # f = -(M x'' + B x' + K x): (T, S, d) = (T, S, d) (d, d) three times
    return np.asarray(
        -(
            response.acceleration @ np.asarray(estimate.inertia_with_handle).T
            + response.velocity @ estimate.viscosity.T
            + response.displacement @ estimate.stiffness.T
        )
    )
