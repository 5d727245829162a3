"""Compare groups pair by pair: changes with intervals, tests, correction for many pairs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import combinations
from typing import Final

import numpy as np

from armimpedance.core.arrays import IntArray
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.progress import Progress
from armimpedance.hand.comparison.differences import changes, check_alike, labels_of, side_of
from armimpedance.hand.comparison.groups import Basis, ComparedGroup, ManyPairs, Pair, notes_of
from armimpedance.hand.comparison.matrix_test import MatrixTest, adjusted, holm
from armimpedance.hand.comparison.parametric import (
    Elements,
    check_errors,
    first_order_tests,
    parametric_test,
)
from armimpedance.hand.comparison.permutation import arrangements, permutation_test
from armimpedance.numerics.regression import TrialEquations

#: Permutations of one pair; more with many pairs, so that Holm's smallest p stays near .01.
FEWEST_PERMUTATIONS: Final = 1999
PERMUTATIONS_PER_PAIR: Final = 100
#: With more pairs there are no permutations or draws: the number that Holm's p requires for each
#: pair would take too long.
MOST_DRAWN_PAIRS: Final = 200
#: p of 20 among the fewest permutations: with a larger p, more permutations are a waste.
_CLEARLY_LARGE: Final = 20 / (FEWEST_PERMUTATIONS + 1)
#: With fewer different exchanges within directions, trials are exchanged across directions.
_FEW_ARRANGEMENTS: Final = 200


def compare(
    groups: Sequence[ComparedGroup],
    *,
    against: str | None = None,
    permutations: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Sequence[Pair]:
    """Compare all pairs of groups, or all with one.

    With up to 200 pairs, trials are exchanged, or estimates drawn. With more pairs and no stated
    `permutations`, the tests use the estimates' covariances (`first_order`).

    Parameters
    ----------
    groups : sequence of ComparedGroup
    against : str, optional
        Name of the group that comes first in every pair.
    permutations : int, optional
        Number of permutations of each pair; default 1999, or one less than 100 times the number of
        pairs if that is more.
    seed : int
        The same seed gives the same p values.
    progress : function (done, all), optional

    Returns
    -------
    sequence of Pair
        The differences of each pair's ellipses and elements, and the tests of its matrices.

    Raises
    ------
    InputError
        Fewer than two groups, or no group of the name `against`.
    """
    pairs = paired(groups, against)
    if permutations is None and len(pairs) > MOST_DRAWN_PAIRS:
        return _compare_many(groups, pairs, progress)
    count = permutations or max(FEWEST_PERMUTATIONS, PERMUTATIONS_PER_PAIR * len(pairs) - 1)
    compared = []
    for number, (first, second) in enumerate(pairs):
        stream = np.random.SeedSequence(seed, spawn_key=(number,))
        with _naming(first, second):
            compared.append(_compare_pair(first, second, count, stream, permutations is None))
        if progress is not None:
            progress(number + 1, len(pairs))
    tests = adjusted([pair.tests for pair in compared])
    return tuple(replace(pair, tests=own) for pair, own in zip(compared, tests, strict=True))


def paired(
    groups: Sequence[ComparedGroup], against: str | None
) -> list[tuple[ComparedGroup, ComparedGroup]]:
    """All pairs, or the group `against` with each other group.

    Raises InputError: fewer than two groups, or no such group.
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
    first: ComparedGroup,
    second: ComparedGroup,
    count: int,
    stream: np.random.SeedSequence,
    stops: bool,
) -> Pair:
    """Compare a pair, without adjustment of p; `stops`: fewer than `count` exchanges may do."""
    differing = changes(first.estimate, second.estimate)
    if first.equations is None or second.equations is None:
        tests = parametric_test(first.estimate, second.estimate, draws=count, seed=stream)
        basis: Basis = "covariance"
        notes: tuple[str, ...] = ()
    else:
        strata, notes = common_strata(first, second)
        test = _staged if stops and count >= 2 * FEWEST_PERMUTATIONS else permutation_test
        tests = test(
            first.equations, second.equations, strata=strata, permutations=count, seed=stream
        )
        basis = "permutation"
    return Pair(first.name, second.name, differing, tests, basis, notes + notes_of(tests))


def _staged(
    first: TrialEquations,
    second: TrialEquations,
    *,
    strata: tuple[IntArray, IntArray] | None,
    permutations: int,
    seed: np.random.SeedSequence,
) -> tuple[MatrixTest, ...]:
    """Run permutation tests, with few permutations if these show clearly that p is not small.

    A p that 20 of the first 1999 exceed is computed from these, the others from all of `count`,
    which are drawn anew. In neither case is p at most a level more often than that level.
    """
    early = np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, 1))
    few = permutation_test(
        first, second, strata=strata, permutations=FEWEST_PERMUTATIONS, seed=early
    )
    p_values = [p for test in few for p in (test.p_distance, test.p_t2) if not np.isnan(p)]
    if min(p_values, default=1.0) > _CLEARLY_LARGE:
        return few
    full = permutation_test(first, second, strata=strata, permutations=permutations, seed=seed)
    return tuple(
        replace(
            test,
            p_distance=early_test.p_distance
            if early_test.p_distance > _CLEARLY_LARGE
            else test.p_distance,
            p_t2=early_test.p_t2 if early_test.p_t2 > _CLEARLY_LARGE else test.p_t2,
        )
        for early_test, test in zip(few, full, strict=True)
    )


@contextmanager
def _naming(first: ComparedGroup, second: ComparedGroup) -> Iterator[None]:
    """Add the names of both groups to errors."""
    try:
        yield
    except ArmImpedanceError as error:
        raise InputError(f"{first.name} and {second.name}: {error}") from error


def _compare_many(
    groups: Sequence[ComparedGroup],
    pairs: Sequence[tuple[ComparedGroup, ComparedGroup]],
    progress: Progress | None,
) -> ManyPairs:
    estimates = [group.estimate for group in groups]
    for group in groups[1:]:
        with _naming(groups[0], group):
            check_alike(estimates[0], group.estimate)
    number = {id(group): i for i, group in enumerate(groups)}
    first, second = np.array([[number[id(group)] for group in pair] for pair in pairs]).T
    elements, tests_of_pairs = Elements.of(estimates), np.empty((len(pairs), 4, 4))
    _check_errors(groups, elements, first, second)
    for start in range(0, len(pairs), elements.block):
        rows = slice(start, start + elements.block)
        tests_of_pairs[rows] = first_order_tests(elements, first[rows], second[rows])
        if progress is not None:
            progress(min(rows.stop, len(pairs)), len(pairs))
    p = [holm(tests_of_pairs[:, i, j]) for i in range(4) for j in (1, 3)]
    tests = np.concatenate([tests_of_pairs, np.stack(p, axis=1).reshape(len(pairs), 4, 2)], axis=2)
    names = tuple(group.name for group in groups)
    return ManyPairs(names, first, second, side_of(estimates), labels_of(estimates[0]), tests)


def _check_errors(
    groups: Sequence[ComparedGroup], of: Elements, first: IntArray, second: IntArray
) -> None:
    """Refuse a pair if one element has no error in either group; the message names the pair."""
    errorless = ~(np.diagonal(of.covariances, axis1=1, axis2=2) > 0)
    both = np.flatnonzero((errorless[first] & errorless[second]).any(axis=1))
    if len(both):
        first_group, second_group = int(first[both[0]]), int(second[both[0]])
        with _naming(groups[first_group], groups[second_group]):
            check_errors(of.covariances[first_group] + of.covariances[second_group])


def common_strata(
    first: ComparedGroup, second: ComparedGroup
) -> tuple[tuple[IntArray, IntArray] | None, tuple[str, ...]]:
    """Directions within which trials are exchanged, and notes about them."""
    first_labels, second_labels = first.disturbance, second.disturbance
    if first_labels is None or second_labels is None:
        return None, ("trials exchanged without regard to direction, which is not known for all",)
    member = np.arange(len(first_labels) + len(second_labels)) < len(first_labels)
    if arrangements(member, np.concatenate([first_labels, second_labels])) < _FEW_ARRANGEMENTS:
        return None, ("trials exchanged across directions: too few within each",)
    alone = np.setxor1d(first_labels, second_labels)
    note = f"trials of {len(alone)} directions that one group alone has stay where they are"
    return (first_labels, second_labels), (note,) if len(alone) else ()
