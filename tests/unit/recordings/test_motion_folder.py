"""Recordings of joint motion on disk."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.arrays import to_plain
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MotionRecording
from armimpedance.limb.arm.skeletons import elbow_skeleton
from armimpedance.recordings.motion.marker_and_motion_folder import (
    read_motion,
    torque_columns,
    write_motion,
)
from armimpedance.recordings.opening import open_recording
from armimpedance.recordings.reading import recording_kind
from armimpedance.recordings.tables.folder import read_folder

SKELETON = elbow_skeleton(70.0, 1.75)


def recording(**changes) -> MotionRecording:
    rng = np.random.default_rng(2)
    made = MotionRecording(
        sample_rate_hz=100.0,
        trials=pd.DataFrame({"trial": [1, 2], "condition": ["swing", "swing"]}),
        offsets=np.array([0, 12, 20]),
        time_s=np.concatenate([np.arange(12), np.arange(8)]) / 100.0,
        coordinates=rng.normal(size=(20, 10)),
        skeleton=SKELETON,
        wrenches=rng.normal(size=(20, 1, 6)),
        plate_origins_m=np.array([[0.1, 0.2, 0.0]]),
        torque=rng.normal(size=(20, 10)),
        provenance=("Made.",),
    )
    return replace(made, **changes)


@pytest.mark.parametrize("table", ["parquet", "csv"])
@pytest.mark.parametrize("bare", [True, False])
def test_round_trip(table, bare, tmp_path):
    changes = {"torque": None, "wrenches": None, "plate_origins_m": None} if bare else {}
    made = recording(**changes)
    write_motion(made, tmp_path / "r", table)
    assert recording_kind(tmp_path / "r") == "motion"
    back = open_recording(tmp_path / "r")
    for name in ("offsets", "time_s", "coordinates", "torque", "wrenches", "plate_origins_m"):
        a, b = getattr(back, name), getattr(made, name)
        assert (a is None and b is None) or np.array_equal(a, b), name
    assert to_plain(back.skeleton) == to_plain(made.skeleton)
    assert back.provenance == made.provenance


def test_a_torque_has_the_unit_of_its_coordinate():
    names = torque_columns(SKELETON)
    assert names[:4] == ("tau_trunk_x_N", "tau_trunk_y_N", "tau_trunk_z_N", "tau_trunk_rz_Nm")
    assert names[-1] == "tau_right_elbow_flexion_Nm"


def in_degrees(table):
    table["right_elbow_flexion_rad"] = np.rad2deg(table["right_elbow_flexion_rad"])
    return table


def named_degrees(table):
    return table.rename(columns={"right_elbow_flexion_rad": "right_elbow_flexion_deg"})


DAMAGES = {
    "degrees": (in_degrees, "looks like degrees"),
    "named degrees": (named_degrees, "column right_elbow_flexion_deg: an angle in degrees"),
    "mm": (lambda t: t.assign(trunk_x_m=1000.0), "column trunk_x_m: 1000 looks like millimetres"),
    "a heading in degrees": (lambda t: t.assign(trunk_rz_rad=90.0), "looks like degrees"),
    "a coordinate": (lambda t: t.drop(columns="trunk_y_m"), "column trunk_y_m: no such column"),
    "a torque": (lambda t: t.drop(columns="tau_trunk_ry_Nm"), "column tau_trunk_ry_Nm: no such"),
    "a gap": (lambda t: t.assign(trunk_y_m=[np.nan, *t["trunk_y_m"][1:]]), "empty cell"),
}


@pytest.mark.parametrize(("change", "told"), DAMAGES.values(), ids=DAMAGES)
def test_hostile_tables(change, told, tmp_path):
    write_motion(recording(), tmp_path / "r", "csv")
    file = tmp_path / "r" / "samples.csv"
    change(pd.read_csv(file)).to_csv(file, index=False)
    with pytest.raises(InputError, match=told) as error:
        read_motion(tmp_path / "r")
    assert "\n" not in str(error.value)


def test_the_skeleton_must_be_there(tmp_path):
    write_motion(recording(), tmp_path / "r")
    (tmp_path / "r" / "skeleton.json").unlink()
    with pytest.raises(InputError, match=r"skeleton\.json: no such file"):
        read_motion(tmp_path / "r")


def test_somebody_may_turn_round_and_round(tmp_path):
    q = np.array(recording().coordinates)
    q[:, 3] += 6 * np.pi
    write_motion(recording(coordinates=q), tmp_path / "r")
    assert np.array_equal(read_motion(tmp_path / "r").coordinates, q)


@pytest.mark.parametrize("kind", ["hand", "joint"])
def test_who_takes_which_kind(kind, tmp_path):
    write_motion(recording(), tmp_path / "r")
    with pytest.raises(InputError, match="armimpedance passive"):
        read_folder(tmp_path / "r")
    file = tmp_path / "r" / "recording.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), "kind": kind}))
    with pytest.raises(InputError, match="armimpedance estimate"):
        read_motion(tmp_path / "r")
