"""Inputs are told apart, and nobody is counted twice."""

from __future__ import annotations

from pathlib import Path

import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import distinct_names


def test_names_are_as_short_as_tells_them_apart():
    assert distinct_names([Path("a/s"), Path("b/t")]) == ["s", "t"]
    assert distinct_names([Path("a/s"), Path("b/s"), Path("b/t")]) == ["a/s", "b/s", "b/t"]
    assert distinct_names([Path("x/a/s"), Path("y/a/s")]) == ["x/a/s", "y/a/s"]
    assert distinct_names([]) == []


def test_one_place_twice_is_refused_also_behind_a_link(tmp_path):
    (tmp_path / "s").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "s")
    for other in (tmp_path / "s", tmp_path / "link", tmp_path / "." / "s"):
        with pytest.raises(InputError, match="twice"):
            distinct_names([tmp_path / "s", other])
