"""Motion-capture C3D files, written byte by byte."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.recordings.motion.marker_c3d import read_marker_c3d
from armimpedance.recordings.opening import open_recording
from armimpedance.recordings.reading import ReadOptions

RNG = np.random.default_rng(4)
POINTS_MM = RNG.uniform(-900, 900, (6, 3, 3)).astype(np.float32)
EMG = (RNG.normal(size=(12, 2)) * 1e-3).astype(np.float32)


def write(c3d, file, *, labels=("S:hand", "S:elbow", "S:hip"), unit="mm", scale=-0.01,
          points=POINTS_MM, lost=(), emg_unit="V", rate=100.0, upright=None):  # fmt: skip
    """A file of three points and two channels at twice the rate; `lost`: (frame, point)."""
    point = {"LABELS": c3d.texts(*labels), "SCALE": c3d.floats(scale, sizes=())}
    if unit:
        point["UNITS"] = c3d.texts(unit)
    if upright is not None:
        point |= {"X_SCREEN": c3d.texts("+X"), "Y_SCREEN": c3d.texts(upright)}
    analog = {"LABELS": c3d.texts("Biceps.EMG4", "Sync"), "UNITS": c3d.texts(emg_unit, "V")}
    raw = points if scale < 0 else np.round(points / scale)
    data = bytearray(
        c3d.write(
            raw, EMG if scale < 0 else np.zeros_like(EMG), {"POINT": point, "ANALOG": analog},
            rate=rate, scale=scale, samples_per_frame=2,
        )
    )  # fmt: skip
    start = (struct.unpack_from("<H", data, 16)[0] - 1) * 512
    form, size = ("<f", 4) if scale < 0 else ("<h", 2)
    for frame, marker in lost:
        struct.pack_into(form, data, start + size * (frame * 16 + 4 * marker + 3), -1)
    file.write_bytes(bytes(data))
    return file


def test_millimetres_and_lost_points(c3d, tmp_path):
    file = write(c3d, tmp_path / "walk.c3d", lost=[(2, 1), (5, 0)])
    markers = read_marker_c3d(file)
    assert markers.names == ("hand", "elbow", "hip")
    lost = np.isnan(markers.positions[..., 0])
    assert np.argwhere(lost).tolist() == [[2, 1], [5, 0]]
    expected = POINTS_MM.astype(float) / 1000
    np.testing.assert_allclose(markers.positions[~lost], expected[~lost], rtol=1e-15)
    assert markers.sample_rate_hz == 100.0
    assert markers.trials["condition"].tolist() == ["walk"]
    np.testing.assert_allclose(np.diff(markers.time_s), 0.01, rtol=1e-12)


@pytest.mark.parametrize(
    ("upright", "height"), [("+Z", 2), ("Z", 2), ("+Y", 1), ("y", 1), ("+X", 0), ("-Y", 2), ("", 2)]
)
def test_the_axis_that_the_file_shows_upright_points_up(upright, height, c3d, tmp_path):
    file = write(c3d, tmp_path / "walk.c3d", upright=upright)
    places = POINTS_MM.astype(float) / 1000
    np.testing.assert_allclose(read_marker_c3d(file).positions[..., 2], places[..., height])
    # what the user says stands above it
    stated = read_marker_c3d(file, axes=("x", "y", "z"))
    np.testing.assert_allclose(stated.positions, places)


def test_scaled_integers(c3d, tmp_path):
    file = write(c3d, tmp_path / "a.c3d", scale=0.1, lost=[(1, 2)])
    positions = read_marker_c3d(file).positions
    assert np.argwhere(np.isnan(positions[..., 0])).tolist() == [[1, 2]]
    seen = ~np.isnan(positions)
    # half a step of 0.1 mm
    assert np.abs(positions - POINTS_MM / 1000.0)[seen].max() < 0.051e-3


@pytest.mark.parametrize(
    ("unit", "metres"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254)]
)
def test_units(unit, metres, c3d, tmp_path):
    points = (POINTS_MM / 1000 / metres).astype(np.float32)
    markers = read_marker_c3d(write(c3d, tmp_path / "a.c3d", unit=unit, points=points))
    np.testing.assert_allclose(markers.positions, POINTS_MM / 1000, rtol=1e-6)


def test_a_point_in_the_origin_was_not_seen(c3d, tmp_path):
    points = POINTS_MM.copy()
    points[3, 1] = 0
    markers = read_marker_c3d(write(c3d, tmp_path / "a.c3d", points=points))
    assert np.argwhere(np.isnan(markers.positions[..., 0])).tolist() == [[3, 1]]


def test_axes(c3d, tmp_path):
    file = write(c3d, tmp_path / "a.c3d")
    turned = read_marker_c3d(file, axes=("x", "-z", "y")).positions
    x, y, z = np.moveaxis(POINTS_MM / 1000.0, 2, 0)
    np.testing.assert_allclose(turned, np.stack([x, -z, y], axis=2), rtol=1e-6)
    for axes in (("x", "z", "y"), ("x", "x", "y"), ("x", "y"), ("a", "b", "c")):
        with pytest.raises(InputError, match="axes"):
            read_marker_c3d(file, axes=axes)


def test_emg_by_name(c3d, tmp_path):
    file = write(c3d, tmp_path / "a.c3d")
    emg = read_marker_c3d(file, emg_channels={"Biceps.EMG4": "biceps"}).emg
    np.testing.assert_array_equal(emg.signals[:, 0], EMG[:, 0].astype(float))
    assert (emg.sample_rate_hz, emg.muscles, emg.unit) == (200.0, ("biceps",), "V")
    assert read_marker_c3d(file).emg is None
    milli = write(c3d, tmp_path / "b.c3d", emg_unit="mV")
    scaled = read_marker_c3d(milli, emg_channels={"Biceps.EMG4": "biceps"}).emg
    np.testing.assert_allclose(scaled.signals, emg.signals / 1000, rtol=1e-12)
    with pytest.raises(InputError, match=r"no channel 'Triceps' .*Biceps\.EMG4"):
        read_marker_c3d(file, emg_channels={"Triceps": "triceps"})
    odd = write(c3d, tmp_path / "c.c3d", emg_unit="N")
    with pytest.raises(InputError, match="is in 'N'"):
        read_marker_c3d(odd, emg_channels={"Biceps.EMG4": "biceps"})


def test_prefixes_and_unnamed_points(c3d, tmp_path):
    file = write(c3d, tmp_path / "a.c3d", labels=("S:hand", "box:corner", "*12"))
    assert read_marker_c3d(file, prefix="S").names == ("hand",)
    assert read_marker_c3d(file).names == ("S:hand", "box:corner")
    assert "1 points without a name" in read_marker_c3d(file).provenance[-1]
    with pytest.raises(InputError, match=r"no marker of 'T' \(expected one of S, box\)"):
        read_marker_c3d(file, prefix="T")
    twice = write(c3d, tmp_path / "b.c3d", labels=("S:hand", "S:hand", "S:hip"))
    numbered = read_marker_c3d(twice)
    assert numbered.names == ("hand", "hand~2", "hip")
    assert any("hand~2" in step for step in numbered.provenance)


def test_several_files_are_trials(c3d, tmp_path):
    files = [write(c3d, tmp_path / f"{name}.c3d") for name in ("swing", "release")]
    markers = read_marker_c3d(files, emg_channels={"Sync": "sync"})
    assert markers.trials["condition"].tolist() == ["swing", "release"]
    assert markers.offsets.tolist() == [0, 6, 12]
    assert markers.emg.offsets.tolist() == [0, 12, 24]
    assert markers.time_s[6] == 0
    other = write(c3d, tmp_path / "other.c3d", labels=("S:hand", "S:elbow", "S:knee"))
    with pytest.raises(InputError, match=r"other\.c3d: other markers .*hip, knee"):
        read_marker_c3d([files[0], other])
    faster = write(c3d, tmp_path / "faster.c3d", rate=120.0)
    with pytest.raises(InputError, match="120 frames/s"):
        read_marker_c3d([files[0], faster])


@pytest.mark.parametrize("unit", ["furlong", "deg"])
def test_unknown_units(unit, c3d, tmp_path):
    with pytest.raises(InputError, match="unit of length"):
        read_marker_c3d(write(c3d, tmp_path / "a.c3d", unit=unit))


def test_a_unit_that_is_not_true(c3d, tmp_path):
    with pytest.raises(InputError, match="m away in m"):
        read_marker_c3d(write(c3d, tmp_path / "a.c3d", unit="m"))


def test_one_door(c3d, tmp_path):
    file = write(c3d, tmp_path / "a.c3d")
    opened = open_recording(file, ReadOptions(axes=("x", "-z", "y"), prefix="S"))
    np.testing.assert_array_equal(
        opened.positions, read_marker_c3d(file, axes=("x", "-z", "y")).positions
    )
    with pytest.raises(InputError, match="no file"):
        read_marker_c3d([])
