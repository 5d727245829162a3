"""The groups that are compared: an estimate each, and its trials where they are at hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from armimpedance.core.arrays import IntArray
from armimpedance.core.errors import ArmImpedanceError, InputError, NotIdentifiableError
from armimpedance.core.progress import Progress
from armimpedance.core.records import ImpedanceEstimate, Recording, Window
from armimpedance.hand.still import METHODS, Group, Options, estimate, estimate_window, groups_of
from armimpedance.numerics.regression import TrialEquations
from armimpedance.numerics.signals import cut_windows, disturbance_times


@dataclass(frozen=True, eq=False)
class ComparedGroup:
    """One group.

    Attributes
    ----------
    name : str
        The values of its columns, ``relaxed`` or ``relaxed, 2``.
    estimate : ImpedanceEstimate
    equations : TrialEquations or None
        One pair (A_t, b_t) per trial for the limb's own M, B, K; None: only the estimate is known.
    disturbance : (T,) int or None
        Trials with the same number saw the same disturbance, across groups; None: not known.
    """

    name: str
    estimate: ImpedanceEstimate
    equations: TrialEquations | None = None
    disturbance: IntArray | None = None


def name_of(keys: Mapping[str, Any], by: Sequence[str]) -> str:
    """The values of the columns `by`, whole numbers without a decimal point.

    `keys`: columns of a group.
    `by`: columns whose values make the group's name.
    Returns the values in the order of `by`, separated by commas.
    """
    values = [keys[column] for column in by]
    whole = [int(v) if isinstance(v, float) and v.is_integer() else v for v in values]
    return ", ".join(map(str, whole))


def without_handle(equations: TrialEquations, handle_mass_kg: float) -> TrialEquations:
    """The same equations for the limb's own inertia.

    ``b_t - A_t (theta + m h) = 0`` with h the identity in the place of M: ``b_t := b_t - A_t m h``.
    Groups with different handles can then exchange trials.
    """
    n = len(equations.names)
    k = round(np.sqrt(n / 3))
    handle = np.zeros(n)
    handle[: k * k] = handle_mass_kg * np.eye(k).ravel()
    return replace(equations, b=equations.b - equations.A @ handle)


def groups_of_recording(
    recording: Recording,
    by: Sequence[str],
    *,
    options: Options = Options(),  # noqa: B008 - frozen
    keys: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> list[ComparedGroup]:
    """Estimate every group of a recording and keep its trials' equations.

    Parameters
    ----------
    recording : Recording
        Stochastic perturbations give estimates without trials: they have no window per trial.
    by : sequence of str
        Columns of the trial table, or names in `keys`.
    options : Options
    keys : mapping, optional
        Columns that are the same for all trials, for example ``{"recording": "monday"}``.
    progress : function (done, all), optional

    Returns
    -------
    list of ComparedGroup
        One group for each set of values in the columns `by`, with the equations of its trials.

    Raises
    ------
    InputError
        A column is missing, or a group has one trial.
    NotIdentifiableError
        A group's motion does not determine its parameters.
    """
    given = dict(keys or {})
    columns = [column for column in by if column not in given]
    if recording.perturbation == "stochastic":
        found = estimate(recording, by=columns, options=options, progress=progress)
        return groups_of_estimates([replace(e, keys={**given, **e.keys}) for e in found], by)
    parts = _parts(recording, columns)
    timing, groups = disturbance_times(recording), []
    for done, (own, rows) in enumerate(parts, start=1):
        named = {**given, **own}
        try:
            window = cut_windows(recording, rows, timing)
            groups.append(_group(recording, window, named, by, options))
        except ArmImpedanceError as error:
            message = f"{name_of(named, by)}: {error}"
            if isinstance(error, NotIdentifiableError):
                raise NotIdentifiableError(message, error.parameters) from error
            raise InputError(message) from error
        if progress is not None:
            progress(done, len(parts))
    return groups


def groups_of_estimates(
    estimates: Sequence[ImpedanceEstimate], by: Sequence[str]
) -> list[ComparedGroup]:
    """Groups of which only the estimates are known.

    `by`: names among their keys.
    Returns one group per estimate, named by its values of `by`; none holds equations of trials.
    Raises InputError: a column is missing, or two estimates are alike in all of them.
    """
    groups: dict[str, ComparedGroup] = {}
    for found in estimates:
        for column in by:
            if column not in found.keys:
                raise InputError(
                    "no such column of groups",
                    column=column,
                    expected=f"one of {', '.join(found.keys) or 'none: the results name no group'}",
                )
        name = name_of(found.keys, by)
        if name in groups:
            raise InputError(
                f"several results for {name}",
                expected="one per group: name further columns with --by, or the subjects' with "
                "--subjects",
            )
        groups[name] = ComparedGroup(name, found)
    return list(groups.values())


def _parts(recording: Recording, columns: Sequence[str]) -> list[tuple[dict[str, Any], IntArray]]:
    """Keys and row numbers of each group of trials, in the order of the table."""
    return [
        ({name: v.item() if isinstance(v, np.generic) else v for name, v in keys.items()}, rows)
        for keys, rows in groups_of(recording, columns)
    ]


def _group(
    recording: Recording,
    window: Window,
    keys: Mapping[str, Any],
    by: Sequence[str],
    options: Options,
) -> ComparedGroup:
    if window.usable.sum() < 2:
        raise InputError(
            "a group of one usable trial: what differs between its trials cannot be seen",
            expected="two trials or more in each group",
        )
    prepared = METHODS.named(options.method).prepare(window, recording.kind)
    made = estimate_window(window, Group.of(recording, keys), options, prepared)
    equations = prepared.trial_equations(recording.kind)
    if prepared.equations is not None:
        equations = _on_one_scale(equations)
    handle = recording.handle_mass_kg if recording.kind == "hand" else 0.0
    return ComparedGroup(
        name_of(keys, by), made, without_handle(equations, handle), _directions(recording, window)
    )


def _on_one_scale(equations: TrialEquations) -> TrialEquations:
    """Weights relative to the group's mean: a weighted fit's own scale is its noise's."""
    scale = abs(float(equations.A.mean(axis=0)[-1, -1])) or 1.0
    return replace(equations, A=equations.A / scale, b=equations.b / scale)


def _directions(recording: Recording, window: Window) -> IntArray | None:
    """Direction of each usable trial in thousandths of a degree: the same number in all groups.

    In space, turns of the angle above the plane are counted on top (column ``elevation_deg``).
    """
    if window.disturbance is None:
        return None
    row_of = {int(trial): row for row, trial in enumerate(recording.trials["trial"])}
    rows = [row_of[int(trial)] for trial in window.trial[window.usable]]
    degrees = recording.trials["direction_deg"].to_numpy(dtype=float)[rows]
    around = np.round(1000 * (degrees % 360)).astype(np.int64) % 360_000
    if "elevation_deg" not in recording.trials:
        return around
    above = recording.trials["elevation_deg"].to_numpy(dtype=float, na_value=0.0)[rows]
    return around + 360_000 * np.round(1000 * above).astype(np.int64)
