"""Records freeze and check what their annotations say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np
import pytest

from armimpedance.core.arrays import (
    BoolArray,
    FloatArray,
    FrozenRecord,
    IntArray,
    require_covariance,
)
from armimpedance.core.errors import RecordError


@dataclass(frozen=True)
class Sample(FrozenRecord):
    """A record with one field of each kind."""

    names: Annotated[tuple[str, ...], "m"]
    values: Annotated[FloatArray, "m"]
    covariance: Annotated[FloatArray, "m m"]
    offsets: Annotated[IntArray, "t+1"]
    planes: Annotated[FloatArray, "_ 2 nan"]
    used: Annotated[BoolArray, "t"] | None = None
    notes: tuple[str, ...] = ()
    more: Mapping[str, Any] = field(default_factory=dict)


def sample(**changes):
    given = {
        "names": ["k", "h"],
        "values": [1, 2],
        "covariance": np.eye(2),
        "offsets": [0, 3, 5],
        "planes": [[1.0, np.nan]],
    }
    return Sample(**(given | changes))


def test_arrays_are_copied_read_only_and_of_their_type():
    values = np.array([1.0, 2.0])
    made = sample(values=values, notes=["a"], more={"x": 1})
    values[0] = 9
    assert made.values[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        made.values[0] = 3
    assert made.offsets.dtype == np.int64
    assert made.names == ("k", "h")
    assert made.notes == ("a",)
    with pytest.raises(TypeError):
        made.more["y"] = 2  # type: ignore[index]
    assert made.used is None


def test_a_frozen_array_is_not_copied_again():
    made = sample()
    assert replace(made, names=("a", "b")).covariance is made.covariance


@pytest.mark.parametrize(
    "changes",
    [
        {"values": [1, 2, 3]},
        {"values": [[1, 2]]},
        {"values": [1, np.nan]},
        {"covariance": np.eye(3)},
        {"covariance": np.ones((2, 3))},
        {"planes": [[1.0, 2.0, 3.0]]},
        {"used": [True]},
        {"names": ("k",)},
    ],
)
def test_what_disagrees_is_refused(changes):
    with pytest.raises(RecordError):
        sample(**changes)


def test_sizes_with_an_offset_agree():
    assert sample(used=[True, False]).used.tolist() == [True, False]
    assert sample(offsets=[0], used=[]).offsets.tolist() == [0]


@pytest.mark.parametrize(
    "covariance",
    [
        [[-1.0, 0.0], [0.0, 1.0]],
        [[1.0, 0.2], [0.5, 1.0]],
        [[4.0, 3.0], [3.0, 1.0]],
        [[0.0, 0.3], [0.3, 1.0]],
    ],
)
def test_a_matrix_that_no_errors_have_is_no_covariance(covariance):
    stack = np.stack([np.eye(2), np.asarray(covariance)])
    with pytest.raises(RecordError, match="covariance"):
        require_covariance(stack, "covariance")


def test_covariances_of_any_units_and_rank_stand():
    rng = np.random.default_rng(1)
    factor = rng.normal(size=(9, 4)) * 10.0 ** np.arange(-4, 5)[:, None]
    covariance = factor @ factor.T
    require_covariance(covariance, "covariance")
    require_covariance(np.zeros((3, 3)), "covariance")
    # written with three digits
    require_covariance(np.vectorize(lambda x: float(f"{x:.3g}"))(covariance), "covariance")
