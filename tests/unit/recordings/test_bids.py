"""Folders of BIDS: the same points in any frame and unit, clocks, trials, meanings, damage."""

from __future__ import annotations

import contextlib
import gzip
import itertools
import json
import shutil
from pathlib import Path

import bids_bench as bench
import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import Hinge, Segment, Skeleton
from armimpedance.recordings import ReadOptions, open_recording
from armimpedance.recordings.sources.bids import SOURCE

DIRECTIONS = {
    "A": (1, 0, 0), "P": (-1, 0, 0),
    "L": (0, 1, 0), "R": (0, -1, 0),
    "S": (0, 0, 1), "I": (0, 0, -1),
}  # fmt: skip
FRAMES = [
    "".join(f) for p in itertools.permutations(("AP", "LR", "SI")) for f in itertools.product(*p)
]


def _everything(_name: str) -> bool:
    return True


@pytest.fixture
def dataset(tmp_path: Path) -> Path:
    bench.write_dataset(tmp_path / "data")
    return tmp_path / "data"


def _motion(root: Path) -> Path:
    return root / "sub-01" / "motion" / "sub-01_task-reach_tracksys-omc"


def test_points_come_back_in_metres_from_every_path_to_them(dataset):
    whole = open_recording(dataset)
    np.testing.assert_array_equal(whole.positions, bench.places() / 1000.0)
    assert whole.names == ("p1", "p2")
    assert (whole.subject.id, whole.subject.mass_kg, whole.subject.height_m) == ("01", 70.0, 1.8)
    for path in (dataset / "sub-01", Path(f"{_motion(dataset)}_motion.tsv")):
        np.testing.assert_array_equal(open_recording(path).positions, whole.positions)


@pytest.mark.parametrize("axes", FRAMES)
def test_any_frame_gives_the_same_world(tmp_path, axes):
    # what the file would hold in this frame of points that are known in the world's
    world = bench.places()
    turned = np.stack([world @ np.array(DIRECTIONS[d], float) for d in axes], axis=-1)
    bench.write_dataset(tmp_path, axes=axes, emg=False, physio=False)
    bench.write_motion(_motion(tmp_path), turned, axes)
    np.testing.assert_array_equal(open_recording(tmp_path).positions, world / 1000.0)


def test_axes_that_nobody_tells_are_refused_and_those_given_are_used(tmp_path):
    bench.write_dataset(tmp_path, emg=False, physio=False)
    _motion(tmp_path).with_name(_motion(tmp_path).name + "_channels.json").unlink()
    with pytest.raises(InputError, match="--axes"):
        open_recording(tmp_path)
    given = open_recording(tmp_path, ReadOptions(axes=("y", "z", "x")))
    np.testing.assert_array_equal(given.positions, bench.places()[..., [1, 2, 0]] / 1000.0)


@pytest.mark.parametrize("missing", ["n/a", "NaN", "0"])
def test_a_point_that_was_not_seen_is_lost(tmp_path, missing):
    bench.write_dataset(tmp_path, emg=False, physio=False)
    points = bench.places()
    points[7, 1] = np.nan if missing != "0" else 0.0
    bench.write_motion(_motion(tmp_path), points)
    if missing == "0":
        told = {"SamplingFrequency": 50, "TaskName": "reach", "MissingValues": "0"}
        bench.write_json(_motion(tmp_path).with_name(_motion(tmp_path).name + "_motion.json"), told)
    positions = open_recording(tmp_path).positions
    assert np.isnan(positions[7, 1]).all()
    assert np.isnan(positions).sum() == 3


def test_a_description_higher_up_holds_and_one_nearer_comes_first(dataset):
    own = Path(f"{_motion(dataset)}_motion.json")
    bench.write_json(dataset / "motion.json", {"SamplingFrequency": 50})
    bench.write_json(dataset / "task-other_motion.json", {"SamplingFrequency": 1})
    own.unlink()
    assert open_recording(dataset).sample_rate_hz == 50
    bench.write_json(
        dataset / "sub-01" / "sub-01_task-reach_motion.json", {"SamplingFrequency": 40}
    )
    assert open_recording(dataset).sample_rate_hz == 40
    bench.write_json(own, {"SamplingFrequency": 30})
    assert open_recording(dataset).sample_rate_hz == 30


def test_emg_is_in_the_unit_of_its_own_header_and_begins_with_the_motion(dataset):
    markers = open_recording(dataset, ReadOptions(emg_channels={"extensor": "triceps"}))
    drawn = np.random.default_rng(1).integers(-999, 999, (700, 2))[:, 1]
    # the EMG ran for 0.1 s, 50 samples, before the cameras did; _channels.tsv says V, the file uV
    np.testing.assert_allclose(markers.emg.signals[:, 0], drawn[50:] * 1e-6, rtol=0, atol=1e-12)
    assert (markers.emg.sample_rate_hz, markers.emg.unit) == (500.0, "V")


def test_what_is_not_taken_is_said(dataset):
    told = " ".join(open_recording(dataset).provenance)
    for name in ("temperature", "flexor", "extensor", "push"):
        assert name in told


def test_every_system_is_a_table_on_one_time_base(dataset):
    raw = SOURCE.read(dataset, _everything)
    motion, emg, physio = raw.runs[0].tables
    np.testing.assert_allclose(motion.time_s, np.arange(60) / 50)
    np.testing.assert_allclose(emg.time_s, -0.1 + np.arange(700) / 500, atol=1e-12)
    np.testing.assert_array_equal(physio.columns["push"].values, np.arange(30))
    assert (motion.columns["p1_x"].unit, physio.columns["push"].unit) == ("mm", "N")
    assert raw.runs[0].facts["mass_kg"] == 70.0
    only = SOURCE.read(dataset, lambda name: name == "push")
    assert [list(t.columns) for t in only.runs[0].tables] == [["push"]]
    assert "p1_x" in only.not_taken[-1]


def _with_events(dataset: Path, rows: list[tuple[object, ...]]) -> None:
    header = ("onset", "duration", "trial_type", "condition", "angle")
    bench.write_tsv(_motion(dataset).with_name("sub-01_task-reach_events.tsv"), [header, *rows])


def test_events_that_are_trials_cut_every_clock(dataset):
    events = [(0.2, 0.4, "trial", "007", 30), (0.6, 0.1, "beep", "n/a", "n/a")]
    _with_events(dataset, [*events, (0.8, 0.2, "trial", "b", 60)])
    raw = SOURCE.read(dataset, _everything)
    for run, (start, stop) in zip(raw.runs, [(0.2, 0.6), (0.8, 1.0)], strict=True):
        for table in run.tables:
            time = table.time_s
            assert time[0] == pytest.approx(start, abs=0.5 / table.rate_hz)
            assert len(time) == round((stop - start) * table.rate_hz)
    assert [run.facts["condition"] for run in raw.runs] == ["007", "b"]
    assert raw.runs[0].facts["angle"] == 30.0
    markers = open_recording(dataset)
    assert list(markers.trials["condition"]) == ["007", "b"]
    np.testing.assert_array_equal(markers.positions[:20], bench.places()[10:30] / 1000.0)
    assert "1 events beep" in " ".join(markers.provenance)


def test_a_trial_outside_of_the_record_is_named(dataset):
    _with_events(dataset, [(99, 1, "trial", "a", 0)])
    for read in (open_recording, lambda path: SOURCE.read(path, _everything)):
        with pytest.raises(InputError, match="events inside"):
            read(dataset)


def test_latencies_are_the_clock_and_must_run_forward(dataset):
    stem = _motion(dataset)
    channels = stem.with_name(stem.name + "_channels.tsv")
    channels.write_text(channels.read_text().replace("MISC", "LATENCY"))
    table = stem.with_name(stem.name + "_motion.tsv")
    rows = [line.split("\t")[:-1] for line in table.read_text().splitlines()]
    latency = np.arange(60) / 50 * 1.001
    bench.write_tsv(table, [[*r, repr(float(t))] for r, t in zip(rows, latency, strict=True)])
    np.testing.assert_array_equal(
        SOURCE.read(dataset, _everything).runs[0].tables[0].time_s, latency
    )
    latency[30] = latency[29]
    bench.write_tsv(table, [[*r, repr(float(t))] for r, t in zip(rows, latency, strict=True)])
    with pytest.raises(InputError, match="row 31.*temperature"):
        SOURCE.read(dataset, _everything)


def test_two_systems_are_told_apart_by_name(dataset):
    other = dataset / "sub-01" / "motion" / "sub-01_task-reach_tracksys-imu"
    bench.write_motion(other, bench.places(seed=5))
    with pytest.raises(InputError, match="imu, omc"):
        open_recording(dataset)
    chosen = open_recording(dataset, ReadOptions(prefix="imu"))
    np.testing.assert_array_equal(chosen.positions, bench.places(seed=5) / 1000.0)
    names = SOURCE.read(dataset, _everything).runs[0].tables[0].columns
    assert "imu/p1_x" in names


def test_a_mapping_gives_channels_their_meaning(dataset):
    mapping = dataset.parent / "columns.toml"
    mapping.write_text(
        'kind = "hand"\n'
        '[position]\ncolumns = ["p1_x", "p1_y"]\nunit = "mm"\n'
        '[force]\ncolumns = ["p2_x", "p2_y"]\nscale = 0.5\nby = "device"\n'
        '[trials]\nby = "run"\n[trials.columns]\ncondition = "task"\n'
    )
    hand = open_recording(dataset, ReadOptions(mapping=mapping))
    np.testing.assert_array_equal(hand.position, bench.places()[:, 0, :2] / 1000.0)
    np.testing.assert_array_equal(hand.force, -0.5 * bench.places()[:, 1, :2])
    assert list(hand.trials["condition"]) == ["reach"]
    shutil.move(mapping, dataset / "code.toml")
    (dataset / "code").mkdir()
    shutil.move(dataset / "code.toml", dataset / "code" / "columns.toml")
    np.testing.assert_array_equal(open_recording(dataset).force, hand.force)
    with pytest.raises(InputError, match="mapping"):
        open_recording(dataset, ReadOptions(axes=("x", "y", "z")))


def test_several_persons_are_refused_by_name(dataset):
    shutil.copytree(dataset / "sub-01", dataset / "sub-02")
    with pytest.raises(InputError, match="sub-01, sub-02"):
        open_recording(dataset)


def test_a_broken_emg_costs_only_those_who_want_it(dataset):
    file = dataset / "sub-01" / "emg" / "sub-01_task-reach_emg.edf"
    file.write_bytes(file.read_bytes()[:900])
    assert file.name in " ".join(open_recording(dataset).provenance)
    with pytest.raises(InputError, match=file.name):
        open_recording(dataset, ReadOptions(emg_channels={"flexor": "biceps"}))


@pytest.mark.parametrize(
    ("place", "value"), [(236, b"99999999"), (252, b"9999"), (252, b"0   "), (236, b"-1      ")]
)
def test_counts_of_an_edf_are_held_against_the_file(dataset, place, value):
    file = dataset / "sub-01" / "emg" / "sub-01_task-reach_emg.edf"
    content = bytearray(file.read_bytes())
    content[place : place + len(value)] = value
    file.write_bytes(content)
    with pytest.raises(InputError, match=file.name):
        SOURCE.read(dataset, _everything)


def test_a_packed_table_that_unpacks_without_end_is_refused(dataset, monkeypatch):
    from armimpedance.recordings.bids import tsv

    monkeypatch.setattr(tsv, "_LARGEST_UNPACKED_BYTES", 10_000)
    file = dataset / "sub-01" / "motion" / "sub-01_task-reach_physio.tsv.gz"
    file.write_bytes(gzip.compress(b"1\n" * 100_000))
    with pytest.raises(InputError, match="unpacks to more"):
        SOURCE.read(dataset, _everything)


@pytest.mark.parametrize(
    ("row", "cell"), [(3, "abc"), (3, "1e999"), (3, "1_0"), (3, "inf"), (5, "1\t2")]
)
def test_a_wrong_cell_is_named_by_its_row(dataset, row, cell):
    table = Path(f"{_motion(dataset)}_motion.tsv")
    lines = table.read_text().splitlines()
    lines[row - 1] = "\t".join([cell, *lines[row - 1].split("\t")[1:]])
    table.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=f"row {row}"):
        open_recording(dataset)


def test_a_repeated_header_is_no_sample(dataset):
    table = Path(f"{_motion(dataset)}_motion.tsv")
    names = [*(f"p{p}_{a}" for p in (1, 2) for a in "xyz"), "temperature"]
    table.write_text("\t".join(names) + "\n" + table.read_text())
    np.testing.assert_array_equal(open_recording(dataset).positions, bench.places() / 1000.0)


def test_every_damaged_byte_of_a_description_is_a_typed_error_or_no_matter(dataset):
    rng = np.random.default_rng(3)
    files = [f for f in dataset.rglob("*") if f.is_file()]
    whole = {f: f.read_bytes() for f in files}
    for _ in range(60):
        file = files[int(rng.integers(len(files)))]
        content = bytearray(whole[file])
        content[int(rng.integers(min(len(content), 900)))] = int(rng.integers(256))
        file.write_bytes(content)
        for read in (open_recording, lambda path: SOURCE.read(path, _everything)):
            with contextlib.suppress(InputError):
                read(dataset)
        file.write_bytes(whole[file])


def test_a_file_of_json_that_is_no_object_is_named(dataset):
    file = Path(f"{_motion(dataset)}_motion.json")
    file.write_text(json.dumps([1, 2]))
    with pytest.raises(InputError, match=file.name):
        open_recording(dataset)


def _elbow() -> Skeleton:
    trunk = Segment("trunk", None, np.zeros(3))
    hinge = Hinge("elbow_flexion", np.array([0.0, -1.0, 0.0]))
    return Skeleton(
        (trunk, Segment("forearm", "trunk", np.array([0.0, 0, -0.3]), (hinge,))), floating=False
    )


@pytest.mark.parametrize(("unit", "degrees"), [("deg", None), ("rad", None), ("n/a", True)])
def test_joint_angles_move_a_skeleton(tmp_path, unit, degrees):
    bench.write_dataset(tmp_path, emg=False, physio=False)
    stem = _motion(tmp_path)
    channels = [bench.CHANNELS, ("flex", "n/a", "JNTANG", "n/a", unit, "n/a")]
    bench.write_tsv(stem.with_name(stem.name + "_channels.tsv"), channels)
    angle = np.random.default_rng(0).normal(size=60)
    bench.write_tsv(stem.with_name(stem.name + "_motion.tsv"), [[repr(float(a))] for a in angle])
    options = ReadOptions(skeleton=_elbow(), angles={"elbow_flexion": "-flex"}, in_degrees=degrees)
    motion = open_recording(tmp_path, options)
    expected = angle if unit == "rad" else np.deg2rad(angle)
    np.testing.assert_allclose(motion.coordinates[:, 0], -expected, rtol=1e-15)
    for wrong in (ReadOptions(), ReadOptions(skeleton=_elbow())):
        with pytest.raises(InputError, match=r"skeleton"):
            open_recording(tmp_path, wrong)


def test_a_name_that_no_path_can_have_is_nobody_s(dataset):
    scans = dataset / "sub-01" / "sub-01_scans.tsv"
    scans.write_bytes(scans.read_bytes().replace(b"motion/sub-01", b"motion/sub\x0001"))
    with contextlib.suppress(InputError):
        open_recording(dataset)
