"""`armimpedance exam`: what an exam holds, counted; what it says to type next works."""

from __future__ import annotations

import shlex
import struct
from collections import Counter
from dataclasses import replace

import kinarm_archives as archives
import kinarm_bench as bench
import numpy as np
import pandas as pd
import pytest

from armimpedance.__main__ import main
from armimpedance.core.errors import InputError
from armimpedance.recordings.kinarm import overview
from armimpedance.recordings.kinarm.exam_file import ExamFile
from armimpedance.recordings.kinarm.overview_text import look_at_exam
from armimpedance.show.verbs.results import read

NOTHING = np.zeros((0, 2))
EMPTY = {"samples": 0, "links": NOTHING, "forces": NOTHING, "motors": NOTHING}


@pytest.fixture(scope="module")
def pushes():
    return [bench.push(2 * np.pi * i / 8) for i in range(8)]


@pytest.fixture(scope="module")
def lab(exams, c3d, pushes):
    """Trials and robot of an exam of two blocks; fields of single trials by their number."""

    def made(count=16, *, every=None, changes=None, **robot):
        trials = []
        for number in range(1, count + 1):
            trial = bench.trial_of(exams, number, pushes[(number - 1) % 8])
            block = 1 if number <= count // 2 else 2
            known = {"name": f"{block:02d}{trial.name[2:]}"} | (every or {})
            trials.append(replace(trial, **(known | (changes or {}).get(number, {}))))
        return trials, bench.robot_of(exams, **({"tables": bench.tables_of(c3d)} | robot))

    return made


def table(look, title):
    (found,) = (rows for name, _, rows in look.tables if name == title)
    return found


CHANGES = {
    3: {"is_error": 1},
    5: EMPTY,
    6: {"forces": np.full((500, 2), np.nan)},
    12: {"is_error": 1},
    14: {"rate": 500.0},
}


SAID = ({}, {"motors": None}, {"events": (("GO CUE", 0.1),)})
FORMS = ("kinarm", "zip", "folder")
#: Each form and each exam once, then every other pair of them.
ASKED = [(FORMS[i], SAID[(i + turn) % 3]) for turn in range(3) for i in range(3)]


def test_every_trial_is_counted_once(lab, exams, tmp_path):
    trials, robot = lab(changes=CHANGES)
    files = exams.files(trials, robot)
    files["02_07_02.c3d"] = files["02_07_02.c3d"][:3000]
    look = look_at_exam(exams.zip(tmp_path / "exam.zip", files))
    states = Counter(row["state"] for row in look.trials)
    assert len(look.trials) == 16
    assert states["sound"] == 12
    assert states["empty"] == 1
    for title in ("Protocols", "Blocks"):
        counts = np.array([[int(cell) for cell in row[1:5]] for row in table(look, title)])
        assert counts.sum(axis=0).tolist() == [16, 1, 3, 2]
    assert [row[0].strip() for row in table(look, "Blocks")] == ["1", "2"]
    assert sum(int(row[1]) for row in table(look, "Broken trials")) == 3
    assert sum(int(row[1]) for row in table(look, "Conditions")) == 12
    assert {row["file"] for row in look.trials} == {*files} - {"common.c3d"}


@pytest.mark.first_cases(3)
@pytest.mark.parametrize(("form", "every"), ASKED)
def test_what_it_says_to_type_works_and_gives_what_it_told(
    lab, exams, tmp_path, monkeypatch, capsys, every, form
):
    trials, robot = lab(every=every, changes={5: EMPTY, 3: {"is_error": 1}})
    place = tmp_path / "my exam"
    if form == "folder":
        exams.folder(place, exams.files(trials, robot))
    elif form == "zip":
        place = exams.zip(tmp_path / "my exam.zip", exams.files(trials, robot))
    else:
        place = archives.packed(tmp_path / "a.kinarm", archives.members(exams, trials, robot))
    monkeypatch.chdir(tmp_path)
    assert main(["exam", place.name, "--out", "trials.csv"]) == 0
    said = capsys.readouterr().out
    call = said[said.index("\nNext\n") :].splitlines()[2]
    words = shlex.split(call)
    assert words[0] == "armimpedance"
    assert main(words[1:]) == 0
    assert ("--force-by" in words) == ("motors" in every)
    assert ("--events" in words) == ("events" not in every)
    converted = read(tmp_path / "session").trials
    told = pd.read_csv("trials.csv", float_precision="round_trip")
    told = told[told["state"] == "sound"].reset_index(drop=True)
    for column in converted.columns.drop(["onset_s", "end_s"], errors="ignore"):
        assert converted[column].tolist() == told[column].tolist(), column


def test_all_forms_of_an_exam_look_the_same(lab, exams, tmp_path):
    trials, robot = lab(changes={5: EMPTY, 3: {"is_error": 1}})
    files = exams.files(trials, robot)
    looks = [
        look_at_exam(exams.zip(tmp_path / "e.zip", files)),
        look_at_exam(exams.folder(tmp_path / "folder", files, "raw")),
        look_at_exam(
            archives.packed(tmp_path / "e.kinarm", archives.members(exams, trials, robot))
        ),
    ]

    def plain(look):
        rows = [{**row, "file": row["file"].removesuffix(".c3d")} for row in look.trials]
        return look.tables, rows

    assert plain(looks[0]) == plain(looks[1]) == plain(looks[2])


def test_an_exam_without_a_force_sensor_is_looked_at(lab, exams, tmp_path, capsys):
    channels = ("Right_FS_ForceX", "Right_FS_ForceY")
    trials, robot = lab(8, every={"drop_channels": channels}, changes={2: {"is_error": 1}})
    exam = exams.zip(tmp_path / "e.zip", exams.files(trials, robot))
    assert main(["convert", str(exam), str(tmp_path / "session")]) == 2
    assert main(["exam", str(exam)]) == 0
    said = capsys.readouterr().out
    assert "armimpedance convert" not in said
    assert "cannot be converted" in said
    look = look_at_exam(exam)
    assert len(table(look, "Protocols")) == 8
    assert {row["state"] for row in look.trials} == {"sound"}


def test_of_two_arms_either_can_be_looked_at(lab, exams, tmp_path):
    other = {"extra_channels": {"Left_L1Ang": 1.0, "Left_L2Ang": 2.0, "Left_FS_ForceX ": 2.0}}
    trials, robot = lab(8, every={**other, "drop_channels": ("Left_FS_ForceX",)})
    exam = exams.zip(tmp_path / "e.zip", exams.files(trials, robot))
    assert "--side right" in look_at_exam(exam).next[0]
    assert any("--side left" in line for line in look_at_exam(exam).next)
    assert "--side left" in look_at_exam(exam, "left").next[0]
    ways = [
        [row["direction_deg"] for row in look_at_exam(exam, s).trials] for s in ("right", "left")
    ]
    np.testing.assert_allclose(ways[1], np.mod(180.0 - np.array(ways[0]), 360.0), atol=1e-3)


def test_inputs_that_move_may_hold_emg(lab, exams, tmp_path, c3d, monkeypatch):
    trials, robot = lab(8)
    rng = np.random.default_rng(3)
    trials = [
        replace(
            trial,
            extra_channels={
                "ACH1": 0.5,
                "ACH2": rng.uniform(-2, 2, trial.samples),
                "Delsys_EMG_4": rng.uniform(0, 1, trial.samples) if i < 5 else 0.0,
                "Gaze_X": rng.uniform(0, 1, trial.samples),
            },
        )
        for i, trial in enumerate(trials)
    ]
    look = look_at_exam(exams.folder(tmp_path, exams.files(trials, robot)))
    rows = {row[0]: row for row in table(look, "Inputs that may hold EMG")}
    assert {name: row[1] for name, row in rows.items()} == {"ACH2": "8", "Delsys_EMG_4": "5"}
    signals = np.concatenate([trial.extra_channels["ACH2"] for trial in trials])
    assert float(rows["ACH2"][2]) == pytest.approx(signals.min(), rel=1e-3)
    assert float(rows["ACH2"][3]) == pytest.approx(signals.max(), rel=1e-3)
    assert any("Gaze_X" in line for line in look.head)
    # What is named can be taken.
    names = {"ACH2": "biceps_long", "Delsys_EMG_4": "triceps_long"}
    assert read(tmp_path, emg_channels=names).muscles == tuple(names.values())


@pytest.mark.parametrize(
    ("events", "pair"),
    [
        ((("PERTURB_ON", 0.1), ("PERTURB_OFF", 0.4)), ["PERTURB_ON", "PERTURB_OFF"]),
        ((("Load Start", 0.1), ("load end", 0.4), ("GO", 0.0)), ["Load_Start", "load_end"]),
        ((("PERT_ON", 0.4), ("PERT_OFF", 0.1)), None),
        ((("TARGET_ON", 0.1), ("TARGET_OFF", 0.4)), None),
        ((("PUSH_ON", 0.1), ("PUSH_OFF", 0.2), ("LOAD_ON", 0.1), ("LOAD_OFF", 0.2)), None),
        ((("FORCE", 0.1), ("CONTROL_PERT", 0.4)), None),
        ((), None),
    ],
)
def test_events_are_proposed_only_where_their_names_say_it(lab, exams, tmp_path, events, pair):
    trials, robot = lab(8, every={"events": events})
    exam = exams.folder(tmp_path / "e", exams.files(trials, robot))
    words = shlex.split(look_at_exam(exam).next[0])
    assert (words[words.index("--events") + 1 :] if "--events" in words else None) == pair
    assert main([*words[1:3], str(tmp_path / "session"), *words[4:]]) == 0


def test_events_that_never_occurred_are_listed(lab, exams, c3d, tmp_path):
    tables = {"EVENT_DEFINITIONS": {"LABELS": c3d.texts("PERT_ON", "TOO SLOW", "PERT_OFF")}}
    changes = {2: {"events": (("PERT_ON", 0.125),)}}
    trials, robot = lab(8, tables=tables, changes=changes)
    look = look_at_exam(exams.folder(tmp_path, exams.files(trials, robot)))
    events = {row[0]: row[1:] for row in table(look, "Events")}
    assert events == {
        "PERT_ON": ["8", "0.1", "0.125"],
        "PERT_OFF": ["7", "0.4", "0.4"],
        "TOO_SLOW": ["0", "-", "-"],
    }


def test_of_a_long_exam_little_is_kept(lab, exams, tmp_path, monkeypatch):
    trials, robot = lab(40)
    exam = exams.folder(tmp_path, exams.files(trials, robot))
    whole = look_at_exam(exam)
    monkeypatch.setattr(overview, "KEPT_SAMPLES", 5000)
    kept = []
    held = overview._Spread.keep

    def keep(self, file):
        small = held(self, file)
        kept.append(sum(each.frames for each in self.files))
        assert all(len(values) == 2 for values in small.channels.values())
        # Nothing that is kept holds the room of what is not.
        held_by = [
            v.base for each in (small, *self.files) for v in each.channels.values() if v.any()
        ]
        assert set(held_by) == {None}
        return small

    monkeypatch.setattr(overview._Spread, "keep", keep)
    few = look_at_exam(exam)
    assert len(kept) == 40
    assert max(kept) <= 5000
    assert (few.tables, few.next, few.trials) == (whole.tables, whole.next, whole.trials)


def test_trials_that_are_kept_whole_are_spread_evenly(monkeypatch):
    monkeypatch.setattr(overview, "KEPT_SAMPLES", 1000)
    spread = overview._Spread()
    for number in range(95):
        spread.keep(ExamFile(str(number), {}, 1000.0, 100, {}, {}))
    kept = [int(file.name) for file in spread.files]
    assert 5 < len(kept) <= 10
    assert set(np.diff(kept)) == {kept[1]}
    assert kept[-1] + kept[1] >= 95


def test_nobody_is_named(lab, exams, tmp_path, monkeypatch, capsys):
    trials, robot = lab(8)
    exams.zip(tmp_path / "e.zip", exams.files(trials, robot))
    monkeypatch.chdir(tmp_path)
    assert main(["exam", "e.zip", "--out", "t.csv"]) == 0
    said = capsys.readouterr().out + (tmp_path / "t.csv").read_text()
    assert not [word for word in ("Jane", "Doe", "Secret", "2021", "11:12") if word in said]


@pytest.mark.parametrize("ending", [".csv", ".json", ".parquet"])
def test_one_row_a_trial_in_every_format(lab, exams, tmp_path, ending):
    trials, robot = lab(8, changes={2: EMPTY, 3: {"forces": np.zeros((500, 2))}})
    exam = exams.zip(tmp_path / "e.zip", exams.files(trials, robot))
    out = tmp_path / f"t{ending}"
    assert main(["exam", str(exam), "--out", str(out)]) == 0
    readers = {".csv": pd.read_csv, ".json": pd.read_json, ".parquet": pd.read_parquet}
    made = readers[ending](out)
    assert len(made) == 8
    assert (made["state"] == "sound").sum() == 6
    assert made["protocol"].tolist() == [1, *range(4, 9), 3, 2]


def test_bad_calls_are_one_line(lab, exams, tmp_path, capsys):
    (tmp_path / "a.txt").write_text("x")
    (tmp_path / "folder").mkdir()
    (tmp_path / "e.zip").write_bytes(b"PK")
    trials, robot = lab(8, every=EMPTY)
    empty = exams.folder(tmp_path / "empty", exams.files(trials, robot))
    for place in (tmp_path / "none", tmp_path / "a.txt", tmp_path / "folder", empty):
        assert main(["exam", str(place)]) == 2
    assert main(["exam", str(tmp_path / "e.zip")]) == 2
    assert main(["exam", str(tmp_path), "--out", str(tmp_path / "a.doc")]) == 2
    assert capsys.readouterr().err.count("\n") == 6


@pytest.mark.study
def test_damaged_exams_are_looked_at_or_refused_by_name(lab, exams, c3d, tmp_path):
    """Bytes of the shared file and of a trial are changed, cut out and put in."""
    trials, robot = lab(8)
    files = exams.files([replace(trial, samples=20, **_short(trial)) for trial in trials], robot)
    rng = np.random.default_rng(18)
    looked = refused = 0
    for _ in range(120):
        damaged = dict(files)
        name = str(rng.choice(["common.c3d", "01_03_01.c3d"]))
        damaged[name] = _mutated(files[name], rng)
        try:
            look = look_at_exam(exams.folder(tmp_path / "e", damaged))
        except InputError as error:
            refused += 1
            said = str(error)
        else:
            looked += 1
            assert len(look.trials) == 8
            said = "".join([*look.head, *look.next])
        assert said.isprintable()
    assert looked > 20
    assert refused > 5


def _short(trial):
    parts = ("links", "forces", "motors")
    return {name: getattr(trial, name)[:20] for name in parts}


def _mutated(data, rng):
    data = bytearray(data)
    head = min(len(data), 4000)
    kind = rng.integers(4)
    for _ in range(int(rng.integers(1, 6))):
        at = int(rng.integers(head))
        if kind == 0:
            data[at] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            data[at : at + 4] = struct.pack("<f", float(rng.choice([np.nan, np.inf, 3e38, -1e9])))
        elif kind == 2:
            data[at : at + 2] = struct.pack("<H", int(rng.choice([0, 1, 255, 32767, 65535])))
        else:
            del data[at : at + int(rng.integers(1, 40))]
    return bytes(data)
