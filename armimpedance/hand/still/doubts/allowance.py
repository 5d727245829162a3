"""Intervals that allow for what the data do not exclude: a mixture over the departures.

The limb has none of the departures or one. The number k of a departure is normal about zero
beforehand, with the size that it usually has, and k_hat +- s by the data, so that the odds of it
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
from armimpedance.hand.still.doubts.inner import averaged_inner, freedom_told, with_inner
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

# What all estimates of a recording have in common of what may make them wrong.
#
# A reflex, a gain or a delay is one person's or one rig's: it makes all conditions wrong together.
# With the error u_gc of group g by the column c of a departure, the groups' joint covariance is
# ``sum_c u_c u_c^T``, u_c of all groups below each other. Columns of one departure differ little,
# so that one vector stands for them.


def in_common(errors: Sequence[Mapping[str, FloatArray]]) -> list[dict[str, FloatArray]]:
    """One vector of each departure for each group, which together hold most of its variance.

    `errors` sequence of mapping of str to (columns, p): of each group what each column of each
    departure makes wrong, in standard deviations; none of a group of which nothing is known.
    Returns: list of dict of str to (p,): signs are those of the columns' sum: departures of one
    recording and of the next add.
    """
    names = dict.fromkeys(name for one in errors for name in one)
    found: list[dict[str, FloatArray]] = [{} for _ in errors]
    for name in names:
        groups = [g for g, one in enumerate(errors) if name in one]
        # U (columns, groups p) = sum_i s_i u_i v_i^T; U^T U, the covariance, is nearly s_1^2 v v^T
        U = np.concatenate([errors[g][name] for g in groups], axis=1)
        main = np.linalg.svd(U, full_matrices=False)
        vector = main.S[0] * main.Vh[0] * (-1 if main.Vh[0] @ U.sum(axis=0) < 0 else 1)
        for g, part in zip(groups, np.split(vector, len(groups)), strict=True):
            found[g][name] = part
    return found


def allowing(
    estimates: Sequence[ImpedanceEstimate], recording: Recording, by: Sequence[str]
) -> list[ImpedanceEstimate]:
    """The estimates of a recording's groups with intervals that hold what is not excluded.

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
        With a larger covariance, the provenance saying by how much; as they are where a group has
        too few trials to be asked, or the perturbation is stochastic.
    """
    if recording.perturbation != "returning":
        return list(estimates)
    groups = [rows for _, rows in groups_of(recording, by)]
    longest = _longest(recording, groups, tuple(by) == DEFAULT_BY)
    if not longest:
        return list(estimates)
    known = [longest[group] for group in sorted(longest, key=lambda g: _rank(g, longest[g]))]
    limb = inner_of(known, freedom_told(recording, np.arange(recording.n_trials)))
    squares, uneven = _squares(known, beside_inner(limb)), _uneven(known)
    gains = possible_gains(recording, [(groups[g][longest[g].usable], longest[g]) for g in longest])
    # A model is as large as its trials' windows: of the others one at a time is kept.
    others = models_of(recording, [rows for g, rows in enumerate(groups) if g not in longest])
    wider: list[ImpedanceEstimate] = []
    errors: list[dict[str, FloatArray]] = []
    for group, (one, rows) in enumerate(zip(estimates, groups, strict=True)):
        model = longest[group] if group in longest else next(others)
        if model is None:
            errors.append({})
            wider.append(one)
            continue
        errors.append(_errors(model, squares, uneven))
        if gains:
            errors[-1]["gain in the session"] = wrong_by_gains(gains, rows[model.usable], model)
        one = _wider(one, errors[-1])
        if model.inner is not None:
            inner = averaged_inner(model.inner, freedom_told(recording, rows))
            one = with_inner(one, inner, correct=one.method == BOUNDED)
        wider.append(one)
    shared = in_common(errors)
    return [
        replace(one, shared_errors={**one.shared_errors, **own})
        for one, own in zip(wider, shared, strict=True)
    ]


def _rank(group: int, model: Model) -> tuple[int, int]:
    """Groups with more usable trials come first, then those that stand first."""
    return -model.equation.trials, group


def _longest(
    recording: Recording, groups: Sequence[IntArray], by_condition: bool
) -> dict[int, Model]:
    """The models of the groups with most usable trials, by their number in `groups`.

    `by_condition`: the groups are the conditions, which the checks have fitted already.
    """
    made = largest_conditions(recording) if by_condition else ()
    ready = {rows.tobytes(): model for rows, model in made}
    order = sorted(range(len(groups)), key=lambda group: (-len(groups[group]), group))
    keys = [rows.tobytes() for rows in groups]
    others = models_of(recording, [groups[group] for group in order if keys[group] not in ready])
    found: dict[int, Model] = {}
    for group in order:
        model = ready[keys[group]] if keys[group] in ready else next(others)
        if model is not None:
            found[group] = model
        if len(found) > MOST_CONDITIONS:
            del found[max(found, key=lambda g: _rank(g, found[g]))]
        # no group has more usable trials than trials
        if len(found) == MOST_CONDITIONS and (-len(groups[group]), group) >= max(
            _rank(g, found[g]) for g in found
        ):
            break
    return found


def _squares(models: Sequence[Model], beside: str | None) -> dict[str, float]:
    """Mean square of every departure's number that matters, by its column.

    `beside`: a column that is in the model, too.
    """
    found = [pooled(models, column, beside) for column in ALL_COLUMNS]
    squares = mean_squares(*numbers_of(found))
    return {name: float(each) for name, each in zip(ALL_COLUMNS, squares, strict=True) if each > 0}


def _uneven(models: Sequence[Model]) -> float:
    """Mean square of the gain of one axis beside the others; 0 where it can hardly be told.

    What no record shows is for a calibration, and no interval would be narrow that allowed for it.
    """
    one = gain_of(models)
    if one is None or one.limit > LARGEST_GAIN:
        return 0.0
    return float(mean_square_of_gain(np.array(one.size), one.error))


def _errors(model: Model, squares: Mapping[str, float], uneven: float) -> dict[str, FloatArray]:
    """What each departure makes wrong, (columns, 3 d^2), in roots of mean squares."""
    found: dict[str, list[FloatArray]] = {}
    for column, square in squares.items():
        error = np.sqrt(square) * model.shift(column)
        found.setdefault(family(column), []).append(error)
    d = model.equation.axes
    for axis in range(d if uneven else 0):
        # either axis may be the wrong one
        found[f"gain {AXES[axis]}"] = [np.sqrt(uneven / d) * rows_of(model.parameters, axis)]
    return {name: np.array(errors) for name, errors in found.items()}


def _wider(one: ImpedanceEstimate, errors: Mapping[str, FloatArray]) -> ImpedanceEstimate:
    """One group's estimate with the mean square of what each departure makes wrong."""
    more: FloatArray = np.zeros_like(one.covariance)
    for each in errors.values():
        more += each.T @ each
    own = np.diag(one.covariance)
    ratio = float(np.sqrt(1 + np.max(np.diag(more) / np.where(own > 0, own, np.inf))))
    note = (
        "intervals allow for delay, reflex, amplitude, friction, a voluntary answer and gains as "
        "far as the trials do not exclude them: at most "
        f"{ratio:.2f} times as wide as without"
    )
    # no estimator knows more of the departures: the bound grows alike, the efficiency compares both
    bound = None if one.bound is None else one.bound + more
    wider = replace(one, covariance=one.covariance + more, bound=bound)
    return replace(wider, provenance=(*one.provenance, note))
