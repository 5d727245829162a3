"""Recordings of markers on disk: back bit by bit, hostile folders in one line."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.arrays import to_plain
from armimpedance.core.errors import InputError
from armimpedance.core.motion import EmgSignals, MarkerRecording
from armimpedance.core.records import Subject
from armimpedance.limb.arm.skeletons import elbow_skeleton
from armimpedance.recordings.motion.marker_and_motion_folder import (
    read_markers,
    read_motion,
    write_markers,
)
from armimpedance.recordings.opening import open_recording
from armimpedance.recordings.reading import ReadOptions, recording_kind
from armimpedance.recordings.tables.folder import read_folder, write_folder

LENGTHS = (20, 15)


def recording(**changes) -> MarkerRecording:
    """Two trials of three markers with losses, two plates, EMG in the second trial alone."""
    rng = np.random.default_rng(2)
    n = sum(LENGTHS)
    positions = rng.normal(size=(n, 3, 3))
    positions[3:5, 1] = np.nan
    positions[-1, 0] = np.nan
    emg = EmgSignals(300.0, np.array([0, 0, 150]), rng.normal(size=(150, 2)), ("biceps", "triceps"))
    trials = pd.DataFrame({"trial": [4, 9], "condition": ["swing", "release"], "onset_s": [0.1, 0]})
    made = MarkerRecording(
        sample_rate_hz=30.0,
        trials=trials,
        offsets=np.array([0, 20, 35]),
        time_s=np.concatenate([np.arange(k) / 30.0 for k in LENGTHS]),
        positions=positions,
        names=("hand", "elbow joint", "left,right"),
        skeleton=elbow_skeleton(70.0, 1.75),
        wrenches=rng.normal(size=(n, 2, 6)),
        plate_origins_m=rng.normal(size=(2, 3)),
        emg=emg,
        subject=Subject("A", 70.0, 1.75),
        provenance=("Filmed.",),
    )
    return replace(made, **changes)


def same(a, b):
    """Whether two arrays agree to the last bit, lost values included."""
    return np.array_equal(a, b, equal_nan=True) and a.dtype == b.dtype


@pytest.mark.parametrize("table", ["parquet", "csv"])
def test_round_trip(table, tmp_path):
    made = recording()
    write_markers(made, tmp_path / "r", table)
    back = read_markers(tmp_path / "r")
    for name in ("offsets", "time_s", "positions", "wrenches", "plate_origins_m"):
        assert same(getattr(back, name), getattr(made, name)), name
    pd.testing.assert_frame_equal(back.trials, made.trials, check_dtype=False)
    assert back.names == made.names
    assert back.subject == made.subject
    assert back.provenance == made.provenance
    assert to_plain(back.skeleton) == to_plain(made.skeleton)
    assert same(back.emg.signals, made.emg.signals)
    assert back.emg.offsets.tolist() == [0, 0, 150]
    assert (back.emg.muscles, back.emg.unit) == (made.emg.muscles, made.emg.unit)
    assert back.emg.sample_rate_hz == 300.0


def test_the_least_that_a_recording_may_hold(tmp_path):
    bare = recording(skeleton=None, wrenches=None, plate_origins_m=None, emg=None)
    write_markers(bare, tmp_path / "r")
    back = read_markers(tmp_path / "r")
    assert back.skeleton is None
    assert back.wrenches is None
    assert back.emg is None


def test_an_earlier_recording_is_replaced_and_nothing_else_is(tmp_path):
    write_markers(recording(), tmp_path / "r", "csv")
    write_markers(recording(emg=None), tmp_path / "r")
    assert sorted(p.name for p in (tmp_path / "r").iterdir()) == [
        "recording.json", "samples.parquet", "skeleton.json", "trials.csv",
    ]  # fmt: skip
    (tmp_path / "r" / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="not an earlier output"):
        write_markers(recording(), tmp_path / "r")


def test_trials_in_another_order_than_their_samples(tmp_path):
    made = recording()
    write_markers(made, tmp_path / "r", "csv")
    table = pd.read_csv(tmp_path / "r" / "trials.csv")
    table.iloc[::-1].to_csv(tmp_path / "r" / "trials.csv", index=False)
    back = read_markers(tmp_path / "r")
    assert same(back.positions[back.samples_of(1)], made.positions[made.samples_of(0)])
    assert back.emg.offsets.tolist() == [0, 150, 150]
    assert same(back.emg.signals, made.emg.signals)


class Damage:
    """A sound folder of CSV, to be damaged."""

    def __init__(self, path):
        self.path = path / "r"
        write_markers(recording(), self.path, "csv")

    def json(self, **changes):
        file = self.path / "recording.json"
        content = {**json.loads(file.read_text()), **changes}
        file.write_text(json.dumps({k: v for k, v in content.items() if v is not ...}))

    def table(self, change, name="samples.csv"):
        table = pd.read_csv(self.path / name)
        change(table).to_csv(self.path / name, index=False)

    def cell(self, row, column, value, name="samples.csv"):
        def change(table):
            table[column] = table[column].astype(object)
            table.loc[row, column] = value
            return table

        self.table(change, name)


DAMAGES = {
    "mm": (lambda d: d.table(lambda t: t.assign(hand_x_m=t["hand_x_m"] * 1000)), "millimetres"),
    "a part of a marker": (lambda d: d.cell(6, "hand_y_m", ""), "row 8, column hand_y_m"),
    "text": (lambda d: d.cell(6, "hand_y_m", "lost"), "row 8, column hand_y_m: not a number"),
    "infinite": (lambda d: d.cell(6, "hand_y_m", "inf"), "not finite"),
    "a marker in mm": (
        lambda d: d.table(lambda t: t.rename(columns={"hand_x_m": "hand_x_mm"})),
        "column hand_x_mm: is no marker's column",
    ),
    "an axis": (lambda d: d.table(lambda t: t.drop(columns="hand_z_m")), "column hand_z_m"),
    "no marker": (
        lambda d: d.table(lambda t: t[["trial", "time_s"]]),
        "no marker's column",
    ),
    "time": (lambda d: d.cell(6, "time_s", 0.1), "time does not run forward"),
    "another rate": (lambda d: d.json(sample_rate_hz=60), "a step of"),
    "no rate": (lambda d: d.json(sample_rate_hz=...), "sample_rate_hz: is missing"),
    "a plate's column": (
        lambda d: d.table(lambda t: t.drop(columns="plate2_my_Nm")),
        "column plate2_my_Nm: no such column",
    ),
    "a lost force": (lambda d: d.cell(6, "plate1_fx_N", ""), "plate1_fx_N: empty cell"),
    "no plates in json": (lambda d: d.json(plates=...), "does not list"),
    "a plate too few": (
        lambda d: d.json(plates=[{"origin_m": [0, 0, 0]}]),
        r"column plate2_fx_N: a force plate .* lists 1",
    ),
    "a plate without origin": (lambda d: d.json(plates=[{}]), r"plates\[0\]"),
    "plates are text": (lambda d: d.json(plates="two"), "plates"),
    "a plate in mm": (
        lambda d: d.json(plates=[{"origin_m": [400, 0, 0]}] * 2),
        "looks like millimetres",
    ),
    "a trial without samples": (
        lambda d: d.table(lambda t: t[t["trial"] == 4]),
        "trial 9 has no samples",
    ),
    "EMG without a rate": (lambda d: d.json(emg_rate_hz=...), "emg_rate_hz: is missing"),
    "EMG at another rate": (lambda d: d.json(emg_rate_hz=1000), "a step of"),
    "EMG of an unknown trial": (
        lambda d: d.table(lambda t: t.assign(trial=5), "emg.csv"),
        "trial 5 is not in trials.csv",
    ),
    "EMG that starts late": (
        lambda d: d.table(lambda t: t.assign(time_s=t["time_s"] + 1), "emg.csv"),
        "starts 1 s after the trial",
    ),
    "EMG without muscles": (
        lambda d: d.table(lambda t: t[["trial", "time_s"]], "emg.csv"),
        "no column of EMG",
    ),
    "a rate of no EMG": (lambda d: (d.path / "emg.csv").unlink(), "a rate of EMG, but no EMG"),
    "a broken skeleton": (
        lambda d: (d.path / "skeleton.json").write_text("{}"),
        "skeleton.json, column format",
    ),
    "no trials": (lambda d: (d.path / "trials.csv").unlink(), "trials.csv"),
    "no samples": (lambda d: (d.path / "samples.csv").unlink(), "no samples"),
}


@pytest.mark.parametrize(("damage", "told"), DAMAGES.values(), ids=DAMAGES)
def test_hostile_folders(damage, told, tmp_path):
    folder = Damage(tmp_path)
    damage(folder)
    with pytest.raises(InputError, match=told) as error:
        read_markers(folder.path)
    assert "\n" not in str(error.value)


def test_what_nothing_reads_is_told(tmp_path):
    folder = Damage(tmp_path)
    folder.json(camera="left")
    folder.table(lambda t: t.assign(note="a"))
    told = " ".join(read_markers(folder.path).provenance)
    assert "camera" in told
    assert "note" in told


def test_kinds_and_who_takes_them(tmp_path, tables):
    write_markers(recording(), tmp_path / "r")
    assert recording_kind(tmp_path / "r") == "markers"
    with pytest.raises(InputError, match="armimpedance passive"):
        read_folder(tmp_path / "r")
    with pytest.raises(InputError, match="recording of markers"):
        read_motion(tmp_path / "r")
    hand = tables.write()
    assert recording_kind(hand) == "hand"
    with pytest.raises(InputError, match="armimpedance estimate"):
        read_markers(hand)
    with pytest.raises(InputError, match="no such folder"):
        recording_kind(tmp_path / "nothing")


def test_a_recording_of_the_hand_does_not_replace_markers(tmp_path, tables):
    write_markers(recording(), tmp_path / "r")
    with pytest.raises(InputError, match="not an earlier output"):
        write_folder(read_folder(tables.write()), tmp_path / "r")


def test_one_door(tmp_path):
    write_markers(recording(skeleton=None), tmp_path / "r")
    skeleton = elbow_skeleton(60.0, 1.6)
    opened = open_recording(tmp_path / "r", ReadOptions(skeleton=skeleton))
    assert opened.skeleton is skeleton
    with pytest.raises(InputError, match=r"--prefix with a folder.*expected --skeleton"):
        open_recording(tmp_path / "r", ReadOptions(prefix="A"))
    with pytest.raises(InputError, match="no such file"):
        open_recording(tmp_path / "none.c3d")
    (tmp_path / "a.xyz").write_text("a")
    with pytest.raises(InputError, match="no recording of a known format"):
        open_recording(tmp_path / "a.xyz")


def test_names_that_cannot_stand_in_a_table(tmp_path):
    with pytest.raises(InputError, match="cannot be a column's name"):
        write_markers(recording(names=(" hand", "b", "c")), tmp_path / "r")
