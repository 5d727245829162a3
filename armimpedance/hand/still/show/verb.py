"""The verb `estimate`: inertia, viscosity and stiffness of the hand or of joints, by group."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.conventions import group_name
from armimpedance.core.errors import InputError
from armimpedance.core.progress import Progress
from armimpedance.core.records import ImpedanceEstimate, Recording, Subject
from armimpedance.hand.show.estimates import Estimates, ForceBy, opened
from armimpedance.hand.still.doubts.allowance import allowing
from armimpedance.hand.still.doubts.filter import in_step, widened_by_filter
from armimpedance.hand.still.estimation import Options, estimate as estimate_groups, groups_of
from armimpedance.hand.still.methods import METHODS
from armimpedance.hand.still.result import ClusteredKind
from armimpedance.hand.still.show.gate import checked_response
from armimpedance.hand.still.show.options import ALL, ESTIMATE
from armimpedance.hand.still.show.text import methods_table
from armimpedance.hand.still.side_by_side import SideBySide, side_by_side
from armimpedance.show.verbs.checks import check_handle
from armimpedance.show.verbs.results import (
    LeftOut,
    PathLike,
    left_out_sentence,
    left_out_trials,
    without_trials,
)

if TYPE_CHECKING:
    import pandas as pd

# All methods on the same trials, as a table and in a few lines.


@dataclass(frozen=True, repr=False, eq=False)
class ComparedMethods(FrozenRecord):
    """Results of all methods on every group of trials.

    `groups`: estimate of each method in each group, and its difference from the reference.
    `reference`: the method that the others are compared with.
    `gravity_m_s2` (d,) tuple or None: gravity along the hand's axes, from the recording.
    """

    groups: tuple[SideBySide, ...]
    reference: str
    subject: Subject | None = None
    gravity_m_s2: tuple[float, ...] | None = None

    @property
    def estimates(self) -> Estimates:
        """Estimates of the methods that ran, group by group."""
        estimates = tuple(e for side in self.groups for e in side.estimates)
        return Estimates(estimates, self.subject, self.gravity_m_s2)

    def to_frame(self) -> pd.DataFrame:
        """One row per group and method: distance from the reference in M, B and K.

        The distance is in percent of the reference's matrix and in standard errors of the
        difference; `reason` says why a method cannot run.
        """
        import pandas as pd

        return pd.DataFrame([row for side in self.groups for row in self._rows(side)])

    def _rows(self, side: SideBySide) -> Iterator[dict[str, Any]]:
        apart = {d.method: d for d in side.disagreements}
        for result in side.results:
            row = {**side.keys, "method": result.method, "reason": result.reason}
            disagreement = apart.get(result.method)
            for i, symbol in enumerate("MBK"):
                row[f"{symbol}_percent"] = (
                    np.nan if disagreement is None else disagreement.percent[i]
                )
                row[f"{symbol}_standard_errors"] = (
                    np.nan if disagreement is None else disagreement.standard_errors[i]
                )
            yield row

    def __str__(self) -> str:
        return methods_table(self.groups, self.reference)

    def _lines(self) -> list[str]:
        sentences = [
            f"{group_name(side.keys)}: {sentence}"
            for side in self.groups
            for d in side.disagreements
            for sentence in d.sentences
        ]
        nothing = f"no method differs from {self.reference} by more than chance and a few percent"
        rest = [f"... and {len(sentences) - 10} more"] if len(sentences) > 10 else []
        return [f"{len(self.groups)} groups", *(sentences[:10] or [nothing]), *rest]

    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _repr_html_(self) -> str:
        return "".join(f"<p>{escape(line)}</p>" for line in self._lines())


@ESTIMATE.function
def estimate(
    recording: Recording | PathLike,
    *,
    by: str | Sequence[str] = "condition",
    method: str | None = None,
    covariance: ClusteredKind = "cr3",
    seed: int = 0,
    workers: int = 1,
    band_hz: tuple[float, float] | None = None,
    force_by: ForceBy | None = None,
    despite: str | Collection[str] = (),
    leave_out: LeftOut | None = None,
    progress: Progress | None = None,
) -> Estimates:
    """Estimate inertia, viscosity and stiffness of every group of trials.

    Intervals allow for departures from M, B and K (a reflex, a delay, a voluntary response, dry
    friction, a non-linear law) as far as the trials do not exclude them.

    Parameters
    ----------
    recording : Recording or path
        Of the hand or of joints.
    {options}
    leave_out : path, mapping from a trial's number to a reason, or collection of int; optional
        Trials that are left out, for example those of the list that ``armimpedance trials`` saves;
        the provenance of each estimate names those of its group.
    progress : function (done, all), optional
        Called after each group.

    Returns
    -------
    Estimates
        One estimate per group, in the order of the trial table.

    Raises
    ------
    InputError
        The recording cannot be read, a check of `inspect` says STOP, a column or method is unknown,
        or an option has no effect on this kind of perturbation. The message names the file where a
        path was given.
    NotIdentifiableError
        The motion of a group does not determine its parameters.

    Examples
    --------
    >>> from armimpedance.hand.still.show import estimate
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> hand = estimate(recording)
    >>> hand
    1 estimate
    cocontraction_10: weighted, 8 trials, K 408, 153.6 N/m
    1 warning: only 8 clusters ...
    >>> hand["cocontraction_10"].stiffness.unit
    'N/m'
    """
    if method == ALL:
        _refuse_band(band_hz)
        return estimate_all(
            recording,
            by=by,
            covariance=covariance,
            seed=seed,
            workers=workers,
            force_by=force_by,
            despite=despite,
            leave_out=leave_out,
            progress=progress,
        ).estimates
    with opened(recording, by, seed, force_by) as (whole, columns):
        read = without_trials(whole, leave_out)
        chosen: dict[str, Any] = {"covariance": covariance, "seed": seed}
        if read.perturbation == "stochastic":
            _refuse_method(method)
            _refuse_one_joint(read, band_hz)
            chosen |= {} if band_hz is None else {"band_hz": tuple(band_hz)}
        else:
            _refuse_band(band_hz)
            chosen["method"] = METHODS.default if method is None else method
        marks = _marks(read, despite, columns)
        options = Options(**chosen)
        alike, detected = in_step(read)
        estimates = estimate_groups(
            alike, by=columns, options=options, progress=progress, workers=workers
        )
        estimates = allowing(estimates, alike, columns)
        if detected is not None:
            estimates = widened_by_filter(estimates, read, columns, detected)
        estimates = [result.marked(marks) for result in estimates]
        estimates = _noting(estimates, whole, left_out_trials(leave_out), columns)
        return Estimates(tuple(estimates), read.subject, read.gravity_m_s2)


def _noting(
    estimates: Sequence[ImpedanceEstimate],
    whole: Recording,
    chosen: Mapping[int, str],
    by: Sequence[str],
) -> list[ImpedanceEstimate]:
    """Add the trials that were left out by hand to the provenance of their group's estimate."""
    if not chosen:
        return list(estimates)
    trials = whole.trials["trial"]
    of_group = {
        group_name(keys): {int(n): chosen[n] for n in trials.iloc[rows] if n in chosen}
        for keys, rows in groups_of(whole, by)
    }
    return [_noted(estimate, of_group[group_name(estimate.keys)]) for estimate in estimates]


def _noted(estimate: ImpedanceEstimate, chosen: Mapping[int, str]) -> ImpedanceEstimate:
    if not chosen:
        return estimate
    return replace(estimate, provenance=(*estimate.provenance, left_out_sentence(chosen)))


@ESTIMATE.function
def estimate_all(
    recording: Recording | PathLike,
    *,
    by: str | Sequence[str] = "condition",
    covariance: ClusteredKind = "cr3",
    seed: int = 0,
    workers: int = 1,
    force_by: ForceBy | None = None,
    despite: str | Collection[str] = (),
    leave_out: LeftOut | None = None,
    progress: Progress | None = None,
) -> ComparedMethods:
    """Estimate with every method, and say which of them differ by more than chance.

    Parameters
    ----------
    recording : Recording or path
        Of the hand or of joints, with disturbances that return.
    by, covariance, seed, workers, force_by, despite, leave_out, progress
        See `estimate`.

    Returns
    -------
    ComparedMethods
        The estimates of every group with every method, and which methods differ.

    Raises
    ------
    InputError
        As `estimate`; or the perturbation is stochastic, which has one estimator only.

    Examples
    --------
    >>> from armimpedance.hand.still.show import estimate_all
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> compared = estimate_all(recording)
    >>> compared.estimates["cocontraction_10", "exact"].stiffness.axes
    ('x', 'y')
    """
    with opened(recording, by, seed, force_by) as (whole, columns):
        read = without_trials(whole, leave_out)
        marks = _marks(read, despite, columns)
        options = Options(covariance=covariance, seed=seed)
        alike, _ = in_step(read)
        sides = side_by_side(alike, by=columns, options=options, progress=progress, workers=workers)
        groups = [side.marked(marks) for side in sides]
        return ComparedMethods(tuple(groups), options.method, read.subject, read.gravity_m_s2)


def _marks(
    recording: Recording, despite: str | Collection[str], by: Sequence[str]
) -> tuple[str, ...]:
    """Marks for every estimate: checks that warn or were overruled, an unknown handle."""
    marks = checked_response(recording, despite, by=by)
    return (*marks, *(finding.sentence for finding in check_handle(recording)))


def _refuse_method(method: str | None) -> None:
    if method is not None:
        raise InputError(
            f"method {method!r}: stochastic perturbations have one estimator only",
            column="perturbation",
            expected="no method, or disturbances that return",
        )


def _refuse_one_joint(recording: Recording, band_hz: tuple[float, float] | None) -> None:
    """Refuse one joint: a fixed band changes its stiffness by a factor; `elbow` chooses one."""
    if recording.kind == "joint" and recording.axes == 1 and band_hz is None:
        raise InputError(
            "one joint under a random perturbation",
            column="perturbation",
            expected="`armimpedance elbow` (in Python elbow), which asks the record for its band, "
            "the rig and reflexes; or a band of your own (--band LOW HIGH)",
        )


def _refuse_band(band_hz: tuple[float, float] | None) -> None:
    if band_hz is not None:
        raise InputError(
            "a band has no effect on disturbances that return",
            column="perturbation",
            expected="no band, or a stochastic perturbation",
        )
