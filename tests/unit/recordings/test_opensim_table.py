"""OpenSim's tables with either header, and joint motion from them."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.arm.skeletons import elbow_skeleton
from armimpedance.errors import InputError
from armimpedance.recordings.motion.opensim_table import opensim_motion, read_opensim_table
from armimpedance.recordings.opening import open_recording
from armimpedance.recordings.reading import ReadOptions

TIME = np.arange(8) / 50.0
ELBOW_DEG = 60 + 20 * np.sin(TIME * 9)
SHOULDER_DEG = 10 * np.cos(TIME * 7)
SKELETON = elbow_skeleton(70.0, 1.75)
NEW = "arm\nversion=1\nnRows=8\nnColumns=3\ninDegrees={}\nendheader\n"
IN_DEGREES = NEW.format("yes")
OLD = "name arm.mot\ndatacolumns 3\ndatarows 8\nrange 0 0.14\nendheader\n"


def content(header=IN_DEGREES, separator="\t", lead="", scale=1.0, cell=None):
    lines = [separator.join(["time", "elbow_flexion", "arm_flex"])]
    for row in zip(TIME, ELBOW_DEG * scale, SHOULDER_DEG * scale, strict=True):
        lines.append(lead + separator.join(repr(float(v)) for v in row))
    if cell:
        lines[3] = lines[3].replace(lines[3].split(separator)[cell[0]], cell[1])
    return header + "\n".join(lines) + "\n"


def write(tmp_path, text, name="arm.mot"):
    (tmp_path / name).write_text(text)
    return tmp_path / name


@pytest.mark.parametrize(
    "form",
    [
        {},
        {"header": OLD},
        {"separator": ","},
        {"separator": "  ", "lead": "   "},
        {"lead": "      "},
        {"lead": "\t"},
        {"header": NEW.format("yes").replace("endheader", "EndHeader")},
        {"header": NEW.format("yes") + "\n"},
    ],
)
def test_either_header_and_any_separator(form, tmp_path):
    table = read_opensim_table(write(tmp_path, content(**form)))
    np.testing.assert_array_equal(table.time_s, TIME)
    np.testing.assert_array_equal(table.columns["elbow_flexion"], ELBOW_DEG)
    assert table.sample_rate_hz == 50.0
    assert table.in_degrees is (None if form.get("header") == OLD else True)


def test_degrees_become_radians(tmp_path):
    degrees = read_opensim_table(write(tmp_path, content()))
    radians = content(NEW.format("no"), scale=np.pi / 180)
    same = read_opensim_table(write(tmp_path, radians, "b.sto"))
    names = ("arm_flex", "elbow_flexion")
    np.testing.assert_allclose(degrees.angles(names), same.angles(names), rtol=1e-14)
    np.testing.assert_allclose(degrees.angles(names)[:, 1], np.deg2rad(ELBOW_DEG), rtol=1e-14)


def test_a_file_that_does_not_say_is_asked_about(tmp_path):
    table = read_opensim_table(write(tmp_path, content(OLD)))
    with pytest.raises(InputError, match="says no unit"):
        table.angles(("elbow_flexion",))
    angles = table.angles(("elbow_flexion",), in_degrees=True)
    np.testing.assert_allclose(angles[:, 0], np.deg2rad(ELBOW_DEG), rtol=1e-14)


def test_degrees_called_radians(tmp_path):
    table = read_opensim_table(write(tmp_path, content(NEW.format("no"))))
    with pytest.raises(InputError, match="looks like degrees"):
        table.angles(("elbow_flexion",))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "is empty"),
        ("time\ta\n0\t1\n", "no line 'endheader'"),
        (NEW.format("yes"), "no columns after endheader"),
        (content().replace("time\t", "t\t"), "the first column is 't'"),
        (content().replace("arm_flex", "elbow_flexion"), "stands twice"),
        (content(NEW.format("maybe")), "inDegrees=maybe"),
        (content(NEW.format("yes").replace("8", "9")), "8 rows"),
        (content(OLD.replace("datacolumns 3", "datacolumns 4")), "3 columns"),
        (content(cell=(1, "x")), "row 10: not a finite number: 'x'"),
        (content(cell=(1, "nan")), "not a finite number: 'nan'"),
        (content(cell=(0, "0.01")), "time does not rise"),
        (content(cell=(1, "1\t2")), "row 10: 4 cells"),
    ],
)
def test_one_line_for_whatever_is_wrong(text, told, tmp_path):
    with pytest.raises(InputError, match=told) as error:
        read_opensim_table(write(tmp_path, text))
    assert "arm.mot" in str(error.value)
    assert "\n" not in str(error.value)


def test_joint_motion_by_names(tmp_path):
    names = {"right_elbow_flexion": "elbow_flexion", "right_shoulder_flexion": "-arm_flex"}
    motion = opensim_motion(write(tmp_path, content()), SKELETON, names)
    q = motion.coordinates
    np.testing.assert_allclose(q[:, 9], np.deg2rad(ELBOW_DEG), rtol=1e-14)
    np.testing.assert_allclose(q[:, 6], -np.deg2rad(SHOULDER_DEG), rtol=1e-14)
    assert not q[:, [0, 1, 2, 3, 4, 5, 7, 8]].any()
    assert "right_shoulder_rotation" in motion.provenance[-1]


def test_what_joint_motion_needs(tmp_path):
    file = write(tmp_path, content())
    with pytest.raises(InputError, match="none of the skeleton's angles"):
        opensim_motion(file, SKELETON)
    with pytest.raises(InputError, match="no coordinate 'elbow'"):
        opensim_motion(file, SKELETON, {"elbow": "elbow_flexion"})
    with pytest.raises(InputError, match="column elbow: no such column"):
        opensim_motion(file, SKELETON, {"right_elbow_flexion": "elbow"})
    with pytest.raises(InputError, match="expected a skeleton"):
        open_recording(file)
    options = ReadOptions(skeleton=SKELETON, angles={"right_elbow_flexion": "elbow_flexion"})
    assert open_recording(file, options).coordinates[0, 9] > 1.0
