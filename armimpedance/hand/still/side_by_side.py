"""Comparison of all estimators on the same recording.

Estimators applied to the same trials share most of their noise. The difference of two is therefore
judged by its own covariance. Leaving out one trial changes both, and the jackknife of theta_a -
theta_b over the trials gives the covariance of the difference,

    C = (T - 1) / T sum_t (d_a,t - d_b,t)(d_a,t - d_b,t)^T,   d_t = theta - theta_(t)

in which the shared noise cancels. A difference of several of its standard errors is not chance:
then an assumption that only one of them makes does not hold.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.conventions import MATRICES, Kind, group_name
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.progress import Progress
from armimpedance.core.records import ImpedanceEstimate, Recording, Window
from armimpedance.hand.still.estimation import (
    DEFAULT_BY,
    Options,
    error_in_group,
    estimate_window,
    groups_of,
    in_order,
)
from armimpedance.hand.still.methods import METHODS
from armimpedance.hand.still.prepared import Prepared
from armimpedance.hand.still.result import Group
from armimpedance.numerics.regression import leave_one_out_shift, solve_total
from armimpedance.numerics.signals import cut_windows, disturbance_times

#: A difference is reported if it exceeds this many of its standard errors ...
FEWEST_STANDARD_ERRORS = 3.0
#: ... and this percentage of the default's matrix.
LEAST_PERCENT = 5.0
#: Differences below this share of the matrix are rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class MethodResult:
    """One method on one group.

    `estimate`: None if the method cannot run on these trials.
    `reason`: why it cannot.
    `seconds`: time to prepare, to solve, and to leave out every trial once, s.
    `shift` (T, 3 d^2) or None: influence of each trial on M, B, K row by row.
    """

    method: str
    estimate: ImpedanceEstimate | None
    reason: str = ""
    seconds: float = 0.0
    shift: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Disagreement:
    """Difference of a method from the reference, in the symmetric parts of M, B and K.

    `percent` (3,): frobenius norm of the difference over that of the reference's matrix.
    `standard_errors` (3,): the same norm over its root mean square by chance, from the covariance
    of the difference; nan if the two do not share their clusters.
    `sentences`: significant differences, in words; empty if there are none.
    """

    method: str
    reference: str
    percent: FloatArray
    standard_errors: FloatArray
    sentences: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, repr=False)
class SideBySide:
    """All methods on one group of trials, in the order of the table of methods.

    `keys`: the group's columns.
    `disagreements`: one for each method that ran, except the reference.
    """

    keys: Mapping[str, Any]
    results: tuple[MethodResult, ...]
    disagreements: tuple[Disagreement, ...]

    def __repr__(self) -> str:
        sentences = [sentence for d in self.disagreements for sentence in d.sentences]
        ran = f"{group_name(self.keys)}: {len(self.estimates)} of {len(self.results)} methods ran"
        return "\n".join([ran, *sentences])

    @property
    def estimates(self) -> tuple[ImpedanceEstimate, ...]:
        """Estimates of the methods that ran."""
        return tuple(r.estimate for r in self.results if r.estimate is not None)

    def marked(self, sentences: Sequence[str]) -> SideBySide:
        """Copy with these sentences before the warnings of every estimate."""
        marked = (
            r if r.estimate is None else replace(r, estimate=r.estimate.marked(sentences))
            for r in self.results
        )
        return replace(self, results=tuple(marked))


def side_by_side(
    recording: Recording,
    *,
    by: Sequence[str] = DEFAULT_BY,
    options: Options = Options(),  # noqa: B008 - frozen
    progress: Progress | None = None,
    workers: int = 1,
) -> list[SideBySide]:
    """Apply every method of `METHODS` to every group of trials.

    Parameters
    ----------
    recording : Recording
        Recording of returning disturbances.
    by : sequence of str
        Columns of the trial table; trials alike in all of them form a group.
    options : Options
        Options of the estimate; its method is the reference of all differences.
    progress : function (done, all), optional
        Called after each group.
    workers : int
        Number of processes; the estimates are the same to the bit.

    Returns
    -------
    list of SideBySide
        One per group.

    Raises
    ------
    InputError
        For stochastic perturbations, a missing column, windows that cannot be cut.
    ArmImpedanceError
        If no method can run on a group; the message is that of the reference.
    """
    if recording.perturbation == "stochastic":
        raise InputError(
            "stochastic perturbations have one estimator only",
            column="perturbation",
            expected="returning disturbances to compare methods",
        )
    METHODS.named(options.method)
    groups = list(groups_of(recording, by))
    pieces = _pieces(recording, groups, options)
    compared = []
    for side in in_order(_one_group, pieces, workers):
        compared.append(side)
        if progress is not None:
            progress(len(compared), len(groups))
    return compared


def _pieces(
    recording: Recording, groups: Sequence[tuple[Mapping[str, Any], IntArray]], options: Options
) -> Iterator[tuple[Window, Group, Options]]:
    timing = disturbance_times(recording)
    for keys, rows in groups:
        try:
            yield cut_windows(recording, rows, timing), Group.of(recording, keys), options
        except ArmImpedanceError as error:
            raise error_in_group(error, keys) from error


def _one_group(window: Window, group: Group, options: Options) -> SideBySide:
    try:
        return compare_methods(window, group, options)
    except ArmImpedanceError as error:
        raise error_in_group(error, group.keys) from error


def compare_methods(window: Window, group: Group, options: Options) -> SideBySide:
    """Apply every method to the raw windows of one group.

    Raises ArmImpedanceError: if no method can run; the message is that of the reference.
    """
    results = tuple(_run(method, window, group, options) for method in METHODS)
    reference = next(r for r in results if r.method == options.method)
    if all(r.estimate is None for r in results):
        estimate_window(window, group, options)
    others = (r for r in results if r.estimate is not None and r is not reference)
    disagreements = (
        () if reference.estimate is None else (_disagreement(r, reference) for r in others)
    )
    return SideBySide(dict(group.keys), results, tuple(disagreements))


def _run(method: str, window: Window, group: Group, options: Options) -> MethodResult:
    try:
        result = estimate_window(window, group, replace(options, method=method))
        # the second run is timed: the first one imports modules and fills caches
        start = perf_counter()
        shift = _shift(METHODS[method].prepare(window, group.kind), group.kind)
        seconds = perf_counter() - start
    except ArmImpedanceError as error:
        return MethodResult(method, None, str(error))
    return MethodResult(method, result, "", seconds, shift)


def _shift(prepared: Prepared, kind: Kind) -> FloatArray:
    equations, chart = prepared.trial_equations(kind), prepared.chart
    if chart is None:
        return leave_one_out_shift(equations, solve_total(equations))
    free = chart.restrict(equations)
    return chart.expand_change(leave_one_out_shift(free, solve_total(free)))


def _disagreement(result: MethodResult, reference: MethodResult) -> Disagreement:
    a, b = _symmetric(_matrices(result)), _symmetric(_matrices(reference))
    apart, size = np.linalg.norm(a - b, axis=(1, 2)), np.linalg.norm(b, axis=(1, 2))
    percent = 100 * apart / size
    chance = _chance(result, reference)
    errors = np.where(apart <= _ROUNDING * size, 0.0, apart / np.where(chance > 0, chance, np.nan))
    sentences = _sentences(result.method, reference.method, percent, errors)
    return Disagreement(result.method, reference.method, percent, errors, sentences)


def _matrices(result: MethodResult) -> FloatArray:
    estimate = result.estimate
    assert estimate is not None  # noqa: S101 - callers have checked
    return np.stack([getattr(estimate, name) for name in MATRICES])


def _symmetric(matrices: FloatArray) -> FloatArray:
    return (matrices + np.swapaxes(matrices, -1, -2)) / 2


def _chance(result: MethodResult, reference: MethodResult) -> FloatArray:
    """Root mean square (3,) of the norm of the difference by chance, by the jackknife."""
    a, b = result.shift, reference.shift
    if a is None or b is None or a.shape != b.shape:
        return np.full(3, np.nan)
    T, d = len(a), len(_matrices(result)[0])
    moved = _symmetric((a - b).reshape(T, 3, d, d))
    # trace of C over each matrix
    return np.asarray(np.sqrt((T - 1) / T * (moved**2).sum(axis=(0, 2, 3))))


def _sentences(
    method: str, reference: str, percent: FloatArray, errors: FloatArray
) -> tuple[str, ...]:
    large = (errors > FEWEST_STANDARD_ERRORS) & (percent > LEAST_PERCENT)
    if not large.any():
        return ()
    parts = [
        f"{percent[i]:.0f} % in {symbol} ({errors[i]:.1f} standard errors of the difference)"
        for i, (symbol, _) in enumerate(MATRICES.values())
        if large[i]
    ]
    text = f"{method} differs from {reference} by {', '.join(parts)}"
    cause = METHODS[method].differs
    return (f"{text}: {cause}?" if cause else f"{text}: not by chance",)
