"""Conversion of a solved regression to an `ImpedanceEstimate`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.conventions import Kind
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.records import ImpedanceEstimate, Quality, Recording
from armimpedance.hand.still.prepared import (
    Chart,
    Prepared,
    fit_names,
    to_fit_order,
    to_matrix_order,
)
from armimpedance.numerics.regression import (
    Fit,
    TrialEquations,
    TrialFactors,
    fit,
    pool,
    solve_equations,
)
from armimpedance.numerics.signals import mean_activation

# Does the motion determine M, B and K? If not, the message uses the terms of the experiment.


def require_identifiable(factors: TrialFactors) -> None:
    """Refuse trials that no method can solve.

    Raises NotIdentifiableError: no movement, movement along one direction only, or columns that
    depend on each other.
    """
    try:
        pool(factors)
    except NotIdentifiableError as error:
        raise _directions_missing(error, factors) from error


def _directions_missing(error: NotIdentifiableError, factors: TrialFactors) -> NotIdentifiableError:
    """Error in the terms of the experiment, if the motion keeps to one direction."""
    d = len(factors.outputs)
    displacement = factors.r[:, :, 2 * d : 3 * d]
    stacked = displacement.reshape(-1, d)
    values, vectors = np.linalg.svd(stacked, full_matrices=False)[1:]
    if values[0] == 0.0:
        return NotIdentifiableError("no movement: nothing can be identified", error.parameters)
    if d > 1 and values[-1] < 1e-6 * values[0]:
        axis = ", ".join(f"{v:.2f}" for v in vectors[0])
        return NotIdentifiableError(
            f"the hand moved along one direction only ({axis}): what the other directions do "
            f"cannot be identified; {error}",
            error.parameters,
        )
    return error


ClusteredKind = Literal["cr3", "replicates", "cr1", "bootstrap"]

#: With fewer clusters than this, clustered intervals are rough, and a warning says so.
FEW_CLUSTERS = 10


@dataclass(frozen=True)
class Group:
    """Facts of a group of trials other than its samples.

    Attributes
    ----------
    kind : {"hand", "joint"}
    keys : mapping
        The group's columns.
    handle_mass_kg : float
    shoulder_m : (d,) or None
    activation : mapping
        Fields of the estimate for the activity of the muscles; empty if it is unknown.
    warnings, provenance : tuples of str
    """

    kind: Kind
    keys: Mapping[str, Any]
    handle_mass_kg: float = 0.0
    shoulder_m: FloatArray | None = None
    activation: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    provenance: tuple[str, ...] = ()

    @classmethod
    def of(cls, recording: Recording, keys: Mapping[str, Any]) -> Group:
        """The group `keys` of a recording."""
        return cls(recording.kind, keys, recording.handle_mass_kg, recording.shoulder_m)

    def with_activation(self, recording: Recording, rows: IntArray, onset_s: FloatArray) -> Group:
        """Copy with the activity of the muscles, if the recording has EMG and MVC.

        An implausible EMG is no reason to refuse the impedance: it becomes a warning.
        """
        try:
            activity = mean_activation(recording, rows, onset_s)
        except InputError as error:
            return replace(self, warnings=(f"activation left out: {error}",))
        if activity is None:
            return self
        fields = {
            "activation": activity.mean,
            "activation_sd": activity.sd,
            "muscles": activity.muscles,
        }
        return replace(self, activation=fields, provenance=activity.notes)


def to_estimate(
    factors: TrialFactors,
    group: Group,
    *,
    method: str,
    covariance: ClusteredKind,
    strata: IntArray | None = None,
    coherence: float | None = None,
    equations: TrialEquations | None = None,
    chart: Chart | None = None,
    seed: int = 0,
) -> ImpedanceEstimate:
    """Solve one group and subtract the handle.

    `factors`: triangular factors of the impedance equation; clusters are trials, or blocks of one
    trial.
    `method`: name of the method for the result.
    `strata` (T,) int: disturbance of each cluster; "replicates" needs it.
    `equations`: solved instead of least squares on the factors, which then only serve the checks.
    `chart`: chart of the equations' parameters that a constraint leaves free.
    `seed`: seed of the bootstrap.
    Raises NotIdentifiableError: if the motion does not determine all parameters.
    Raises InputError: "replicates" without the disturbance of every trial.
    """
    d = len(factors.outputs)
    names, units = fit_names(group.kind, d)
    if covariance == "replicates":
        _require_strata(factors, strata)
    require_identifiable(factors)
    if covariance == "bootstrap" and equations is None:
        equations = Prepared(factors).trial_equations(group.kind)
    # a fit that only checks the rows needs no covariance: the cheapest one is used
    judging = equations is not None and covariance == "cr3"
    solved = fit(
        factors,
        covariance="cr1" if judging or covariance == "bootstrap" else covariance,
        strata=strata,
        parameter_names=names,
        parameter_units=units,
    )
    if equations is None:
        ordered, dof = to_matrix_order(solved.parameters, solved.covariance, d), solved.dof
    else:
        spread = {"covariance": covariance, "strata": strata, "seed": seed}
        ordered, dof = _solved(equations, chart, spread)
    with_handle, viscosity, stiffness = ordered[0].reshape(3, d, d)
    # Between sensor and hand the handle's mass moves with the hand: M_measured = M_limb + m I.
    limb = with_handle - group.handle_mass_kg * np.eye(d) if group.kind == "hand" else with_handle
    result = ImpedanceEstimate(
        level=group.kind,
        method=method,
        inertia=limb,
        inertia_with_handle=with_handle,
        viscosity=viscosity,
        stiffness=stiffness,
        covariance=ordered[1:],
        dof=dof,
        quality=_quality(solved, factors, to_fit_order(ordered[0], d), coherence),
        keys=group.keys,
        shoulder_m=group.shoulder_m,
        warnings=(*solved.warnings, *_few(solved)),
        provenance=(f"method {method}, covariance {covariance}",),
    )
    return result.with_warning(*result.not_definite())


def _solved(
    equations: TrialEquations, chart: Chart | None, spread: dict[str, Any]
) -> tuple[FloatArray, float]:
    """Parameters above their covariance (1 + n, n), and the degrees of freedom."""
    if chart is None:
        solved = solve_equations(equations, **spread)
        return np.vstack([solved.parameters, solved.covariance]), solved.dof
    free = solve_equations(chart.restrict(equations), **spread)
    T = chart.basis
    return np.vstack([chart.expand(free.parameters), T @ free.covariance @ T.T]), free.dof


def _require_strata(factors: TrialFactors, strata: IntArray | None) -> None:
    if strata is None or len(strata) != factors.n_clusters:
        raise InputError(
            "replicates need to know which trials had the same disturbance",
            column="direction_deg",
            expected="it in trials.csv for every trial, or --covariance cr3",
        )


def _quality(
    solved: Fit, factors: TrialFactors, coefficients: FloatArray, coherence: float | None
) -> Quality:
    """Quality of the prediction of the factors' rows by coefficients (p, q)."""
    vaf, correlation = factors.prediction_quality(coefficients)
    return Quality(
        n_trials=solved.n_trials,
        n_rows=solved.n_rows,
        multiple_correlation=correlation,
        vaf=vaf,
        cond_raw=solved.cond_raw,
        cond_scaled=solved.cond_scaled,
        rank=solved.rank,
        residual_sd=solved.residual_sd,
        coherence=coherence,
    )


def _few(solved: Fit) -> tuple[str, ...]:
    if solved.n_trials >= FEW_CLUSTERS:
        return ()
    return (
        f"only {solved.n_trials} clusters (trials, or blocks of one): intervals rest on t with "
        f"{solved.dof:g} degrees of freedom",
    )
