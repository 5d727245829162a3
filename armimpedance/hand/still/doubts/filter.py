"""Detection of a delay or filter in one channel that the other channel did not pass.

A force that passed L is ``L f = -(M L x'' + B L x' + K L x)``: with the position through the same L
the equation of motion holds unchanged. So each L of a few families is applied to the other channel.
The L with the smallest residual is that of the channel.
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
#: Highest corner that is tried, as a share of the sampling rate.
HIGHEST: Final = 0.4
#: Smallest improvement over no filter for a detection, in squared standard errors.
LEAST_EXPLAINED: Final = 40.0
#: The same in the first search, before the noise with the filter has been estimated.
AT_FIRST: Final = 20.0
#: Other filters stay possible if their improvement is less than the best one's by at most this.
POSSIBLE: Final = 9.0
#: A delay is preferred to a filter if its improvement is less by at most this.
SIMPLER: Final = 4.0
#: All in logarithms: tolerance of the search for a delay or corner, half-width of the second search
#: about the first optimum, and step of the numerical curvature. NEAR: families are dropped if the
#: first search leaves more than this multiple of the smallest residual.
SHARP: Final = 0.004
AROUND: Final = 0.1
STEP: Final = 0.05
NEAR: Final = 1.2
#: Share of the step between two grid values by which a parabola through them may be wrong.
NO_PARABOLA: Final = 0.5
#: Smallest improvement over dry friction or a reflex, which a delay or a low-pass resembles.
BEYOND_OTHERS: Final = 20.0
#: Smallest ratio of the significance of a delay to that of a reflex. With a delay of 2 ms it is
#: 1.6, with a reflex .7 to 1.
CLEARER: Final = 1.25
#: Relative standard error of the stated corner of a low-pass.
STATED_ERROR: Final = 0.02
#: Number of conditions, those with most trials, that are searched, and the fewest and most trials
#: of each.
MOST_CONDITIONS: Final = 2
FEWEST_TRIALS: Final = 8
MOST_TRIALS: Final = 128


#: Filters of the quick test that decides whether to search.
FIRST_LOOK: Final = (
    Passed("force", "late", 0, 1e-3),
    Passed("force", "late", 0, 5e-3),
    Passed("force", "low-pass", 2, 30.0),
    Passed("force", "zero-phase", 2, 20.0),
    Passed("force", "zero-phase", 2, 10.0),
)


@dataclass(frozen=True, eq=False)
class Filter:
    """Detected filter: the likeliest, the relative standard error of its value, and the others.

    `possible`: others that explain nearly as much, with their probabilities.
    `explained`: improvement over no filter, in squared standard errors.
    `each`: mean weighted squared residual of a row.
    `stated`: the filter stated in the recording.
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
        one, note = self.likeliest, ""
        if self.stated == one:
            text = f"the {one.channel} comes {one.words}, as stated; the {one.other} is taken alike"
            return Finding("filter", "ok", text)
        if self.stated is not None:
            note = f" (stated: {self.stated.words})"
        if one.is_nothing:
            text = f"the {one.channel} comes through no filter{note}: nothing is taken through it"
            return Finding("filter", "warning", text)
        name = "delay" if one.way == "late" else "filter"
        seen = f"the {one.channel} comes {one.words} (sd {100 * self.error:.2g} %){note}"
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
    """Detect the filter of one of the two channels; None if no filter is clearly better than none.

    No filter is reported if another departure from the model explains nearly as much.
    """
    if recording.perturbation != "returning":
        return None
    chosen = sorted((rows for _, rows in groups_of(recording, DEFAULT_BY)), key=len, reverse=True)
    groups = _rows_to_fit(recording, chosen[:MOST_CONDITIONS])
    if not groups or not _needs_search(groups):
        return None
    models = [
        model for model in models_of(recording, chosen[:MOST_CONDITIONS]) if model is not None
    ]
    if not models:
        return None
    late, without_phase = _show_a_delay(models), _on_grids(groups, "zero-phase")
    if not late and not _may_explain_much(groups, without_phase):
        return None
    others = [*_on_grids(groups, "late"), *_on_grids(groups, "low-pass")]
    reweighted, detected = _likeliest(groups, [*others, *without_phase])
    return detected if _is_significant(reweighted, detected, late) else None


def _likeliest(
    groups: Sequence[FilteredRows], grids: Sequence[_Grid]
) -> tuple[list[FilteredRows], Filter]:
    """Conditions weighted by the noise with the best filter, and the likeliest filter."""
    rough = sorted((_search_family(groups, *grid) for grid in grids), key=lambda one: one[0])
    reweighted = [FilteredRows.of(one.window, one.kind, rough[0][1]) for one in groups]
    # all filters near the best one are compared with the weights of the best one
    candidates = [one for left, one in rough if left < NEAR * rough[0][0]]
    tried = sorted(
        (_search_family(reweighted, one, {}) for one in candidates), key=lambda one: one[0]
    )
    return reweighted, _filter_from(reweighted, tried)


def _rows_to_fit(recording: Recording, chosen: Sequence[IntArray]) -> list[FilteredRows]:
    """Rows of the conditions that can be fitted."""
    timing, groups = disturbance_times(recording), []
    for rows in chosen:
        try:
            window = cut_windows(recording, rows[:MOST_TRIALS], timing)
            if window.usable.sum() >= FEWEST_TRIALS:
                groups.append(FilteredRows.of(window, recording.kind, None))
        except ArmImpedanceError:
            continue
    return groups


def _needs_search(groups: Sequence[FilteredRows]) -> bool:
    """True if one of a few filters leaves a clearly smaller residual than no filter."""
    least = min(_residual_with(groups, passed) for passed in _quick_filters())
    return least * (1 + LEAST_EXPLAINED / _rows(groups)) < _residual_with(groups, None)


def _quick_filters() -> list[Passed]:
    """The filters of the quick test, for each channel."""
    return [replace(passed, channel=channel) for channel in CHANNELS for passed in FIRST_LOOK]


def _filter_from(groups: Sequence[FilteredRows], tried: Sequence[tuple[float, Passed]]) -> Filter:
    """Build the result: the likeliest filter, its improvement, and the possible others."""
    least, likeliest = tried[0]
    row_residual = least / _rows(groups)
    # a clock that is late is simpler than a filter that does nearly the same
    simple = (
        candidate
        for residual, candidate in tried
        if candidate.way == "late" and residual < least + SIMPLER * row_residual
    )
    likeliest = next(simple, likeliest)
    odds = np.exp([(least - residual) / row_residual / 2 for residual, _ in tried])
    possible = [
        (candidate, float(p / odds.sum()))
        for (residual, candidate), p in zip(tried, odds, strict=True)
        if candidate is not likeliest and residual < least + POSSIBLE * row_residual
    ]
    explained = (_residual_with(groups, None) - least) / row_residual
    return Filter(
        likeliest, _error(groups, likeliest, row_residual), tuple(possible), explained, row_residual
    )


def _families(way: Way) -> list[Passed]:
    """One filter of every family that is tried, of one kind (`way`), without a value."""
    orders = (0,) if way == "late" else ORDERS
    return [Passed(channel, way, order, np.nan) for channel in CHANNELS for order in orders]


def _residual_with(groups: Sequence[FilteredRows], passed: Passed | None) -> float:
    """Weighted squared residuals of all groups with a filter; infinite if it cannot be fitted."""
    highest = HIGHEST * min(group.window.sample_rate_hz for group in groups)
    if passed is not None and passed.way != "late" and passed.value > highest:
        return np.inf
    try:
        return sum(group.left(passed)[0] for group in groups)
    except (ArmImpedanceError, np.linalg.LinAlgError):
        return np.inf


def _rows(groups: Sequence[FilteredRows]) -> int:
    """Number of rows of all groups minus their parameters."""
    left = [group.left(None) for group in groups]
    return sum(rows - len(theta) for _, theta, rows in left)


#: A family, and the residual for each value of its grid, by the value's logarithm.
_Grid = tuple[Passed, dict[float, float]]


def _on_grids(groups: Sequence[FilteredRows], way: Way) -> list[_Grid]:
    """The families of one kind, with their residuals on the grid."""
    grid = [float(value) for value in np.log(DELAYS_S if way == "late" else CORNERS_HZ)]
    return [
        (family, {v: _residual_with(groups, _of(family, v)) for v in grid})
        for family in _families(way)
    ]


def _of(family: Passed, logarithm: float) -> Passed:
    """The filter of a family with this logarithm of its value."""
    return replace(family, value=float(np.exp(logarithm)))


def _may_explain_much(groups: Sequence[FilteredRows], grids: Sequence[_Grid]) -> bool:
    """True if one of the filters without phase may explain much.

    Most limbs have a reflex, which a filter with phase resembles. If the trials show no delay, such
    a filter is rejected whatever it explains, so that a search for it would be wasted.
    """
    # the weights are those of noise estimated without a filter, which may include its effect
    most = _residual_with(groups, None) / (1 + AT_FIRST / _rows(groups))
    near = (grid for grid in grids if _can_leave(grid[1]) <= most)
    return any(_search_family(groups, *grid)[0] <= most for grid in near)


def _can_leave(left: dict[float, float]) -> float:
    """Lower bound of the residual of a family between the values of its grid.

    The grid's best less twice the gain of a parabola there, and less a share of the step to the
    next value. It is a bound if the curvature changes by less than a half from value to value.
    """
    at = np.sort(list(left))
    values = np.array([left[float(place)] for place in at])
    best = int(np.argmin(values))
    first = int(np.clip(best - 1, 0, len(at) - 3))
    three = slice(first, first + 3)
    if not np.isfinite(values[three]).all():
        return -np.inf
    curve = np.polynomial.Polynomial.fit(at[three], values[three], 2)
    ends = at[max(best - 1, 0)], at[min(best + 1, len(at) - 1)]
    inside = [root for root in curve.deriv().roots().real if ends[0] < root < ends[1]]
    gain = max(values[best] - curve(place) for place in (*inside, at[best]))
    step = np.sort(values[three])[1] - values[best]
    return float(values[best] - 2 * gain - NO_PARABOLA * step)


def _search_family(
    groups: Sequence[FilteredRows], family: Passed, left: dict[float, float]
) -> tuple[float, Passed]:
    """Smallest residual of a family and its filter: Brent's search from the best grid value.

    `left`: residuals on its grid; if empty, the search is near the family's own value.
    """
    left = dict(left)

    def left_by(value: float) -> float:
        if value not in left:
            left[value] = _residual_with(groups, _of(family, value))
        return left[value]

    if not left:
        low, high = np.log(family.value) - AROUND, np.log(family.value) + AROUND
    else:
        grid = list(left)
        best, step = min(grid, key=left_by), abs(grid[1] - grid[0])
        low, high = max(best - step, min(grid)), min(best + step, max(grid))
        inside = best + SHARP * ((best == low) - (best == high))
        if inside != best and left_by(best) < left_by(inside):
            # the minimum is at the end of the grid
            return left[best], _of(family, best)
    # the residual is infinite where no fit is possible; the next step is then a golden section
    with np.errstate(invalid="ignore"):
        minimize_scalar(left_by, bounds=(low, high), method="bounded", options={"xatol": SHARP})
    best = min(left, key=left_by)
    return left[best], _of(family, best)


def _error(groups: Sequence[FilteredRows], passed: Passed, row_residual: float) -> float:
    """Standard error of the logarithm of its value, from the curvature of the residual.

    `each`: mean weighted squared residual of a row.
    """
    around = [
        _residual_with(groups, replace(passed, value=passed.value * np.exp(s)))
        for s in (-STEP, STEP)
    ]
    # left(v + s) = left(v) + each s^2 / sd^2
    curved = (sum(around) - 2 * _residual_with(groups, passed)) / (2 * row_residual)
    return float(STEP / np.sqrt(curved)) if curved > 0 else 1.0


def _is_significant(groups: Sequence[FilteredRows], detected: Filter, late: bool) -> bool:
    """True if a filter explains more than chance and other departures do.

    `late`: the trials show a delay by their scatter, whatever their noise; any filter that shifts
    the force must show one.
    """
    if detected.explained < LEAST_EXPLAINED or not (late or detected.likeliest.way == "zero-phase"):
        return False
    return _residual_with(
        groups, detected.likeliest
    ) + BEYOND_OTHERS * detected.each <= _residual_by_others(groups)


def _show_a_delay(models: Sequence[Model]) -> bool:
    """True if the scatter between trials makes a delay significant that is not a reflex."""
    delay = pooled(models, "delay")
    return abs(delay.size) > delay.limit and not _resembles_reflex(models, delay)


def _resembles_reflex(models: Sequence[Model], delay: Departure) -> bool:
    """True if the trials support a reflex about as clearly as a delay.

    The significance is that between trials: the residual with a filter falls with the noise of
    single trials as well, and cannot separate the two.
    """
    columns = [name for name in models[0].columns if name.startswith("reflex")]
    answers = [reflex.size / reflex.error for reflex in (pooled(models, name) for name in columns)]
    return abs(delay.size / delay.error) < CLEARER * max(answers, default=0.0)


def _residual_by_others(groups: Sequence[FilteredRows]) -> float:
    """Smallest weighted residual with one of the other departures, by the same weights."""
    models = [Model.weighted(group.window, group.kind, group.weight) for group in groups]
    others = (column for column in models[0].columns if column != "delay")
    return min(sum(model.left(column) for model in models) for column in others)


def in_step(recording: Recording) -> tuple[Recording, Filter | None]:
    """Filter the other channel alike if one channel was filtered alone.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    recording : Recording
        Unchanged if no filter was detected.
    found : Filter or None
    """
    stated = recording.force_lowpass_hz is not None and recording.perturbation == "returning"
    detected = _as_stated(recording) if stated else find_filter(recording)
    return (recording if detected is None else detected.likeliest.alike(recording)), detected


def _as_stated(recording: Recording) -> Filter:
    """The stated low-pass if the data do not contradict it, else the detected filter."""
    hz, order = recording.force_lowpass_hz, recording.force_lowpass_order
    stated = Passed("force", "low-pass", order, float(hz or 0.0))
    if find_filter(stated.alike(recording)) is None:
        return Filter(stated, STATED_ERROR, (), np.inf, np.nan, stated)
    detected = find_filter(recording)
    if detected is None:
        return Filter(Passed("force", "late", 0, 0.0), 0.0, (), 0.0, np.nan, stated)
    return replace(detected, stated=stated)


def widened_by_filter(
    estimates: Sequence[ImpedanceEstimate],
    recording: Recording,
    by: Sequence[str],
    found: Filter,
) -> list[ImpedanceEstimate]:
    """Widen the intervals of the estimates by the uncertainty of the filter.

    `recording`: as it was measured.
    """
    timing = disturbance_times(recording)
    if found.likeliest.is_nothing:
        return list(estimates)
    note = f"the {found.likeliest.other} was taken {found.likeliest.words}, as the other was"
    wider = []
    for estimate, (_, rows) in zip(estimates, groups_of(recording, by), strict=True):
        estimate = replace(estimate, provenance=(*estimate.provenance, note))
        try:
            errors = _errors(cut_windows(recording, rows, timing), recording.kind, found)
        except (ArmImpedanceError, np.linalg.LinAlgError):
            # too few trials; the other doubts leave such groups unchanged, too
            wider.append(estimate)
            continue
        more = errors.T @ errors
        bound = None if estimate.bound is None else estimate.bound + more
        shared = {**estimate.shared_errors, "filter": errors[0]}
        wider.append(
            replace(
                estimate, covariance=estimate.covariance + more, bound=bound, shared_errors=shared
            )
        )
    return wider


def _errors(window: Window, kind: Kind, detected: Filter) -> FloatArray:
    """Errors by the uncertainty of the filter, (1 + others, 3 d^2): its value, then the others."""
    likeliest = detected.likeliest
    group = FilteredRows.of(window, kind, likeliest)
    theta = group.left(likeliest)[1]
    moved = group.left(replace(likeliest, value=likeliest.value * np.exp(STEP)))[1]
    errors = [(moved - theta) / STEP * detected.error]
    errors += [np.sqrt(p) * (group.left(passed)[1] - theta) for passed, p in detected.possible]
    return np.array(errors)
