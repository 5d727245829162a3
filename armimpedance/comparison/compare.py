"""Compare groups pair by pair: changes with intervals, tests, correction for many pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final, Literal

import numpy as np

from armimpedance.arrays import IntArray
from armimpedance.comparison.differences import Change, changes
from armimpedance.comparison.groups import ComparedGroup, Progress
from armimpedance.comparison.matrix_test import MatrixTest, adjusted
from armimpedance.comparison.parametric import parametric_test
from armimpedance.comparison.permutation import arrangements, permutation_test
from armimpedance.errors import ArmImpedanceError, InputError

Basis = Literal["permutation", "covariance"]

#: Permutations of one pair; with many pairs more, so that Holm's smallest p stays near .01.
FEWEST_PERMUTATIONS: Final = 1999
PERMUTATIONS_PER_PAIR: Final = 100
#: With fewer different exchanges within directions, trials are exchanged across them.
_FEW_ARRANGEMENTS: Final = 200


@dataclass(frozen=True, repr=False)
class Pair:
    """Two groups compared.

    Attributes
    ----------
    first, second : str
        Names of the groups; changes are from the first to the second.
    changes : tuple of Change
    tests : tuple of MatrixTest
        Inertia, viscosity, stiffness, all three; p values adjusted over all pairs.
    basis : {"permutation", "covariance"}
        Whether trials were exchanged, or the tests rest on the estimates' covariances.
    notes : tuple of str
    """

    first: str
    second: str
    changes: tuple[Change, ...]
    tests: tuple[MatrixTest, ...]
    basis: Basis
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        tested = (f"{test.matrix} p = {test.p_t2_adjusted:.2g}" for test in self.tests)
        return f"{self.first} | {self.second}: {', '.join(tested)} (T2, adjusted)"


def compare(
    groups: Sequence[ComparedGroup],
    *,
    against: str | None = None,
    permutations: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[Pair]:
    """Compare all pairs of groups, or all with one.

    Parameters
    ----------
    groups : sequence of ComparedGroup
    against : str, optional
        Name of the group that comes first in every pair.
    permutations : int, optional
        Number of permutations of each pair; default 1999, or one less than 100 times the number of
        pairs where that is more.
    seed : int
        The same seed gives the same p values.
    progress : function (done, all), optional

    Returns
    -------
    list of Pair
        Each holds the differences of a pair's ellipses and elements and the tests of its matrices.

    Raises
    ------
    InputError
        Fewer than two groups, or no group of the name `against`.
    """
    pairs = paired(groups, against)
    count = permutations or max(FEWEST_PERMUTATIONS, PERMUTATIONS_PER_PAIR * len(pairs) - 1)
    found = []
    for number, (first, second) in enumerate(pairs):
        stream = np.random.SeedSequence(seed, spawn_key=(number,))
        try:
            found.append(_compare_pair(first, second, count, stream))
        except ArmImpedanceError as error:
            raise InputError(f"{first.name} and {second.name}: {error}") from error
        if progress is not None:
            progress(number + 1, len(pairs))
    tests = adjusted([pair.tests for pair in found])
    return [replace(pair, tests=own) for pair, own in zip(found, tests, strict=True)]


def paired(
    groups: Sequence[ComparedGroup], against: str | None
) -> list[tuple[ComparedGroup, ComparedGroup]]:
    """All pairs, or the group `against` with each other one.

    Raises
    ------
    InputError
        Fewer than two groups, or no such group.
    """
    names = [group.name for group in groups]
    if len(groups) < 2:
        raise InputError(
            f"{len(groups)} group{'' if len(groups) == 1 else 's'}: {', '.join(names) or 'none'}",
            expected="two or more; name another column with --by",
        )
    if against is None:
        return list(combinations(groups, 2))
    if against not in names:
        raise InputError(f"no group {against!r}", expected=f"one of {'; '.join(names)}")
    first = groups[names.index(against)]
    return [(first, group) for group in groups if group is not first]


def _compare_pair(
    first: ComparedGroup, second: ComparedGroup, count: int, stream: np.random.SeedSequence
) -> Pair:
    differing = changes(first.estimate, second.estimate)
    if first.equations is None or second.equations is None:
        tests = parametric_test(first.estimate, second.estimate, draws=count, seed=stream)
        basis: Basis = "covariance"
        notes: tuple[str, ...] = ()
    else:
        strata, notes = common_strata(first, second)
        tests = permutation_test(
            first.equations, second.equations, strata=strata, permutations=count, seed=stream
        )
        basis = "permutation"
    missing = [test.matrix for test in tests[:3] if np.isnan(test.distance)]
    if missing:
        notes += (f"no distance: {', '.join(missing)} of a group is not positive definite",)
    if any(np.isnan(test.p_t2) for test in tests):
        notes += ("too few trials for T2 of all three matrices together",)
    return Pair(first.name, second.name, differing, tests, basis, notes)


def common_strata(
    first: ComparedGroup, second: ComparedGroup
) -> tuple[tuple[IntArray, IntArray] | None, tuple[str, ...]]:
    """The directions within which trials are exchanged, and what to say about it."""
    one, two = first.disturbance, second.disturbance
    if one is None or two is None:
        return None, ("trials exchanged without regard to direction, which is not known for all",)
    member = np.arange(len(one) + len(two)) < len(one)
    if arrangements(member, np.concatenate([one, two])) < _FEW_ARRANGEMENTS:
        return None, ("trials exchanged across directions: too few within each",)
    alone = np.setxor1d(one, two)
    note = f"trials of {len(alone)} directions that one group alone has stay where they are"
    return (one, two), (note,) if len(alone) else ()
