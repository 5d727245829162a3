"""The groups that are compared: an estimate each, and its trials if available."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isnan
from typing import Any, Final, Literal, overload

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import ArmImpedanceError, InputError, NotIdentifiableError
from armimpedance.core.findings import Finding
from armimpedance.core.progress import Progress
from armimpedance.core.records import ImpedanceEstimate, Recording, Window
from armimpedance.hand.comparison.differences import Change, Label, Side, change_numbers
from armimpedance.hand.comparison.matrix_test import MATRIX_NAMES, MatrixTest
from armimpedance.hand.still import METHODS, Group, Options, estimate, estimate_window, groups_of
from armimpedance.numerics.regression import TrialEquations, t_factor
from armimpedance.numerics.signals import cut_windows, disturbance_times


@dataclass(frozen=True, eq=False)
class ComparedGroup:
    """One group of a comparison.

    Attributes
    ----------
    name : str
        The values of its columns, ``relaxed`` or ``relaxed, 2``.
    estimate : ImpedanceEstimate
    equations : TrialEquations or None
        One pair (A_t, b_t) per trial for the limb's own M, B, K; None if only the estimate is
        available.
    disturbance : (T,) int or None
        Trials with the same number had the same disturbance, across groups; None if unknown.
    """

    name: str
    estimate: ImpedanceEstimate
    equations: TrialEquations | None = None
    disturbance: IntArray | None = None


def name_of(keys: Mapping[str, Any], by: Sequence[str]) -> str:
    """Name of a group: values of the columns `by`, whole numbers without a decimal point.

    `keys`: columns of a group.
    `by`: columns whose values make the group's name.
    Returns: the values in the order of `by`, separated by commas.
    """
    values = [keys[column] for column in by]
    whole = [int(v) if isinstance(v, float) and v.is_integer() else v for v in values]
    return ", ".join(map(str, whole))


def without_handle(equations: TrialEquations, handle_mass_kg: float) -> TrialEquations:
    """The same equations for the limb's own inertia.

    ``b_t - A_t (theta + m h) = 0`` with h the identity at the elements of M:
    ``b_t := b_t - A_t m h``. Groups with different handles can then exchange trials.
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
    fixed_keys = dict(keys or {})
    columns = [column for column in by if column not in fixed_keys]
    if recording.perturbation == "stochastic":
        estimates = estimate(recording, by=columns, options=options, progress=progress)
        return groups_of_estimates(
            [replace(e, keys={**fixed_keys, **e.keys}) for e in estimates], by
        )
    parts = _parts(recording, columns)
    timing, groups = disturbance_times(recording), []
    for done, (group_keys, rows) in enumerate(parts, start=1):
        named = {**fixed_keys, **group_keys}
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
    """Groups without trials, from estimates.

    `by`: names among their keys.
    Returns: one group per estimate, named by its values of `by`; none has equations of trials.
    Raises InputError: a column is missing, or two estimates are alike in all of them.
    """
    groups: dict[str, ComparedGroup] = {}
    for one in estimates:
        for column in by:
            if column not in one.keys:
                raise InputError(
                    "no such column of groups",
                    column=column,
                    expected=f"one of {', '.join(one.keys) or 'none: the results name no group'}",
                )
        name = name_of(one.keys, by)
        if name in groups:
            raise InputError(
                f"several results for {name}",
                expected="one per group: name further columns with --by, or the subjects' with "
                "--subjects",
            )
        groups[name] = ComparedGroup(name, one)
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
    estimate = estimate_window(window, Group.of(recording, keys), options, prepared)
    equations = prepared.trial_equations(recording.kind)
    if prepared.equations is not None:
        equations = _on_one_scale(equations)
    handle = recording.handle_mass_kg if recording.kind == "hand" else 0.0
    return ComparedGroup(
        name_of(keys, by),
        estimate,
        without_handle(equations, handle),
        _directions(recording, window),
    )


def _on_one_scale(equations: TrialEquations) -> TrialEquations:
    """Divide by the mean weight of the group: a weighted fit is scaled by its noise."""
    scale = abs(float(equations.A.mean(axis=0)[-1, -1])) or 1.0
    return replace(equations, A=equations.A / scale, b=equations.b / scale)


def _directions(recording: Recording, window: Window) -> IntArray | None:
    """Direction of each usable trial in thousandths of a degree: the same number in all groups.

    In space, the angle above the plane (column ``elevation_deg``) is added as multiples of a turn.
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


# Pairs of compared groups, and the inertia that two sessions must share.

Basis = Literal["permutation", "covariance", "first order"]

#: Pairs whose changes are computed at once: some 0.6 MB.
BLOCK: Final = 512


@dataclass(frozen=True, repr=False)
class Pair:
    """Comparison of two groups.

    `first`, `second`: names of the groups; changes are from the first to the second.
    `tests`: inertia, viscosity, stiffness, all three; p values adjusted over all pairs.
    `basis`: "permutation" if trials were exchanged; else the tests use the estimates' covariances,
    that of the distance by draws from them or, with many pairs, by its distribution to first order.
    """

    first: str
    second: str
    changes: Sequence[Change]
    tests: tuple[MatrixTest, ...]
    basis: Basis
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        tested = (f"{test.matrix} p = {test.p_t2_adjusted:.2g}" for test in self.tests)
        return f"{self.first} | {self.second}: {', '.join(tested)} (T2, adjusted)"


def notes_of(tests: Sequence[MatrixTest]) -> tuple[str, ...]:
    """Notes on missing results of a pair's tests."""
    notes: tuple[str, ...] = ()
    missing = [test.matrix for test in tests[:3] if isnan(test.distance)]
    if missing:
        notes += (f"no distance: {', '.join(missing)} of a group is not positive definite",)
    if any(isnan(test.p_t2) for test in tests):
        notes += ("too few trials for T2 of all three matrices together",)
    return notes


@dataclass(frozen=True, eq=False)
class ManyPairs(Sequence[Pair]):
    """Many pairs of groups: a `Pair` is built when it is accessed.

    `names`: names of the groups.
    `first`, `second` (R,): indices of the groups of each pair.
    `sides`: values of each group for the changes.
    `labels`: quantities of the changes.
    `tests` (R, 4, 6): of inertia, viscosity, stiffness and all: the fields of `MatrixTest` after
    its name.
    """

    names: tuple[str, ...]
    first: IntArray
    second: IntArray
    sides: tuple[Side, ...]
    labels: tuple[Label, ...]
    tests: FloatArray
    basis: Basis = "first order"

    def __len__(self) -> int:
        return len(self.first)

    @overload
    def __getitem__(self, index: int) -> Pair: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Pair, ...]: ...
    def __getitem__(self, index: int | slice) -> Pair | tuple[Pair, ...]:
        if isinstance(index, slice):
            return tuple(self[row] for row in range(*index.indices(len(self))))
        row = range(len(self))[index]
        return self._pair(row, LaterChanges(_Block(self, row, row + 1), 0))

    def __iter__(self) -> Iterator[Pair]:
        for start in range(0, len(self), BLOCK):
            block = _Block(self, start, min(start + BLOCK, len(self)))
            for row in range(start, block.stop):
                yield self._pair(row, LaterChanges(block, row - start))

    def _pair(self, row: int, later: LaterChanges) -> Pair:
        i, j = int(self.first[row]), int(self.second[row])
        numbers = self.tests[row].tolist()
        tests = tuple(
            MatrixTest(name, *values) for name, values in zip(MATRIX_NAMES, numbers, strict=True)
        )
        return Pair(self.names[i], self.names[j], later, tests, self.basis, notes_of(tests))


@dataclass(frozen=True, eq=False)
class _Block:
    """Neighbouring pairs, whose changes are computed together when one is accessed."""

    pairs: ManyPairs
    start: int
    stop: int

    @cached_property
    def numbers(self) -> list[list[list[float]]]:
        """Result of `change_numbers` for each pair."""
        rows, pairs = slice(self.start, self.stop), self.pairs
        return change_numbers(pairs.sides, pairs.first[rows], pairs.second[rows]).tolist()  # type: ignore[no-any-return]


@dataclass(frozen=True, eq=False)
class LaterChanges(Sequence[Change]):
    """The changes of one of many pairs, computed when they are accessed."""

    block: _Block
    row: int

    def _made(self) -> tuple[Change, ...]:
        numbers = self.block.numbers[self.row]
        labels = self.block.pairs.labels
        return tuple(Change(*label, *values) for label, values in zip(labels, numbers, strict=True))

    def __len__(self) -> int:
        return len(self.block.pairs.labels)

    def __iter__(self) -> Iterator[Change]:
        return iter(self._made())

    @overload
    def __getitem__(self, index: int) -> Change: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Change, ...]: ...
    def __getitem__(self, index: int | slice) -> Change | tuple[Change, ...]:
        return self._made()[index]


# The inertia at one posture is a check of two sessions: no muscle can change it.

#: Groups whose mean places are nearer than this are in one posture (m, rad).
SAME_PLACE: Final = 0.02
#: Smallest relative difference of the inertia that is reported, if it is significant.
LEAST_CHANGE: Final = 0.03
#: Multiple of the half-width of a 95 % interval that chance exceeds less than once in a hundred
#: times.
UNLIKELY: Final = 1.45


def check_inertia(groups: Sequence[ComparedGroup], pairs: Sequence[Pair]) -> tuple[Finding, ...]:
    """Check for pairs of one person at one place whose inertia differs by a factor.

    Returns: "inertia", one for each pair that differs, or one for all that do not; empty if no two
    groups are in one posture.
    """
    of = {group.name: group.estimate for group in groups}
    findings, limits = [], []
    for pair in pairs:
        first, second = of[pair.first], of[pair.second]
        if not _one_posture(first, second):
            continue
        change, error = _factor(first, second)
        # with more pairs the limit grows as for the maximum of normal numbers
        many = float(np.sqrt(1 + 2 * np.log(len(pairs)) / (UNLIKELY * t_factor(np.inf)) ** 2))
        limit = max(LEAST_CHANGE, many * UNLIKELY * t_factor(first.dof + second.dof) * error)
        limits.append(limit)
        if abs(change) > limit:
            text = (
                f"{pair.first} | {pair.second}: {100 * change:+.1f} % (sd {100 * error:.1f}) at "
                "one posture, which no muscle can make; a gain, a unit, the sensors' timing or "
                "what is held changed between them, and B and K with it: compare a known load"
            )
            findings.append(Finding("inertia", "warning", text, f"{100 * limit:.2g} %"))
    if findings or not limits:
        return tuple(findings)
    text = "the same in all groups of one posture"
    return (Finding("inertia", "ok", text, f"{100 * max(limits):.2g} %"),)


def _one_posture(first: ImpedanceEstimate, second: ImpedanceEstimate) -> bool:
    if any(first.keys.get(key) != second.keys.get(key) for key in ("subject", "recording")):
        return False
    if first.position is None or second.position is None:
        return False
    return float(np.linalg.norm(first.position - second.position)) < SAME_PLACE


def _factor(one: ImpedanceEstimate, other: ImpedanceEstimate) -> tuple[float, float]:
    """k and its standard error, if M of the second is (1 + k) times that of the first."""
    size = one.k**2
    # with the handle: it is behind the same sensor
    first, second = (np.asarray(each.inertia_with_handle).ravel() for each in (one, other))
    mean = (first + second) / 2
    covariance = one.covariance[:size, :size] + other.covariance[:size, :size]
    # The scatter of few trials is itself uncertain, and weights from it would be too optimistic:
    # they use the covariance of the noise, if it is known.
    expected = covariance
    if one.bound is not None and other.bound is not None:
        expected = one.bound[:size, :size] + other.bound[:size, :size]
    # M_2 - M_1 (k^2,) = M (k^2,) k
    weight = np.linalg.solve(expected, mean)
    weight = weight / (weight @ mean)
    return float(weight @ (second - first)), float(np.sqrt(weight @ covariance @ weight))
