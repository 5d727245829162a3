"""Estimation: split a recording into groups, and fit inertia, viscosity and stiffness to each."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any, Final, TypeVar

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import (
    ArmImpedanceError,
    InputError,
    NotIdentifiableError,
    check_number,
)
from armimpedance.core.progress import Progress
from armimpedance.core.records import ImpedanceEstimate, Recording, Window
from armimpedance.core.workers import Crew
from armimpedance.hand.still.methods import METHODS
from armimpedance.hand.still.prepared import BLOCKS_OF_ONE_TRIAL, Prepared
from armimpedance.hand.still.result import ClusteredKind, Group, to_estimate
from armimpedance.hand.still.stochastic import DEFAULT_BAND_HZ, estimate_stochastic
from armimpedance.hand.still.weighing import FEWEST_TRIALS
from armimpedance.numerics.signals import cut_windows, disturbance_times

# Independent pieces of work on several processes: results in order, the same bits as on one.

Result = TypeVar("Result")

#: Pieces queued per worker: enough to keep it busy, few enough to keep memory small.
AHEAD = 3


def in_order(
    work: Callable[..., Result], pieces: Iterable[tuple[Any, ...]], workers: int = 1
) -> Iterator[Result]:
    """``work(*piece)`` for each piece, in the order of the pieces.

    Parameters
    ----------
    work : function of a module's top level
    pieces : iterable of tuples of arguments
        Taken as needed, a few ahead.
    workers : int
        1 works in this process.

    Raises
    ------
    InputError
        Fewer than one worker.
    WorkerError
        A worker was killed, or ran out of memory.
    """
    check_number(workers, f"{workers} workers", low=1)
    if workers == 1:
        yield from (work(*piece) for piece in pieces)
        return
    with Crew(workers) as processes:
        waiting: deque[Future[Result]] = deque()
        for piece in pieces:
            waiting.append(processes.share(work, *piece))
            if len(waiting) > AHEAD * workers:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


#: Default columns that define the groups.
DEFAULT_BY: Final = ("condition",)
#: The method that computes the Cramer-Rao bound anyway.
BOUNDED: Final = "weighted"


@dataclass(frozen=True)
class Options:
    """Options of an estimate.

    Attributes
    ----------
    method : str
        Name of an estimator in `METHODS`; not used for stochastic perturbations.
    covariance : {"cr3", "replicates", "cr1", "bootstrap"}
        Clustered by trial. CR3, the jackknife over trials, also includes the misfit of a linear
        model between directions; "replicates" compares trials of the same direction only;
        "bootstrap" draws trials with replacement.
    band_hz : (low, high)
        Fitted band of stochastic perturbations.
    seed : int
        Seed of the bootstrap.
    bound : bool
        Compute the Cramer-Rao bound too, for the efficiency; `weighted` computes it anyway.
    """

    method: str = METHODS.default
    covariance: ClusteredKind = "cr3"
    band_hz: tuple[float, float] = DEFAULT_BAND_HZ
    seed: int = 0
    bound: bool = True


def estimate(
    recording: Recording,
    *,
    by: Sequence[str] = DEFAULT_BY,
    options: Options = Options(),  # noqa: B008 - frozen
    progress: Progress | None = None,
    workers: int = 1,
) -> list[ImpedanceEstimate]:
    """Hand (or joint) inertia, viscosity and stiffness of every group of trials.

    Solves ``M x'' + B x' + K x = -f`` (22)-(28) by least squares with offset and ramp removed per
    trial; intervals are clustered by trial. Groups appear in the order of the trial table.

    Parameters
    ----------
    recording : Recording
    by : sequence of str
        Columns of the trial table; trials alike in all of them form a group.
    options : Options
    progress : function (done, all), optional
        Called after each group.
    workers : int
        Processes; the result is the same, to the bit.

    Returns
    -------
    list of ImpedanceEstimate
        One per group, at level "hand" or "joint".

    Raises
    ------
    InputError
        If a column is missing or the windows cannot be cut.
    NotIdentifiableError
        If a group's motion does not determine its parameters; names group and parameters.
    """
    groups = list(groups_of(recording, by))
    METHODS.named(options.method)
    results = []
    for result in in_order(_one_group, _pieces(recording, groups, options), workers):
        results.append(result)
        if progress is not None:
            progress(len(results), len(groups))
    return results


_Piece = tuple[Window | Recording, Group, Options]


def _pieces(
    recording: Recording, groups: Sequence[tuple[Mapping[str, Any], np.ndarray]], options: Options
) -> Iterator[_Piece]:
    """Data of each group: its windows, or its trials of a stochastic perturbation."""
    stochastic = recording.perturbation == "stochastic"
    timing = None if stochastic else disturbance_times(recording)
    for keys, rows in groups:
        try:
            group = Group.of(recording, keys)
            if timing is None:
                yield recording.select(rows), group, options
            else:
                group = group.with_activation(recording, rows, timing.onset_s)
                yield cut_windows(recording, rows, timing), group, options
        except ArmImpedanceError as error:
            raise error_in_group(error, keys) from error


def _one_group(piece: Window | Recording, group: Group, options: Options) -> ImpedanceEstimate:
    try:
        if isinstance(piece, Recording):
            return estimate_stochastic(piece, group, options.band_hz, options.covariance)
        return estimate_window(piece, group, options)
    except ArmImpedanceError as error:
        raise error_in_group(error, group.keys) from error


def groups_of(
    recording: Recording, by: Sequence[str]
) -> Iterator[tuple[Mapping[str, Any], np.ndarray]]:
    """Yield the columns' values and the rows (from 0) of every group, in the trial table's order.

    Parameters
    ----------
    recording : Recording
    by : sequence of str
        Columns of the trial table; without any all trials form one group.

    Yields
    ------
    keys : mapping from a column's name to its value
    rows : (n,) int

    Raises
    ------
    InputError
        If a column is missing.
    """
    trials = recording.trials
    if not by:
        yield {}, np.arange(recording.n_trials)
        return
    for column in by:
        if column not in trials:
            raise InputError(
                f"no column {column!r} in the trial table",
                column=column,
                expected=f"one of {', '.join(map(str, trials.columns))}",
            )
    grouped = trials.groupby(list(by), sort=False, dropna=False)
    for key, rows in grouped.indices.items():
        values = key if isinstance(key, tuple) else (key,)
        yield dict(zip(by, values, strict=True)), np.sort(rows)


def error_in_group(error: ArmImpedanceError, keys: Mapping[str, Any]) -> ArmImpedanceError:
    """Copy of the error whose message names its group."""
    where = ", ".join(f"{name} {value}" for name, value in keys.items())
    if isinstance(error, NotIdentifiableError):
        return NotIdentifiableError(f"{where}: {error}", error.parameters)
    return InputError(f"{where}: {error}")


def estimate_window(
    window: Window, group: Group, options: Options, prepared: Prepared | None = None
) -> ImpedanceEstimate:
    """The estimate of one group from its raw windows (used by simulations).

    `prepared` is the result of the method's `prepare`, if the caller already has it.

    Parameters
    ----------
    window : Window
        Raw samples of T trials around each onset.
    group : Group
    options : Options
    prepared : Prepared, optional

    Returns
    -------
    ImpedanceEstimate
        Inertia, viscosity and stiffness of the group, SI, with their covariance and quality.
    """
    method = METHODS.named(options.method)
    if prepared is None:
        prepared = method.prepare(window, group.kind)
    used = window.usable
    bound = prepared.bound
    if bound is None and options.bound:
        bound = _bound(window, group, options.method)
    result = to_estimate(
        prepared.factors,
        group,
        equations=prepared.equations,
        chart=prepared.chart,
        method=options.method,
        covariance=options.covariance,
        strata=None if window.disturbance is None else window.disturbance[used],
        seed=options.seed,
    )
    warnings = (*result.warnings, *prepared.warnings)
    if used.sum() == 1:
        warnings += (
            f"one trial only: intervals from {BLOCKS_OF_ONE_TRIAL} blocks of the same record are "
            "rough and do not see what differs between trials",
        )
    angles = window.joint_angles_at_onset
    return replace(
        result,
        bound=bound,
        position=window.position_at_onset[used].mean(axis=0),
        force=window.force_at_onset[used].mean(axis=0),
        joint_angles=None if angles is None else angles[used].mean(axis=0),
        quality=replace(result.quality, n_trials=int(used.sum())),
        warnings=(*warnings, *group.warnings),
        provenance=(*result.provenance, *window.notes, *prepared.notes, *group.provenance),
        **group.activation,
    )


def _bound(window: Window, group: Group, method: str) -> FloatArray | None:
    """Bound of these windows for a method without its own; None with few trials."""
    if method == BOUNDED or int(window.usable.sum()) < FEWEST_TRIALS:
        return None
    try:
        return METHODS[BOUNDED].prepare(window, group.kind).bound
    except ArmImpedanceError:
        # The method itself worked; windows too short for modes leave it without a bound.
        return None
