"""Pairs of groups that were compared, and the inertia that two sessions must share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isnan
from typing import Final, Literal, overload

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.findings import Finding
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.comparison.differences import Change, Label, Side, change_numbers
from armimpedance.hand.comparison.groups import ComparedGroup
from armimpedance.hand.comparison.matrix_test import MATRIX_NAMES, MatrixTest
from armimpedance.numerics.regression import t_factor

Basis = Literal["permutation", "covariance", "first order"]

#: Pairs whose changes are computed at once: some 0.6 MB.
BLOCK: Final = 512


@dataclass(frozen=True, repr=False)
class Pair:
    """Two groups compared.

    `first`, `second`: names of the groups; changes are from the first to the second.
    `tests`: inertia, viscosity, stiffness, all three; p values adjusted over all pairs.
    `basis`: whether trials were exchanged, or the tests rest on the estimates' covariances: the
    distance's then on draws from them, or, of many pairs, on its law to first order.
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
    """What a pair's tests could not say."""
    notes: tuple[str, ...] = ()
    missing = [test.matrix for test in tests[:3] if isnan(test.distance)]
    if missing:
        notes += (f"no distance: {', '.join(missing)} of a group is not positive definite",)
    if any(isnan(test.p_t2) for test in tests):
        notes += ("too few trials for T2 of all three matrices together",)
    return notes


@dataclass(frozen=True, eq=False)
class ManyPairs(Sequence[Pair]):
    """Many pairs of groups: a `Pair` is made where it is asked for.

    `names`: of the groups.
    `first`, `second` (R,): numbers of the groups of each pair.
    `sides`: what the changes take of each group.
    `labels`: what the changes are of.
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
            MatrixTest(name, *each) for name, each in zip(MATRIX_NAMES, numbers, strict=True)
        )
        return Pair(self.names[i], self.names[j], later, tests, self.basis, notes_of(tests))


@dataclass(frozen=True, eq=False)
class _Block:
    """Neighbouring pairs, whose changes are computed together when one is asked for."""

    pairs: ManyPairs
    start: int
    stop: int

    @cached_property
    def numbers(self) -> list[list[list[float]]]:
        """`change_numbers` of each pair."""
        rows, pairs = slice(self.start, self.stop), self.pairs
        return change_numbers(pairs.sides, pairs.first[rows], pairs.second[rows]).tolist()  # type: ignore[no-any-return]


@dataclass(frozen=True, eq=False)
class LaterChanges(Sequence[Change]):
    """The changes of one of many pairs, computed where they are asked for."""

    block: _Block
    row: int

    def _made(self) -> tuple[Change, ...]:
        numbers = self.block.numbers[self.row]
        labels = self.block.pairs.labels
        return tuple(Change(*label, *each) for label, each in zip(labels, numbers, strict=True))

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


# The inertia at one posture holds two sessions against each other: no muscle can change it.

#: Groups whose mean places are nearer than this have one posture (m, rad).
SAME_PLACE: Final = 0.02
#: An inertia that differs by more than this part, and by more than chance, is told.
LEAST_CHANGE: Final = 0.03
#: Times the half-width of a 95 % interval that chance exceeds less than once in a hundred times.
UNLIKELY: Final = 1.45


def check_inertia(groups: Sequence[ComparedGroup], pairs: Sequence[Pair]) -> tuple[Finding, ...]:
    """Pairs of one person at one place whose inertia differs by a factor.

    Returns "inertia", one for each pair that differs, or one for all that do not; empty where no
    two groups have one posture.
    """
    of = {group.name: group.estimate for group in groups}
    told, limits = [], []
    for pair in pairs:
        one, other = of[pair.first], of[pair.second]
        if not _one_posture(one, other):
            continue
        change, error = _factor(one, other)
        # More pairs, more chances: as many standard errors more as of a normal distribution
        many = float(np.sqrt(1 + 2 * np.log(len(pairs)) / (UNLIKELY * t_factor(np.inf)) ** 2))
        limit = max(LEAST_CHANGE, many * UNLIKELY * t_factor(one.dof + other.dof) * error)
        limits.append(limit)
        if abs(change) > limit:
            text = (
                f"{pair.first} | {pair.second}: {100 * change:+.1f} % (sd {100 * error:.1f}) at "
                "one posture, which no muscle can make; a gain, a unit, the sensors' timing or "
                "what is held changed between them, and B and K with it: compare a known load"
            )
            told.append(Finding("inertia", "warning", text, f"{100 * limit:.2g} %"))
    if told or not limits:
        return tuple(told)
    text = "the same in all groups of one posture"
    return (Finding("inertia", "ok", text, f"{100 * max(limits):.2g} %"),)


def _one_posture(one: ImpedanceEstimate, other: ImpedanceEstimate) -> bool:
    if any(one.keys.get(key) != other.keys.get(key) for key in ("subject", "recording")):
        return False
    if one.position is None or other.position is None:
        return False
    return float(np.linalg.norm(one.position - other.position)) < SAME_PLACE


def _factor(one: ImpedanceEstimate, other: ImpedanceEstimate) -> tuple[float, float]:
    """k and its standard error, where M of the second is (1 + k) times that of the first."""
    size = one.k**2
    # with the handle: it is behind the same sensor
    first, second = (np.asarray(each.inertia_with_handle).ravel() for each in (one, other))
    mean = (first + second) / 2
    weight = np.linalg.inv(one.covariance[:size, :size] + other.covariance[:size, :size])
    # M_2 - M_1 (k^2,) = M (k^2,) k, weighted by its covariance
    known = float(mean @ weight @ mean)
    return float(mean @ weight @ (second - first)) / known, known**-0.5
