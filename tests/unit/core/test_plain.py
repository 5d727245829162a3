"""Records as plain values: nothing lost on the way there and back, nothing else let in."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import pytest

from armimpedance.core.arrays import FloatArray, IntArray, from_plain, frozen_array, to_plain
from armimpedance.core.errors import ArmImpedanceError, InputError


@dataclass(frozen=True)
class Inner:
    name: str
    size: float
    joint: int | None = None

    def __post_init__(self) -> None:
        if self.size < 0:
            raise InputError("a negative size", expected="0 or more")


@dataclass(frozen=True)
class Outer:
    matrix: FloatArray
    counts: IntArray
    dof: float
    order: int
    on: bool
    parts: tuple[Inner, ...]
    pair: tuple[int, str]

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", frozen_array(self.matrix, "matrix", (2, 2)))


def outer():
    parts = (Inner("a", 0.1 + 0.2, 1), Inner("b", float("inf")))
    matrix = np.array([[1 / 3, -1e-300], [1e99, 0.0]])
    return Outer(matrix, np.array([3, 4]), float("inf"), 2, True, parts, (1, "x"))


def test_through_json_and_back_nothing_is_lost():
    text = json.dumps(to_plain(outer()), allow_nan=False)
    back = from_plain(Outer, json.loads(text))
    assert back.matrix.tobytes() == outer().matrix.tobytes()
    assert back.counts.tolist() == [3, 4]
    assert (back.dof, back.order, back.on, back.parts, back.pair) == (
        float("inf"), 2, True, outer().parts, (1, "x"),
    )  # fmt: skip
    assert to_plain(back) == to_plain(outer())


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("matrix", "abc", "column matrix: not an array"),
        ("matrix", 3.0, "column matrix"),
        ("matrix", [[1, 2], [3]], "column matrix"),
        ("matrix", [[1, 2, 3]], "matrix has shape"),
        ("matrix", [[None, 1], [1, 1]], "matrix"),
        ("counts", [1.5], "whole numbers"),
        ("counts", ["inf"], "whole numbers"),
        ("dof", "many", "column dof: 'many' (expected a number)"),
        ("dof", True, "column dof"),
        ("dof", None, "column dof"),
        ("order", 1.5, "a whole number"),
        ("order", float("inf"), "a whole number"),
        ("on", 1, "true or false"),
        ("parts", {"a": 1}, "column parts: not a list"),
        ("parts", [{"name": "a"}], "column parts[0]: not a Inner: no size, no joint"),
        ("parts", [{"name": "a", "size": -1, "joint": None}], "a negative size"),
        ("parts", [{"name": 1, "size": 1, "joint": None}], "column parts[0].name"),
        ("parts", [{"name": "a", "size": 1, "joint": "x"}], "column parts[0].joint"),
        ("parts", [3], "a mapping"),
        ("pair", [1], "column pair: 1 values"),
        ("more", 1, "unknown more"),
    ],
)
def test_anything_else_is_refused_by_field(field, value, words):
    with pytest.raises(InputError) as refused:
        from_plain(Outer, {**to_plain(outer()), field: value})
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("nothing", [None, [], "x", 3])
def test_what_is_no_mapping_is_refused(nothing):
    with pytest.raises(ArmImpedanceError, match="not a Outer"):
        from_plain(Outer, nothing)
