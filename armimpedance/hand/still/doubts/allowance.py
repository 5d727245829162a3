"""Intervals that allow for departures that the data do not exclude: a mixture over them.

The limb has one of the departures or none. The prior of the size k of a departure is normal about
zero, with its usual size as standard deviation; the data give k_hat +- s. The odds of the departure
against none change by

    sqrt(s^2 / (s^2 + c^2)) exp(k_hat^2 c^2 / (2 s^2 (s^2 + c^2))),   c its usual size:

the Bayes factor of a normal mean, see H. Jeffreys, *Theory of Probability* (Oxford, 1961), chapter
5. If k makes the estimate wrong by g k, the estimate's mean square error grows by
``sum_m p_m g_m g_m^T E_m[k^2]`` over the departures m, p_m their probabilities.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.conventions import AXES
from armimpedance.core.records import ImpedanceEstimate, Recording
from armimpedance.hand.still.doubts.changed_gain import possible_gains, wrong_by_gains
from armimpedance.hand.still.doubts.departures import (
    MOST_CONDITIONS,
    largest_conditions,
    models_of,
)
from armimpedance.hand.still.doubts.inner import averaged_inner, stated_freedom, with_inner
from armimpedance.hand.still.doubts.mixture import mean_square_of_gain, mean_squares
from armimpedance.hand.still.doubts.model import (
    ALL_COLUMNS,
    Model,
    beside_inner,
    family,
    inner_of,
    numbers_of,
    pooled,
)
from armimpedance.hand.still.doubts.symmetry import LARGEST_GAIN, gain_of, rows_of
from armimpedance.hand.still.estimation import BOUNDED, DEFAULT_BY, groups_of

# Errors that all estimates of a recording have in common.
# A reflex belongs to the person, a gain or a delay to the rig: they affect all conditions together.
# With the error u_gc of group g by the column c of a departure, the groups' joint covariance is
# ``sum_c u_c u_c^T``, u_c of all groups below each other. Columns of one departure differ little,
# so that one vector replaces them.


def in_common(errors: Sequence[Mapping[str, FloatArray]]) -> list[dict[str, FloatArray]]:
    """One vector of each departure for each group, which together hold most of its variance.

    `errors` sequence of mapping of str to (columns, p): for each group the errors by each column of
    each departure, in standard deviations; empty for a group without a model.
    Returns: list of dict of str to (p,). Signs are those of the columns' sum, so that departures of
    different recordings add.
    """
    names = dict.fromkeys(name for group_errors in errors for name in group_errors)
    vectors: list[dict[str, FloatArray]] = [{} for _ in errors]
    for name in names:
        groups = [g for g, group_errors in enumerate(errors) if name in group_errors]
        # U (columns, groups p) = sum_i s_i u_i v_i^T; U^T U, the covariance, is nearly s_1^2 v v^T
        U = np.concatenate([errors[g][name] for g in groups], axis=1)
        main = np.linalg.svd(U, full_matrices=False)
        vector = main.S[0] * main.Vh[0] * (-1 if main.Vh[0] @ U.sum(axis=0) < 0 else 1)
        for g, part in zip(groups, np.split(vector, len(groups)), strict=True):
            vectors[g][name] = part
    return vectors


def allowing(
    estimates: Sequence[ImpedanceEstimate], recording: Recording, by: Sequence[str]
) -> list[ImpedanceEstimate]:
    """Widen the intervals of the groups of a recording by the departures not excluded.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        One for each group, in the order of the trial table.
    recording : Recording
    by : sequence of str
        Columns of the groups.

    Returns
    -------
    list of ImpedanceEstimate
        With a larger covariance; the provenance says by how much. Unchanged if a group has too few
        trials, or the perturbation is stochastic.
    """
    if recording.perturbation != "returning":
        return list(estimates)
    groups = [rows for _, rows in groups_of(recording, by)]
    longest = _longest(recording, groups, tuple(by) == DEFAULT_BY)
    if not longest:
        return list(estimates)
    models = [longest[group] for group in sorted(longest, key=lambda g: _rank(g, longest[g]))]
    limb = inner_of(models, stated_freedom(recording, np.arange(recording.n_trials)))
    squares, uneven = _squares(models, beside_inner(limb)), _uneven(models)
    gains = possible_gains(recording, [(groups[g][longest[g].usable], longest[g]) for g in longest])
    # A model is as large as its trials' windows: of the other groups one at a time is kept.
    others = models_of(recording, [rows for g, rows in enumerate(groups) if g not in longest])
    wider: list[ImpedanceEstimate] = []
    errors: list[dict[str, FloatArray]] = []
    for group, (estimate, rows) in enumerate(zip(estimates, groups, strict=True)):
        model = longest[group] if group in longest else next(others)
        if model is None:
            errors.append({})
            wider.append(estimate)
            continue
        errors.append(_errors(model, squares, uneven))
        if gains:
            errors[-1]["gain in the session"] = wrong_by_gains(gains, rows[model.usable], model)
        estimate = _wider(estimate, errors[-1])
        if model.inner is not None:
            inner = averaged_inner(model.inner, stated_freedom(recording, rows))
            estimate = with_inner(estimate, inner, correct=estimate.method == BOUNDED)
        wider.append(estimate)
    shared = in_common(errors)
    return [
        replace(estimate, shared_errors={**estimate.shared_errors, **own})
        for estimate, own in zip(wider, shared, strict=True)
    ]


def _rank(group: int, model: Model) -> tuple[int, int]:
    """Sort key: groups with more usable trials first, then in the order of `groups`."""
    return -model.equation.trials, group


def _longest(
    recording: Recording, groups: Sequence[IntArray], by_condition: bool
) -> dict[int, Model]:
    """Models of the groups with most usable trials, by their number in `groups`.

    `by_condition`: True if the groups are the conditions, which the checks have already fitted.
    """
    fitted = largest_conditions(recording) if by_condition else ()
    ready = {rows.tobytes(): model for rows, model in fitted}
    order = sorted(range(len(groups)), key=lambda group: (-len(groups[group]), group))
    keys = [rows.tobytes() for rows in groups]
    others = models_of(recording, [groups[group] for group in order if keys[group] not in ready])
    models: dict[int, Model] = {}
    for group in order:
        model = ready[keys[group]] if keys[group] in ready else next(others)
        if model is not None:
            models[group] = model
        if len(models) > MOST_CONDITIONS:
            del models[max(models, key=lambda g: _rank(g, models[g]))]
        # groups are sorted by trials, and usable trials are never more: no later group can enter
        if len(models) == MOST_CONDITIONS and (-len(groups[group]), group) >= max(
            _rank(g, models[g]) for g in models
        ):
            break
    return models


def _squares(models: Sequence[Model], beside: str | None) -> dict[str, float]:
    """Mean square of the size of every departure that is not negligible, by its column.

    `beside`: a further column in the model.
    """
    departures = [pooled(models, column, beside) for column in ALL_COLUMNS]
    squares = mean_squares(*numbers_of(departures))
    return {
        name: float(square) for name, square in zip(ALL_COLUMNS, squares, strict=True) if square > 0
    }


def _uneven(models: Sequence[Model]) -> float:
    """Mean square of the gain of one axis relative to the others; 0 if hardly detectable.

    A gain that no record shows is a matter of calibration: allowing for it would make every
    interval wide.
    """
    gain = gain_of(models)
    if gain is None or gain.limit > LARGEST_GAIN:
        return 0.0
    return float(mean_square_of_gain(np.array(gain.size), gain.error))


def _errors(model: Model, squares: Mapping[str, float], uneven: float) -> dict[str, FloatArray]:
    """Errors by each departure, (columns, 3 d^2), as roots of mean squares."""
    errors: dict[str, list[FloatArray]] = {}
    for column, square in squares.items():
        error = np.sqrt(square) * model.shift(column)
        errors.setdefault(family(column), []).append(error)
    d = model.equation.axes
    for axis in range(d if uneven else 0):
        # either axis may be the wrong one
        errors[f"gain {AXES[axis]}"] = [np.sqrt(uneven / d) * rows_of(model.parameters, axis)]
    return {name: np.array(arrays) for name, arrays in errors.items()}


def _wider(estimate: ImpedanceEstimate, errors: Mapping[str, FloatArray]) -> ImpedanceEstimate:
    """The estimate of a group with the mean squared errors of all departures added."""
    more: FloatArray = np.zeros_like(estimate.covariance)
    for error in errors.values():
        more += error.T @ error
    own = np.diag(estimate.covariance)
    ratio = float(np.sqrt(1 + np.max(np.diag(more) / np.where(own > 0, own, np.inf))))
    note = (
        "intervals allow for delay, reflex, amplitude, friction, a voluntary answer and gains as "
        "far as the trials do not exclude them: at most "
        f"{ratio:.2f} times as wide as without"
    )
    # no estimator has more information on the departures: the bound grows alike, for the efficiency
    bound = None if estimate.bound is None else estimate.bound + more
    wider = replace(estimate, covariance=estimate.covariance + more, bound=bound)
    return replace(wider, provenance=(*estimate.provenance, note))
