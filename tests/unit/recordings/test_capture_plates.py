"""Force plates of C3D files: every type against a body whose force and place are known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import capture_bench as bench
import numpy as np
import pytest
from capture_bench import PlateTruth, a_load, corners, on_plates, real, whole

from armimpedance.core.errors import InputError
from armimpedance.core.motion import WRENCH
from armimpedance.recordings import write_recording
from armimpedance.recordings.c3d.c3d_file import read_c3d
from armimpedance.recordings.c3d.plates import force_unit, local_wrench, moment_unit, plates_of
from armimpedance.recordings.motion.marker_c3d import read_marker_c3d
from armimpedance.recordings.motion.moving_metadata import lab_rotation
from armimpedance.recordings.opening import open_recording
from armimpedance.recordings.reading import ReadOptions
from manipulandum_sim.body import simulate_body

Z = np.array([0.0, 0.0, 1.0])
Y = np.array([0.0, 1.0, 0.0])
MATRIX = np.eye(6) * [1.5, 1.4, 2.0, 0.6, 0.7, 0.5] + 0.02 * np.arange(36).reshape(6, 6) / 36
SAMPLES = 30


def plate(up=Z, centre=(0.5, 0.4, 0.01), turn=0.3, seed=1, samples=SAMPLES) -> PlateTruth:
    """A load on a plate that lies level, turned about the vertical."""
    level = np.array([np.cos(turn), np.sin(turn), 0.0])
    along = level if up is Z else np.array([level[0], 0.0, level[1]])
    return a_load(corners(np.array(centre), along, up, 0.6, 0.4), up, samples, seed)


def save(folder, capture, name="stand.c3d"):
    file = folder / name
    file.write_bytes(capture.write())
    return file


def lab_truth(truth: PlateTruth, rotation=None) -> np.ndarray:
    """Force and moment about the lab's origin, in the world's axes."""
    R = np.eye(3) if rotation is None else rotation
    return np.hstack([truth.force @ R.T, truth.moment(np.zeros(3)) @ R.T])


def about_lab(recording) -> np.ndarray:
    moved = recording.wrenches.copy()
    moved[..., 3:] += np.cross(recording.plate_origins_m, moved[..., :3])
    return moved


def left_out(recording) -> str:
    return " ".join(s for s in recording.provenance if s.startswith("Not taken"))


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
@pytest.mark.parametrize("by_plate", [False, True])
@pytest.mark.parametrize(("unit", "length"), [("mm", 1e-3), ("m", 1.0), ("cm", 1e-2)])
def test_force_and_moment_about_the_lab_origin(kind, by_plate, unit, length, tmp_path):
    truths = [plate(), plate(centre=(-0.4, 0.1, 0.0), turn=-2.0, seed=2)]
    matrix = MATRIX if kind == 4 else None
    file = on_plates(truths, kind, by_plate=by_plate, unit=unit, length=length, matrix=matrix)
    read = read_marker_c3d(save(tmp_path, file))
    assert read.wrenches.shape == (SAMPLES, 2, len(WRENCH))
    for k, truth in enumerate(truths):
        expected = lab_truth(truth)
        # float32 in the file: 1e-7 of what is added up.
        np.testing.assert_allclose(about_lab(read)[:, k], expected, atol=1e-3)
        np.testing.assert_allclose(read.plate_origins_m[k], truth.corners.mean(axis=0), atol=1e-7)
    assert ("by the plate on the body" if by_plate else "on the plate") in read.provenance[2]


@pytest.mark.parametrize("processor", ["intel", "dec", "mips"])
@pytest.mark.parametrize("reals", [True, False])
def test_integers_and_processors(processor, reals, tmp_path):
    truth = plate()
    steps = {f"P1_{i}": 0.05 if i < 3 else 10.0 for i in range(6)}
    file = on_plates([truth], processor=processor, reals=reals, analog_steps=steps)
    read = read_marker_c3d(save(tmp_path, file))
    off = np.abs(about_lab(read)[:, 0] - lab_truth(truth)).max(axis=0)
    # Half a step of .05 N and of .01 N m, and the force's at the lever of the plate's place.
    assert (off[:3] <= (1e-3 if reals else 0.08)).all()
    assert (off[3:] <= (1e-3 if reals else 0.1)).all()


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_a_lab_whose_y_points_up(kind, tmp_path):
    axes = ("x", "-z", "y")
    truth = plate(up=Y, centre=(0.5, 0.01, 0.4))
    matrix = MATRIX if kind == 4 else None
    file = save(tmp_path, on_plates([truth], kind, up=Y, matrix=matrix))
    read = read_marker_c3d(file, axes=axes)
    expected = lab_truth(truth, lab_rotation(axes))
    np.testing.assert_allclose(about_lab(read)[:, 0], expected, atol=1e-3)
    assert read.wrenches[:, 0, 2].min() > 300


def test_axes_that_the_plates_contradict(tmp_path):
    file = save(tmp_path, on_plates([plate(up=Y, centre=(0.5, 0.01, 0.4))], up=Y))
    # Of such a file the load's direction in z says nothing, so that it must not be judged first.
    with pytest.raises(InputError, match=r"y axis is vertical.*x,-z,y"):
        read_marker_c3d(file)
    below = on_plates([plate()], by_plate=True)
    below.points = below.points * [1, 1, -1]
    with pytest.raises(InputError, match=r"markers lie below .*x,-y,-z"):
        read_marker_c3d(save(tmp_path, below))
    stated = read_marker_c3d(save(tmp_path, below), axes=("x", "y", "z"))
    assert stated.wrenches is not None
    assert any("against the stated axes" in s for s in stated.provenance)


@pytest.mark.parametrize(
    ("unit", "newton_metres"),
    [("Nm", 1.0), ("N.m", 1.0), ("Nmm", 1e-3), ("N*mm", 1e-3), ("ntmm", 1e-3), ("Ncm", 1e-2),
     ("lbf-in", 4.4482216152605 * 0.0254), ("kNm", 1e3), ("V", None), ("", None), ("mm", None)],
)  # fmt: skip
def test_units_of_moments(unit, newton_metres):
    assert moment_unit(unit) == (None if newton_metres is None else pytest.approx(newton_metres))
    assert force_unit("kgf") == 9.80665


def test_the_channels_own_units(tmp_path):
    truth = plate()
    file = on_plates([truth])
    units = [*3 * ["kN"], *3 * ["N.m"]]
    file.units = {f"P1_{i}": unit for i, unit in enumerate(units)}
    for i in range(6):
        # N and N mm in the builder.
        file.analog[f"P1_{i}"] = file.analog[f"P1_{i}"] / 1000
    read = read_marker_c3d(save(tmp_path, file))
    np.testing.assert_allclose(about_lab(read)[:, 0], lab_truth(truth), atol=1e-3)


@pytest.mark.parametrize("kind", [2, 3, 4])
def test_an_origin_with_the_other_sign(kind, tmp_path):
    matrix = MATRIX if kind == 4 else None
    right, wrong = (on_plates([plate()], kind, matrix=matrix) for _ in range(2))
    origin = wrong.groups["FORCE_PLATFORM"]["ORIGIN"]
    wrong.groups["FORCE_PLATFORM"]["ORIGIN"] = origin * (-1 if kind != 3 else [1, 1, -1])
    read = [read_marker_c3d(save(tmp_path, f)).wrenches for f in (right, wrong)]
    np.testing.assert_array_equal(*read)


def test_an_origin_beside_the_plate_with_the_other_sign(tmp_path):
    # A treadmill whose two belts share one place of the sensors, level with the surface.
    truth = replace(plate(), to_surface=np.array([0.236, 0.813, 0.0]))
    file = on_plates([truth])
    right = read_marker_c3d(save(tmp_path, file))
    group = file.groups["FORCE_PLATFORM"]
    group["ORIGIN"] = -group["ORIGIN"]
    turned = read_marker_c3d(save(tmp_path, file))
    np.testing.assert_array_equal(turned.wrenches, right.wrenches)
    np.testing.assert_allclose(about_lab(turned)[:, 0], lab_truth(truth), atol=1e-3)
    assert any("ORIGIN taken with the other sign" in s for s in turned.provenance)


def test_a_plate_whose_z_points_up(tmp_path):
    # Corners the other way round: the plate's z axis points up, and its sensors lie below it.
    truth = plate()
    turned = PlateTruth(
        truth.corners[[1, 0, 3, 2]], truth.force, truth.place, -truth.free, np.array([0, 0, 0.04])
    )
    read = read_marker_c3d(save(tmp_path, on_plates([turned])))
    np.testing.assert_allclose(about_lab(read)[:, 0], lab_truth(turned), atol=1e-3)
    np.testing.assert_allclose(lab_truth(turned), lab_truth(truth), atol=1e-9)


def test_a_matrix_by_rows(tmp_path):
    file = on_plates([plate()], 4, matrix=MATRIX)
    by_column = read_marker_c3d(save(tmp_path, file)).wrenches
    group = file.groups["FORCE_PLATFORM"]
    group["CAL_MATRIX"] = group["CAL_MATRIX"].transpose(0, 2, 1)
    group["MATRIX_STORE"] = ["BYROW"]
    np.testing.assert_array_equal(read_marker_c3d(save(tmp_path, file)).wrenches, by_column)


# ---- against another reader ----------------------------------------------------------------------


@pytest.mark.parametrize("kind", [2, 3, 4])
@pytest.mark.parametrize("processor", ["intel", "dec"])
def test_as_ezc3d_computes_them(kind, processor, tmp_path):
    ezc3d = pytest.importorskip("ezc3d")
    matrix = MATRIX if kind == 4 else None
    capture = on_plates([plate(), plate(centre=(1.2, 0.4, 0))], kind, matrix=matrix)
    capture.processor = processor
    if matrix is None:
        # It insists on one of all types but 2.
        capture.groups["FORCE_PLATFORM"]["CAL_MATRIX"] = np.zeros((2, 6, 6))
    file = save(tmp_path, capture)
    theirs = ezc3d.c3d(str(file), extract_forceplat_data=True)["data"]["platform"]
    read = read_c3d(file)
    for own, other in zip(plates_of(read, 1e-3), theirs, strict=True):
        wrench = local_wrench(read, own, 1e-3, own.turn.T @ Z)
        force, moment = (wrench.reshape(-1, 2, 3) @ own.turn.T).transpose(1, 0, 2)
        np.testing.assert_allclose(force, other["force"].T, atol=1e-9)
        np.testing.assert_allclose(moment, other["moment"].T / 1000, atol=1e-9)


# ---- whose force, and the zero -------------------------------------------------------------------


def test_each_plate_by_its_own_load(tmp_path):
    one, two = plate(), plate(centre=(-0.5, 0, 0), seed=3)
    file = on_plates([one, two])
    for i in range(6):
        file.analog[f"P2_{i}"] = -file.analog[f"P2_{i}"]
    read = read_marker_c3d(save(tmp_path, file))
    np.testing.assert_allclose(about_lab(read)[:, 1], lab_truth(two), atol=1e-3)
    assert "of plate 1 on the plate, which was turned; 2 by the plate" in read.provenance[2]


def test_a_plate_without_load_is_as_the_others(tmp_path):
    one = plate()
    idle = plate(centre=(-0.5, 0, 0), seed=3)
    idle = PlateTruth(idle.corners, 0.01 * idle.force, idle.place, 0 * idle.free)
    for by_plate in (True, False):
        file = on_plates([one, idle], by_plate=by_plate)
        read = read_marker_c3d(save(tmp_path, file))
        np.testing.assert_allclose(about_lab(read)[:, 1], lab_truth(idle), atol=1e-3)


def test_whose_force_can_be_stated(tmp_path):
    file = save(tmp_path, on_plates([plate()]))
    shown = read_marker_c3d(file)
    stated = read_marker_c3d(file, force_by="limb")
    np.testing.assert_array_equal(stated.wrenches, shown.wrenches)
    against = open_recording(file, ReadOptions(force_by="device"))
    np.testing.assert_array_equal(against.wrenches, -shown.wrenches)
    assert "the load of plate 1 says the opposite" in against.provenance[2]


def test_a_load_that_points_up_and_down_is_left_out(tmp_path):
    truth = plate()
    half = np.where(np.arange(SAMPLES) < SAMPLES // 2, 1.0, -1.0)[:, None]
    pulled = PlateTruth(truth.corners, half * truth.force, truth.place, truth.free)
    file = save(tmp_path, on_plates([pulled]))
    read = read_marker_c3d(file)
    assert read.wrenches is None
    assert "its load points up and down" in left_out(read)
    assert read_marker_c3d(file, force_by="limb").wrenches is not None


def stepped_on(samples=40) -> PlateTruth:
    truth = plate(samples=samples)
    bears = (np.arange(samples) >= 15).astype(float)
    return PlateTruth(truth.corners, bears[:, None] * truth.force, truth.place, bears * truth.free)


def test_the_zero_of_an_empty_plate_is_taken_off(tmp_path):
    truth = stepped_on()
    file = on_plates([truth], zero=(0, 10))
    for i, offset in enumerate([3.0, -5.0, 25.0, 400.0, 300.0, -200.0]):
        file.analog[f"P1_{i}"] = file.analog[f"P1_{i}"] + offset
    read = read_marker_c3d(save(tmp_path, file))
    np.testing.assert_allclose(about_lab(read)[:, 0], lab_truth(truth), atol=1e-3)
    assert any("26 N taken off" in s for s in read.provenance)


@pytest.mark.parametrize("zero", [(16, 25), (1, 0), (0, 0), (30, 90)])
def test_no_zero_where_the_plate_is_loaded_or_none_is_named(zero, tmp_path):
    truth = stepped_on()
    read = read_marker_c3d(save(tmp_path, on_plates([truth], zero=zero)))
    np.testing.assert_allclose(about_lab(read)[:, 0], lab_truth(truth), atol=1e-3)
    told = any("no zero taken off" in s for s in read.provenance)
    assert told == (zero[1] > 10)


def test_zeros_frames_are_counted_from_the_recordings_first(tmp_path):
    file = on_plates([stepped_on()], zero=(1, 10), first_frame=101)
    read = read_marker_c3d(save(tmp_path, file))
    assert any("frames 1 to 10 are not in the file" in s for s in read.provenance)


# ---- the markers' rate ---------------------------------------------------------------------------


def swaying(rate: float, seconds: float, f_hz: float, hum_n: float = 0.0) -> PlateTruth:
    t = np.arange(round(rate * seconds)) / rate
    base = plate(samples=len(t))
    force = np.outer(700 + 100 * np.sin(2 * np.pi * f_hz * t), Z)
    force += hum_n * np.outer(np.sin(2 * np.pi * 290 * t), Z)
    place = np.tile(base.corners.mean(axis=0), (len(t), 1))
    return PlateTruth(base.corners, force, place, np.zeros(len(t)))


def test_the_plates_come_at_the_markers_rate_without_delay(tmp_path):
    truth = swaying(1000, 2, 5.0, hum_n=40.0)
    read = read_marker_c3d(save(tmp_path, on_plates([truth], samples_per_frame=10)))
    t = np.arange(200) / 100
    force = read.wrenches[:, 0, 2]
    inner = slice(20, -20)
    # A delay of half a frame, as a mean of each frame has, would be off by 16 N; the hum is 40 N.
    expected = 700 + 100 * np.sin(2 * np.pi * 5 * t)
    assert np.abs(force - expected)[inner].max() < 0.6
    assert np.abs(force - expected).max() < 25


def test_a_steady_load_stays_to_the_last_sample(tmp_path):
    truth = swaying(1000, 0.3, 0.0)
    read = read_marker_c3d(save(tmp_path, on_plates([truth], samples_per_frame=10)))
    np.testing.assert_allclose(read.wrenches[:, 0, 2], 700, rtol=1e-6)


# ---- what is left out, and damage ----------------------------------------------------------------


def changed(**values: object):
    file = on_plates([plate(), plate(centre=(-0.5, 0.1, 0), seed=4)], 4, matrix=MATRIX)
    file.groups["FORCE_PLATFORM"] |= values
    return file


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ({"TYPE": whole(2, 5)}, "force plate 2: type 5 (Kistler"),
        ({"TYPE": whole(2, 6)}, "type 6 (twelve channels)"),
        ({"TYPE": whole(7, 2)}, "force plate 1: type 7"),
        ({"TYPE": whole(2, 21)}, "type 21 (AMTI stairs)"),
        ({"TYPE": whole(2, 99)}, "type 99"),
        ({"TYPE": whole(2)}, "no TYPE"),
        ({"CORNERS": real(*range(12))}, "CORNERS"),
        ({"CORNERS": np.zeros((2, 4, 3))}, "CORNERS are no plate"),
        ({"ORIGIN": real(1, 2)}, "ORIGIN is not complete"),
        ({"ORIGIN": real(*[np.nan] * 6)}, "ORIGIN is not complete"),
        ({"CHANNEL": whole(1, 2, 3, 4, 5, 6)}, "CHANNEL is not complete"),
        ({"CHANNEL": np.arange(2, 14).reshape(2, 6)}, "channel 13"),
        ({"CHANNEL": np.zeros((2, 6), np.int64)}, "channel 0"),
        ({"CAL_MATRIX": real(*range(36))}, "CAL_MATRIX"),
        ({"CAL_MATRIX": np.zeros((2, 6, 6))}, "CAL_MATRIX is singular"),
        ({"USED": whole(5000)}, "5000 force plates"),
    ],
)
def test_plates_that_cannot_be_read_are_named(values, why, tmp_path):
    read = read_marker_c3d(save(tmp_path, changed(**values)))
    # One plate that is missing would mislead: none is taken.
    assert read.wrenches is None
    assert read.plate_origins_m is None
    assert why in left_out(read)
    assert "force plate 1" in left_out(read)
    assert read.names == ("hip", "head")


def test_a_load_beside_the_plate_says_that_a_unit_is_wrong(tmp_path):
    file = on_plates([plate()])
    file.units = {f"P1_{i}": "Nm" for i in (3, 4, 5)}
    read = read_marker_c3d(save(tmp_path, file))
    assert read.wrenches is None
    assert "of its load presses beside it" in left_out(read)


def test_values_that_no_plate_shows(tmp_path):
    for value, why in ((np.nan, "not finite"), (1e30, "a force of 1e+30 N"), (np.inf, "finite")):
        file = on_plates([plate()])
        file.analog["P1_2"][4] = value
        assert why in left_out(read_marker_c3d(save(tmp_path, file)))


def test_a_form_that_was_never_filled_in(tmp_path):
    one, two = plate(), plate(centre=(-0.5, 0, 0))
    file = on_plates([one, replace(two, force=0.01 * two.force, free=0 * two.free)])
    file.groups["FORCE_PLATFORM"]["CORNERS"][1] = 0
    read = read_marker_c3d(save(tmp_path, file))
    assert read.wrenches.shape[1] == 1
    assert "force plate 2 (it bears nothing" in left_out(read)
    file.analog["P2_2"][3] = -25.0
    read = read_marker_c3d(save(tmp_path, file))
    assert read.wrenches is None


def test_trials_have_the_same_plates(tmp_path):
    files = [save(tmp_path, on_plates([plate(seed=s)]), f"{s}.c3d") for s in (1, 2)]
    both = read_marker_c3d(files)
    assert both.wrenches.shape == (2 * SAMPLES, 1, 6)
    moved = save(tmp_path, on_plates([plate(centre=(0.6, 0.4, 0.01))]), "moved.c3d")
    with pytest.raises(InputError, match="force plates in other places"):
        read_marker_c3d([files[0], moved])
    without = on_plates([plate()])
    without.groups["FORCE_PLATFORM"]["USED"] = whole(0)
    with pytest.raises(InputError, match=r"other force plates .*\(0, not 1\)"):
        read_marker_c3d([files[0], save(tmp_path, without, "none.c3d")])


def test_to_a_folder_and_back(tmp_path):
    file = on_plates([plate(samples=60)], samples_per_frame=2)
    file.analog["biceps"] = np.linspace(-1e-3, 1e-3, 60)
    file.header_events = (("GO", 0.05),)
    read = read_marker_c3d(save(tmp_path, file), emg_channels={"biceps": "biceps_long"})
    write_recording(read, tmp_path / "folder")
    back = open_recording(tmp_path / "folder")
    np.testing.assert_array_equal(back.wrenches, read.wrenches)
    np.testing.assert_array_equal(back.plate_origins_m, read.plate_origins_m)
    np.testing.assert_array_equal(back.positions, read.positions)
    np.testing.assert_array_equal(back.emg.signals, read.emg.signals)
    assert back.trials["event_GO_s"].tolist() == [0.05]
    assert back.provenance == read.provenance
    # The centre of pressure is where the body pressed.
    w = about_lab(back)[:, 0]
    np.testing.assert_allclose(w[:, 2].min(), read.wrenches[:, 0, 2].min())


def damaged(rng: np.random.Generator, sound: bytes) -> bytes:
    """A file with a few bytes changed, cut off, put in or taken out, most in its parameters."""
    data, end = bytearray(sound), 512 * (1 + sound[514])
    kind = rng.integers(6)
    if kind == 0:
        for _ in range(rng.integers(1, 4)):
            data[rng.integers(24)] = rng.integers(256)
    elif kind == 1:
        for _ in range(rng.integers(1, 8)):
            data[rng.integers(512, end)] = rng.choice([0, 1, 127, 128, 255, rng.integers(256)])
    elif kind == 2:
        del data[rng.integers(len(data)) :]
    elif kind == 3:
        at = rng.integers(512, end)
        data[at:at] = rng.bytes(int(rng.integers(1, 600)))
    elif kind == 4:
        at = rng.integers(512, end)
        del data[at : at + rng.integers(1, 40)]
    else:
        for _ in range(rng.integers(1, 20)):
            data[rng.integers(len(data))] ^= 1 << rng.integers(8)
    return bytes(data)


@pytest.mark.study
@pytest.mark.filterwarnings("error")
def test_damage_is_one_error_and_nothing_else(tmp_path):
    rng, sound, file = np.random.default_rng(12), bench.valid_file(), tmp_path / "a.c3d"
    messages = []
    for _ in range(800):
        file.write_bytes(damaged(rng, sound))
        try:
            read = read_marker_c3d(file)
        except InputError as error:
            messages.append(str(error))
        else:
            assert len(read.positions) == len(read.time_s)
    assert 150 < len(messages) < 800
    assert all(len(message.splitlines()) == 1 for message in messages)


@pytest.mark.parametrize(("kind", "processor"), [(2, "dec"), (3, "mips"), (4, "intel")])
def test_a_simulated_body_through_a_file(kind, processor, squat, tmp_path):
    edges = (np.array([0.0, 1.0, 0.0]), Z, 0.78, 1.2)
    truths = []
    for k, origin in enumerate(squat.plate_origins_m):
        force, moment = squat.wrenches[:, k, :3], squat.wrenches[:, k, 3:]
        place = np.column_stack([-moment[:, 1], moment[:, 0], 0 * force[:, 2]]) / force[:, 2:]
        free = moment[:, 2] - np.cross(place, force)[:, 2]
        truths.append(PlateTruth(corners(origin, *edges), force, origin + place, free))
    file = on_plates(truths, kind, processor=processor, matrix=MATRIX if kind == 4 else None)
    file.points, file.labels = squat.positions * 1000, list(squat.names)
    unseen = np.isnan(squat.positions[..., 0])
    file.points[unseen], file.lost = 0, tuple(map(tuple, np.argwhere(unseen).tolist()))
    read = read_marker_c3d(save(tmp_path, file))
    np.testing.assert_allclose(read.wrenches, squat.wrenches, atol=1e-3)
    np.testing.assert_allclose(read.positions, squat.positions, atol=1e-6)
    assert read.names == squat.names
    np.testing.assert_allclose(read.plate_origins_m, squat.plate_origins_m, atol=1e-9)


@pytest.fixture(scope="module")
def squat():
    """A body that squats on two plates, filmed, its first second."""
    whole_film, _ = simulate_body(["squat"], seed=3, markers=True)
    at = slice(0, 100)
    return SimpleNamespace(
        wrenches=whole_film.wrenches[at],
        positions=whole_film.positions[at],
        names=whole_film.names,
        plate_origins_m=whole_film.plate_origins_m,
    )
