"""`skeleton.json`: back bit by bit, and one line for whatever is wrong."""

from __future__ import annotations

import json

import pytest

from armimpedance.core.arrays import to_plain
from armimpedance.core.errors import InputError
from armimpedance.limb.arm.skeletons import body_skeleton, elbow_skeleton
from armimpedance.recordings.motion.skeleton_json import read_skeleton, write_skeleton


@pytest.mark.parametrize("skeleton", [elbow_skeleton(71.3, 1.77), body_skeleton(64.9, 1.66)])
def test_round_trip(skeleton, tmp_path):
    write_skeleton(skeleton, tmp_path / "skeleton.json")
    assert to_plain(read_skeleton(tmp_path / "skeleton.json")) == to_plain(skeleton)


def smallest() -> dict:
    """A skeleton with nothing that may be left out."""
    segments = [
        {"name": "trunk", "parent": None, "origin_m": [0, 0, 0]},
        {
            "name": "arm",
            "parent": "trunk",
            "origin_m": [0, -0.2, 0.5],
            "hinges": [{"name": "flexion", "axis": [0, -1, 0]}],
        },
    ]
    return {"format": "armimpedance-skeleton", "version": 1, "segments": segments}


def read(content, tmp_path):
    file = tmp_path / "skeleton.json"
    file.write_text(content if isinstance(content, str) else json.dumps(content))
    return read_skeleton(file)


def test_what_may_be_left_out(tmp_path):
    skeleton = read(smallest(), tmp_path)
    assert skeleton.floating
    assert skeleton.markers == ()
    assert skeleton.mass_kg == 0
    assert skeleton.coordinates[-1] == "flexion"


def damaged(path, value):
    content = smallest()
    at = content
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    return content


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("", "is empty"),
        ("{", "broken JSON"),
        ({}, "format"),
        (damaged(["format"], "armimpedance-recording"), "armimpedance-skeleton"),
        (damaged(["version"], 2), "version"),
        (damaged(["segments"], 3), "segments"),
        (damaged(["segments", 0], 3), r"segments\[0\]"),
        (damaged(["segments", 1, "parent"], "pelvis"), "pelvis"),
        (damaged(["segments", 1, "origin_m"], [0, -200, 500]), "looks like millimetres"),
        (damaged(["segments", 1, "origin_m"], [0, "a", 1]), "origin_m"),
        (damaged(["segments", 1, "hinges", 0, "axis"], [0, -2, 0]), "length 2"),
        (damaged(["segments", 1, "mass_kg"], -1), "mass of arm"),
        (damaged(["segments", 1, "mass"], 1), "unknown mass"),
        (damaged(["markers"], [{"name": "m", "segment": "leg", "position_m": [0, 0, 0]}]), "leg"),
        (damaged(["floating"], "yes"), "floating"),
    ],
)
def test_one_line_that_names_the_file(content, told, tmp_path):
    with pytest.raises(InputError, match=told) as error:
        read(content, tmp_path)
    assert "skeleton.json" in str(error.value)
    assert "\n" not in str(error.value)


def test_no_file(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_skeleton(tmp_path / "skeleton.json")
