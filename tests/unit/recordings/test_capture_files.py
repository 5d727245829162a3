"""Motion-capture C3D of three processors, reals and integers, with every known oddity."""

from __future__ import annotations

import capture_bench as bench
import numpy as np
import pytest
from capture_bench import C3dFile, real, whole

from armimpedance.core.errors import InputError
from armimpedance.recordings.c3d.c3d_file import parse_c3d
from armimpedance.recordings.c3d.parameters import PROCESSORS
from armimpedance.recordings.motion.marker_c3d import read_marker_c3d

RNG = np.random.default_rng(8)
POINTS = RNG.uniform(-1500, 1500, (9, 3, 3)).astype(np.float32)
EMG = (RNG.normal(size=(18, 2)) * 2).astype(np.float32)
EVERY = [(p, r) for p in ("intel", "dec", "mips") for r in (True, False)]


def made(**changes: object) -> C3dFile:
    settings: dict = {
        "points": POINTS.astype(float), "labels": ["a", "b", "c"], "samples_per_frame": 2,
        "analog": {"E1": EMG[:, 0].astype(float), "E2": EMG[:, 1].astype(float)},
        "lost": ((3, 1),),
    }  # fmt: skip
    return C3dFile(**(settings | changes))


def save(folder, capture: C3dFile, name: str = "walk.c3d"):
    file = folder / name
    file.write_bytes(capture.write())
    return file


@pytest.mark.parametrize(("processor", "reals"), EVERY)
def test_every_processor_gives_the_same_numbers(processor, reals, tmp_path):
    file = save(tmp_path, made(processor=processor, reals=reals))
    read = read_marker_c3d(file, emg_channels={"E1": "biceps", "E2": "triceps"})
    assert read.names == ("a", "b", "c")
    assert (read.sample_rate_hz, read.emg.sample_rate_hz) == (100.0, 200.0)
    lost = np.isnan(read.positions[..., 0])
    assert np.argwhere(lost).tolist() == [[3, 1]]
    off = np.abs(read.positions - POINTS.astype(float) / 1000)[~lost].max()
    emg_off = np.abs(read.emg.signals - EMG).max()
    # Reals come back to the last bit; integers within half a step.
    assert off <= (1e-15 if reals else 0.0251e-3)
    assert emg_off <= (0.0 if reals else 0.00501)


def test_a_vax_real_by_its_bits():
    # VAX F_floating from DEC's manual: 1 is 0x4080, -2.5 is 0xC120, the sign alone is reserved.
    stored = bytes.fromhex("80400000 20c10000 00000000 00800000 ff7fffff 80000000")
    dec = PROCESSORS[85]
    values = dec.decoded(np.frombuffer(stored, dec.dtype("f4")))
    assert values[:3].tolist() == [1.0, -2.5, 0.0]
    assert np.isnan(values[3])
    assert values[4] == (1 - 2.0**-24) * 2.0**127
    assert values[5] == 2.0**-128


def test_vax_reals_over_all_sizes():
    numbers = np.float32(RNG.normal(size=500) * 10.0 ** RNG.uniform(-30, 30, 500))
    stored = b"".join(bench.vax(float(v)) for v in numbers)
    dec = PROCESSORS[85]
    np.testing.assert_array_equal(dec.decoded(np.frombuffer(stored, dec.dtype("f4"))), numbers)


@pytest.mark.parametrize(("processor", "reals"), [e for e in EVERY if e[0] != "mips"])
def test_as_ezc3d_reads_it(processor, reals, tmp_path):
    ezc3d = pytest.importorskip("ezc3d")
    file = save(tmp_path, made(processor=processor, reals=reals))
    other = ezc3d.c3d(str(file))
    own = parse_c3d(file.read_bytes(), "walk.c3d")
    seen = ~own.unseen(range(3))
    theirs = other["data"]["points"][:3].transpose(2, 1, 0)
    np.testing.assert_array_equal(own.places(range(3))[seen], theirs[seen])
    np.testing.assert_array_equal(own.analog([0, 1]), other["data"]["analogs"][0].T)


def test_more_frames_than_sixteen_bits_hold(tmp_path):
    n = 70001
    places = np.zeros((n, 1, 3)) + np.arange(1, n + 1)[:, None, None] % 1000 + 1
    trial = {"ACTUAL_START_FIELD": whole(1, 0), "ACTUAL_END_FIELD": whole(n % 65536, 1)}
    for groups in ({"TRIAL": trial}, {"POINT": {"LONG_FRAMES": real(float(n))}}, {}):
        for last in (n % 65536, 65535):
            # The block is filled with more than one frame, which only the exact count tells apart.
            file = C3dFile(places, ["a"], groups=groups, last_frame=last)
            read = parse_c3d(file.write(), "a.c3d")
            assert read.layout.frames == n if groups else n <= read.layout.frames < n + 32


def test_channels_in_place_of_samples(tmp_path):
    data = bytearray(made().write())
    data[4:6] = (2).to_bytes(2, "little")
    read = parse_c3d(bytes(data), "a.c3d")
    np.testing.assert_array_equal(read.analog([0, 1]), EMG)
    assert "2 analog values a frame" in read.layout.remarks[0]


def test_a_last_pointer_that_points_anywhere():
    data = bytearray(made(processor="mips").write())
    last = data.rindex(b"USED")
    assert data[last + 4 : last + 6] == b"\0\0"
    data[last + 4 : last + 6] = b"\x3f\xff"
    assert parse_c3d(bytes(data), "a.c3d").point_labels == ("a", "b", "c")


def test_a_pointer_that_was_not_kept_up():
    data = bytearray(made().write())
    at = data.index(b"LABELS") + 6
    data[at : at + 2] = b"\x03\x00"
    read = parse_c3d(bytes(data), "a.c3d")
    assert read.point_labels == ("a", "b", "c")
    assert read.length_unit == "mm"


def test_four_letters_and_the_whole_name(tmp_path):
    groups = {"POINT": {"DESCRIPTIONS": ["r.thigh.front", "r.thigh.rear", "r.toe"]}}
    file = save(tmp_path, made(labels=["RTHI", "RTHI", "RTOE"], groups=groups))
    assert read_marker_c3d(file).names == ("r.thigh.front", "r.thigh.rear", "RTOE")
    same = {"POINT": {"DESCRIPTIONS": ["thigh", "thigh", "toe"]}}
    twice = save(tmp_path, made(labels=["RTHI", "RTHI", "RTOE"], groups=same))
    assert read_marker_c3d(twice).names == ("RTHI", "RTHI~2", "RTOE")


@pytest.mark.parametrize("form", ["UNSIGNED", "SIGNED"])
def test_unsigned_offsets(form):
    groups = {"ANALOG": {"FORMAT": [form], "OFFSET": whole(32784, 32767)}}
    counts = {"E1": EMG[:, 0] * 100 + 32784.0, "E2": EMG[:, 1] * 100 + 32767.0}
    read = parse_c3d(made(analog=counts, groups=groups).write(), "a.c3d")
    assert np.abs(read.analog([0, 1]) - 100 * EMG).max() < 0.01


# ---- events -------------------------------------------------------------------------------------

EVENTS = {
    "USED": whole(4),
    "LABELS": ["Foot Strike", "Foot Off", "Foot Strike", "Sync"],
    "CONTEXTS": ["Left", "Left", "Left", "General"],
    "SUBJECTS": ["Ann", "Ann", "Ann", "Bob"],
    "TIMES": np.array([[0, 2.005], [0, 2.03], [0, 2.06], [1, 30.0]]),
}


def test_events_on_the_trials_own_clock(tmp_path):
    # Frame 201 is the first: the events' clock began 2 s before.
    file = save(tmp_path, made(groups={"EVENT": EVENTS}, first_frame=201))
    read = read_marker_c3d(file)
    row = read.trials.iloc[0]
    times = row[["event_Left_Foot_Strike_s", "event_Left_Foot_Off_s", "event_Left_Foot_Strike_2_s"]]
    np.testing.assert_allclose(times.astype(float), [0.005, 0.03, 0.06], atol=1e-6)
    assert any("Sync at 88.000 s (events outside" in s for s in read.provenance)
    named = save(tmp_path, made(labels=["Bob:a", "Bob:b", "Bob:c"], groups={"EVENT": EVENTS}))
    other = read_marker_c3d(named, prefix="Bob")
    assert "Left Foot Off" in " ".join(other.provenance)
    assert "event_Left_Foot_Off_s" not in other.trials


def test_events_of_the_header(tmp_path):
    for processor in bench.PROCESSORS:
        events = (("RHS", 0.02), ("RTO", 0.05))
        file = save(tmp_path, made(processor=processor, header_events=events))
        trials = read_marker_c3d(file).trials
        assert trials[["event_RHS_s", "event_RTO_s"]].iloc[0].tolist() == [0.02, 0.05]


def test_trials_with_different_events(tmp_path):
    with_one = save(tmp_path, made(header_events=(("GO", 0.03),)), "a.c3d")
    without = save(tmp_path, made(), "b.c3d")
    column = read_marker_c3d([with_one, without]).trials["event_GO_s"]
    assert column.isna().tolist() == [False, True]


# ---- what is left out ---------------------------------------------------------------------------


def test_what_was_not_taken_is_listed(tmp_path):
    groups = {
        "POINT": {"ANGLES": ["knee"], "MOMENTS": ["torque"], "TYPE_GROUPS": ["ANGLES", "MOMENTS"]},
        "ROTATION": {"LABELS": ["pelvis_4X4"], "USED": whole(1)},
        "ANALYSIS": {"USED": whole(1), "NAMES": ["Cadence"]},
        "EMPTY": {"USED": whole(0)},
    }
    labels = ["S:hand", "box:corner", "knee", "torque", "*4"]
    points = np.concatenate([POINTS, POINTS], axis=1)[:, :5].astype(float)
    points[:, 2:4] *= 100  # an angle is no place: it may not be refused as too far away
    file = save(tmp_path, made(points=points, labels=labels, groups=groups, residual=3.0))
    read = read_marker_c3d(file, prefix="S", emg_channels={"E1": "biceps"})
    assert read.names == ("hand",)
    told = [s.removeprefix("Not taken: ") for s in read.provenance if s.startswith("Not taken")]
    for name in ("E2", "corner", "knee", "torque", "pelvis_4X4", "ANALYSIS", "residuals"):
        assert sum(s.startswith((f"{name} ", f"{name},")) for s in told) == 1, name
    assert not any("E1" in s or "EMPTY" in s or "box" in s for s in told)


def test_outputs_alone_are_no_markers(tmp_path):
    groups = {"POINT": {"ANGLES": ["a", "b", "c"]}}
    with pytest.raises(InputError, match="none of its 3 points is a marker"):
        read_marker_c3d(save(tmp_path, made(groups=groups)))


def test_channels_of_one_name_or_not_finite(tmp_path):
    broken = EMG[:, 0].astype(float)
    broken[4] = np.nan
    file = save(tmp_path, made(analog={"E1": broken}))
    with pytest.raises(InputError, match="E1 holds a value that is not finite"):
        read_marker_c3d(file, emg_channels={"E1": "biceps"})
    data = file.read_bytes().replace(b"E1", b"E2", 1)
    assert b"E2" in data
    twice = made().write()
    at = twice.index(b"E1E2")
    (tmp_path / "b.c3d").write_bytes(twice[:at] + b"E1E1" + twice[at + 4 :])
    with pytest.raises(InputError, match="2 channels 'E1'"):
        read_marker_c3d(tmp_path / "b.c3d", emg_channels={"E1": "biceps"})
