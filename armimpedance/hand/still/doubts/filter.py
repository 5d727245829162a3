"""Did one channel come late, or through a filter, that the other did not come through?

A force that came through L is ``L f = -(M L x'' + B L x' + K L x)``: with the position through the
same L the law holds as it is. So each L of a few families is tried on the other channel; the one
that leaves least is what the channel came through.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.optimize import minimize_scalar

from armimpedance.core.arrays import FloatArray, IntArray, once_per_record
from armimpedance.core.conventions import Kind
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording, Window
from armimpedance.hand.still.doubts.departures import models_of
from armimpedance.hand.still.doubts.filtered_rows import FilteredRows
from armimpedance.hand.still.doubts.model import Departure, Model, pooled
from armimpedance.hand.still.doubts.passed import CHANNELS, Passed, Way
from armimpedance.hand.still.estimation import DEFAULT_BY, groups_of
from armimpedance.numerics.signals import cut_windows, disturbance_times

#: Orders of the Butterworth low-passes that are tried.
ORDERS: Final = (1, 2, 4)
#: Delays (s) and corners (Hz) that are tried first, from the mildest to the strongest.
DELAYS_S: Final = (5e-4, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3)
CORNERS_HZ: Final = (200.0, 120.0, 75.0, 45.0, 28.0, 18.0, 12.0, 8.0)
#: The highest corner that is tried, a part of the sampling rate.
HIGHEST: Final = 0.4
#: A filter is told where it explains so much more than none, in squared standard errors.
LEAST_EXPLAINED: Final = 40.0
#: The same before the noise is known.
AT_FIRST: Final = 20.0
#: Other filters that explain less than the best by less than this stay possible.
POSSIBLE: Final = 9.0
#: A delay is taken for it where it explains less than the best by less than this.
SIMPLER: Final = 4.0
#: Where the search for a delay or corner ends, how far about a rough one it goes, and the step that
#: tells its standard error: parts of it. Families that leave more than this at first are dropped.
SHARP: Final = 0.004
AROUND: Final = 0.1
STEP: Final = 0.05
NEAR: Final = 1.2
#: Part of the step between two values of a grid by which a parabola through them may be wrong.
NO_PARABOLA: Final = 0.5
#: A delay or a low-pass resembles dry friction or a reflex: so much more than these it explains.
BEYOND_OTHERS: Final = 20.0
#: Of a delay of 2 ms the trials are 1.6 times as sure as of a reflex, of a reflex .7 to 1 times.
CLEARER: Final = 1.25
#: How well the corner of a low-pass is known that is stated: a part of it.
STATED_ERROR: Final = 0.02
#: Conditions with most trials that are looked at, and the fewest and most trials of one.
MOST_CONDITIONS: Final = 2
FEWEST_TRIALS: Final = 8
MOST_TRIALS: Final = 128


#: The few filters that tell whether to look at all.
FIRST_LOOK: Final = (
    Passed("force", "late", 0, 1e-3),
    Passed("force", "late", 0, 5e-3),
    Passed("force", "low-pass", 2, 30.0),
    Passed("force", "zero-phase", 2, 20.0),
    Passed("force", "zero-phase", 2, 10.0),
)


@dataclass(frozen=True, eq=False)
class Filter:
    """What was found: the likeliest, its standard error (a part of its value) and the others.

    `possible`: others that explain nearly as much, with their probabilities beside the likeliest.
    `explained`: how much more than none, in squared standard errors.
    `each`: weighted square that is left of a row.
    `stated`: what the recording says of it.
    """

    likeliest: Passed
    error: float
    possible: tuple[tuple[Passed, float], ...]
    explained: float
    each: float
    stated: Passed | None = None

    @property
    def finding(self) -> Finding:
        """The finding "delay" or "filter"."""
        one, other = self.likeliest, ""
        if self.stated == one:
            text = f"the {one.channel} comes {one.words}, as stated; the {one.other} is taken alike"
            return Finding("filter", "ok", text)
        if self.stated is not None:
            other = f" (stated: {self.stated.words})"
        if one.is_nothing:
            text = f"the {one.channel} comes through no filter{other}: nothing is taken through it"
            return Finding("filter", "warning", text)
        name = "delay" if one.way == "late" else "filter"
        seen = f"the {one.channel} comes {one.words} (sd {100 * self.error:.2g} %){other}"
        if one.is_lost:
            text = (
                f"{seen} or through a filter like it, and the {one.other} does not: too much of "
                "the motion is lost; record both alike"
            )
            return Finding(name, "unusable", text)
        text = (
            f"{seen} and the {one.other} does not; the {one.other} is taken through the same "
            "before the fit: record both alike"
        )
        return Finding(name, "warning", text)


@once_per_record
def find_filter(recording: Recording) -> Filter | None:
    """What one of the two channels came through; None where nothing explains much more than none.

    Nothing is said of a filter where another departure from the law explains nearly as much.
    """
    if recording.perturbation != "returning":
        return None
    chosen = sorted((rows for _, rows in groups_of(recording, DEFAULT_BY)), key=len, reverse=True)
    groups = _looked_at(recording, chosen[:MOST_CONDITIONS])
    if not groups or not _worth_looking(groups):
        return None
    models = [one for one in models_of(recording, chosen[:MOST_CONDITIONS]) if one is not None]
    if not models:
        return None
    late, without_phase = _show_a_delay(models), _on_grids(groups, "zero-phase")
    if not late and not _may_explain_much(groups, without_phase):
        return None
    others = [*_on_grids(groups, "late"), *_on_grids(groups, "low-pass")]
    again, found = _likeliest(groups, [*others, *without_phase])
    return found if _stands_out(again, found, late) else None


def _likeliest(
    groups: Sequence[FilteredRows], grids: Sequence[_Grid]
) -> tuple[list[FilteredRows], Filter]:
    """The conditions weighed by the noise that the best filter leaves, and the likeliest one."""
    rough = sorted((_searched(groups, *each) for each in grids), key=lambda one: one[0])
    again = [FilteredRows.of(one.window, one.kind, rough[0][1]) for one in groups]
    # the noise that the best of them leaves weighs the rows of all that come near it
    near = [one for left, one in rough if left < NEAR * rough[0][0]]
    tried = sorted((_searched(again, one, {}) for one in near), key=lambda one: one[0])
    return again, _judged(again, tried)


def _looked_at(recording: Recording, chosen: Sequence[IntArray]) -> list[FilteredRows]:
    """The conditions that can be fitted."""
    timing, groups = disturbance_times(recording), []
    for rows in chosen:
        try:
            window = cut_windows(recording, rows[:MOST_TRIALS], timing)
            if window.usable.sum() >= FEWEST_TRIALS:
                groups.append(FilteredRows.of(window, recording.kind, None))
        except ArmImpedanceError:
            continue
    return groups


def _worth_looking(groups: Sequence[FilteredRows]) -> bool:
    """Whether one of a few filters leaves clearly less than none."""
    least = min(_left(groups, one) for one in _first_look())
    return least * (1 + LEAST_EXPLAINED / _rows(groups)) < _left(groups, None)


def _first_look() -> list[Passed]:
    """A few filters of each channel."""
    return [replace(one, channel=channel) for channel in CHANNELS for one in FIRST_LOOK]


def _judged(groups: Sequence[FilteredRows], tried: Sequence[tuple[float, Passed]]) -> Filter:
    """The likeliest of the filters, what they leave before them, and those that stay possible."""
    least, likeliest = tried[0]
    each = least / _rows(groups)
    # a clock that is late is simpler than a filter that does nearly the same
    simple = (one for left, one in tried if one.way == "late" and left < least + SIMPLER * each)
    likeliest = next(simple, likeliest)
    odds = np.exp([(least - left) / each / 2 for left, _ in tried])
    possible = [
        (one, float(p / odds.sum()))
        for (left, one), p in zip(tried, odds, strict=True)
        if one is not likeliest and left < least + POSSIBLE * each
    ]
    explained = (_left(groups, None) - least) / each
    return Filter(likeliest, _error(groups, likeliest, each), tuple(possible), explained, each)


def _families(way: Way) -> list[Passed]:
    """One of every family of a way that is tried."""
    orders = (0,) if way == "late" else ORDERS
    return [Passed(channel, way, order, np.nan) for channel in CHANNELS for order in orders]


def _left(groups: Sequence[FilteredRows], passed: Passed | None) -> float:
    """Weighted squares that a filter leaves of all groups; infinite where it cannot be fitted."""
    highest = HIGHEST * min(group.window.sample_rate_hz for group in groups)
    if passed is not None and passed.way != "late" and passed.value > highest:
        return np.inf
    try:
        return sum(group.left(passed)[0] for group in groups)
    except (ArmImpedanceError, np.linalg.LinAlgError):
        return np.inf


def _rows(groups: Sequence[FilteredRows]) -> int:
    """Rows of all groups beyond their parameters."""
    left = [group.left(None) for group in groups]
    return sum(rows - len(theta) for _, theta, rows in left)


#: A family, and what each value of its grid leaves, by the value's logarithm.
_Grid = tuple[Passed, dict[float, float]]


def _on_grids(groups: Sequence[FilteredRows], way: Way) -> list[_Grid]:
    """The families of a way."""
    at = [float(each) for each in np.log(DELAYS_S if way == "late" else CORNERS_HZ)]
    return [(one, {v: _left(groups, _of(one, v)) for v in at}) for one in _families(way)]


def _of(family: Passed, logarithm: float) -> Passed:
    """One of a family."""
    return replace(family, value=float(np.exp(logarithm)))


def _may_explain_much(groups: Sequence[FilteredRows], grids: Sequence[_Grid]) -> bool:
    """Whether one of the filters without phase may explain much.

    Most limbs have a reflex, which a filter with phase resembles. Where trials show no delay such a
    filter is rejected whatever it explains, so that a search for it would be lost.
    """
    # the weights are those of noise without a filter, in which much of it may hide
    most = _left(groups, None) / (1 + AT_FIRST / _rows(groups))
    near = (one for one in grids if _can_leave(one[1]) <= most)
    return any(_searched(groups, *one)[0] <= most for one in near)


def _can_leave(left: dict[float, float]) -> float:
    """What a family may leave between the values of its grid, on the safe side.

    The grid's best less twice what a parabola gains there, and less a part of the step to the next
    value: a bound where the course's curvature changes by less than a half from value to value.
    """
    at = np.sort(list(left))
    values = np.array([left[float(each)] for each in at])
    best = int(np.argmin(values))
    first = int(np.clip(best - 1, 0, len(at) - 3))
    three = slice(first, first + 3)
    if not np.isfinite(values[three]).all():
        return -np.inf
    curve = np.polynomial.Polynomial.fit(at[three], values[three], 2)
    ends = at[max(best - 1, 0)], at[min(best + 1, len(at) - 1)]
    inside = [root for root in curve.deriv().roots().real if ends[0] < root < ends[1]]
    gain = max(values[best] - curve(each) for each in (*inside, at[best]))
    step = np.sort(values[three])[1] - values[best]
    return float(values[best] - 2 * gain - NO_PARABOLA * step)


def _searched(
    groups: Sequence[FilteredRows], family: Passed, left: dict[float, float]
) -> tuple[float, Passed]:
    """The delay or corner of a family that leaves least: from the best of its grid, Brent's search.

    `left`: of its grid; empty: near the family's own value instead.
    """
    left = dict(left)

    def left_by(value: float) -> float:
        if value not in left:
            left[value] = _left(groups, _of(family, value))
        return left[value]

    if not left:
        low, high = np.log(family.value) - AROUND, np.log(family.value) + AROUND
    else:
        grid = list(left)
        best, step = min(grid, key=left_by), abs(grid[1] - grid[0])
        low, high = max(best - step, min(grid)), min(best + step, max(grid))
        inside = best + SHARP * ((best == low) - (best == high))
        if inside != best and left_by(best) < left_by(inside):
            # the mildest or the strongest of all leaves least
            return left[best], _of(family, best)
    # beyond what can be fitted infinitely much is left, and the next step is a golden section
    with np.errstate(invalid="ignore"):
        minimize_scalar(left_by, bounds=(low, high), method="bounded", options={"xatol": SHARP})
    best = min(left, key=left_by)
    return left[best], _of(family, best)


def _error(groups: Sequence[FilteredRows], passed: Passed, each: float) -> float:
    """Standard error of the logarithm of its value, from the curvature of what it leaves.

    `each`: what is left of a row.
    """
    around = [_left(groups, replace(passed, value=passed.value * np.exp(s))) for s in (-STEP, STEP)]
    # left(v + s) = left(v) + each s^2 / sd^2
    curved = (sum(around) - 2 * _left(groups, passed)) / (2 * each)
    return float(STEP / np.sqrt(curved)) if curved > 0 else 1.0


def _stands_out(groups: Sequence[FilteredRows], found: Filter, late: bool) -> bool:
    """Whether a filter explains more than chance and other departures do.

    `late`: what shifts the force shows as a delay between trials as well, whatever their noise is.
    """
    if found.explained < LEAST_EXPLAINED or not (late or found.likeliest.way == "zero-phase"):
        return False
    return _left(groups, found.likeliest) + BEYOND_OTHERS * found.each <= _left_by_others(groups)


def _show_a_delay(models: Sequence[Model]) -> bool:
    """Whether trials, by what they differ, show a delay that is no reflex."""
    delay = pooled(models, "delay")
    return abs(delay.size) > delay.limit and not _is_rather_a_reflex(models, delay)


def _is_rather_a_reflex(models: Sequence[Model], delay: Departure) -> bool:
    """Whether trials, by what they differ, speak for a reflex about as clearly as for a delay.

    What a filter leaves of single trials falls with their noise as well, and cannot tell the two.
    """
    columns = [name for name in models[0].columns if name.startswith("reflex")]
    answers = [one.size / one.error for one in (pooled(models, name) for name in columns)]
    return abs(delay.size / delay.error) < CLEARER * max(answers, default=0.0)


def _left_by_others(groups: Sequence[FilteredRows]) -> float:
    """Weighted squares that the best of the other departures leaves, by the same weights."""
    models = [Model.weighted(group.window, group.kind, group.weight) for group in groups]
    others = (column for column in models[0].columns if column != "delay")
    return min(sum(model.left(column) for model in models) for column in others)


def in_step(recording: Recording) -> tuple[Recording, Filter | None]:
    """The recording with both channels through the same, and what one had come through alone.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    recording : Recording
        As it is where nothing was found.
    found : Filter or None
    """
    stated = recording.force_lowpass_hz is not None and recording.perturbation == "returning"
    found = _as_stated(recording) if stated else find_filter(recording)
    return (recording if found is None else found.likeliest.alike(recording)), found


def _as_stated(recording: Recording) -> Filter:
    """The stated low-pass where the data do not contradict it, else what they show."""
    hz, order = recording.force_lowpass_hz, recording.force_lowpass_order
    stated = Passed("force", "low-pass", order, float(hz or 0.0))
    if find_filter(stated.alike(recording)) is None:
        return Filter(stated, STATED_ERROR, (), np.inf, np.nan, stated)
    found = find_filter(recording)
    if found is None:
        return Filter(Passed("force", "late", 0, 0.0), 0.0, (), 0.0, np.nan, stated)
    return replace(found, stated=stated)


def widened_by_filter(
    estimates: Sequence[ImpedanceEstimate],
    recording: Recording,
    by: Sequence[str],
    found: Filter,
) -> list[ImpedanceEstimate]:
    """The estimates with what is not known of the filter in their intervals.

    `recording`: as it was measured.
    """
    timing = disturbance_times(recording)
    if found.likeliest.is_nothing:
        return list(estimates)
    note = f"the {found.likeliest.other} was taken {found.likeliest.words}, as the other was"
    wider = []
    for one, (_, rows) in zip(estimates, groups_of(recording, by), strict=True):
        one = replace(one, provenance=(*one.provenance, note))
        try:
            errors = _errors(cut_windows(recording, rows, timing), recording.kind, found)
        except (ArmImpedanceError, np.linalg.LinAlgError):
            # too few trials to be asked, as of the other doubts
            wider.append(one)
            continue
        more = errors.T @ errors
        bound = None if one.bound is None else one.bound + more
        shared = {**one.shared_errors, "filter": errors[0]}
        wider.append(
            replace(one, covariance=one.covariance + more, bound=bound, shared_errors=shared)
        )
    return wider


def _errors(window: Window, kind: Kind, found: Filter) -> FloatArray:
    """What is not known of the filter makes wrong, (1 + others, 3 d^2): its value, then others."""
    likeliest = found.likeliest
    group = FilteredRows.of(window, kind, likeliest)
    here = group.left(likeliest)[1]
    moved = group.left(replace(likeliest, value=likeliest.value * np.exp(STEP)))[1]
    errors = [(moved - here) / STEP * found.error]
    errors += [np.sqrt(p) * (group.left(one)[1] - here) for one, p in found.possible]
    return np.array(errors)
