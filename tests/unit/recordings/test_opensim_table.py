"""OpenSim's tables with either header, and joint motion from them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armimpedance.core.errors import InputError
from armimpedance.limb.arm.skeletons import elbow_skeleton
from armimpedance.recordings.motion.opensim_tables import opensim_motion, read_opensim_table
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
        (content(NEW.format("maybe")), "inDegrees=maybe"),
        (content(cell=(1, "inf")), "row 10: not a finite number: 'inf'"),
        (content(cell=(1, "1,5")), "row 10: not a finite number: '1,5'"),
        (content(cell=(1, "1_5")), "row 10: not a finite number: '1_5'"),
        (content("DataType=Mat33\n" + IN_DEGREES), "DataType=Mat33"),
        (content().replace("0.02\t", "0.0\t"), "row 9: time does not rise: it stands still at 0 s"),
        (content(cell=(1, "x")), "row 10: not a finite number: 'x'"),
        (content(cell=(0, "0.01")), "time does not rise"),
        (content(cell=(1, "1\t2")), "row 10: 4 cells"),
    ],
)
def test_one_line_for_whatever_is_wrong(text, told, tmp_path):
    with pytest.raises(InputError, match=told) as error:
        read_opensim_table(write(tmp_path, text))
    assert "arm.mot" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: text.replace("time\t", "Time\t"),
        lambda text: "\n".join(line + "\t\t" for line in text.split("\n")),
        lambda text: text.replace("\t", ",").replace("\n", ",,,\n"),
        lambda text: text.replace("endheader", '"endheader"').replace("time", '"time"'),
        lambda text: text.replace("inDegrees=yes", "Angles are in degrees."),
        lambda text: text.replace("nRows=8", "nRows 8").replace("nColumns=3", "nColumns  3"),
        lambda text: text.replace("version=1", "DataType=double\nversion=3\nOpenSimVersion=4.5"),
        lambda text: text.replace("time\t", "time\t   "),
        lambda text: text + "\n\t\t\n\n",
        lambda text: text[:-1],
        lambda text: "\ufeff" + text,
    ],
)
def test_headers_and_lines_as_programs_write_them(change, tmp_path):
    file = tmp_path / "arm.mot"
    file.write_bytes(change(content()).encode())
    table = read_opensim_table(file)
    np.testing.assert_array_equal(table.columns["elbow_flexion"], ELBOW_DEG)
    np.testing.assert_array_equal(table.time_s, TIME)
    assert table.in_degrees is True
    assert table.remarks == ()


@pytest.mark.parametrize("encoding", ["utf-16", "cp1252"])
def test_letters_of_other_encodings(encoding, tmp_path):
    (tmp_path / "arm.mot").write_bytes(("Données\n" + content()).encode(encoding))
    table = read_opensim_table(tmp_path / "arm.mot")
    np.testing.assert_array_equal(table.columns["elbow_flexion"], ELBOW_DEG)
    assert table.remarks == (("Not UTF-8: read as Windows-1252.",) if encoding == "cp1252" else ())


@pytest.mark.parametrize(
    ("header", "told"),
    [
        (NEW.replace("8", "9"), "states 9 rows, it holds 8: cut or edited"),
        (NEW.replace("8", "7"), "states 7 rows, it holds 8."),
        (OLD.replace("datarows 8", "datarows 700"), "states 700 rows, it holds 8: cut or edited"),
        (OLD.replace("datacolumns 3", "datacolumns 4"), "states 4 columns, it holds 3: cut"),
    ],
)
def test_a_header_that_counts_otherwise_is_told(header, told, tmp_path):
    file = write(tmp_path, content(header.format("yes")))
    table = read_opensim_table(file)
    assert told in table.remarks[0]
    np.testing.assert_array_equal(table.time_s, TIME)
    names = {"right_elbow_flexion": "elbow_flexion"}
    motion = opensim_motion(file, SKELETON, names, in_degrees=True)
    assert any(told in sentence for sentence in motion.provenance)


@pytest.mark.parametrize("header", [IN_DEGREES, NEW.format("yes").replace("nRows=8\n", "")])
def test_a_file_cut_anywhere_among_its_rows_never_passes_in_silence(header, tmp_path):
    whole = content(header)
    first = whole.index("0.02\t")
    for end in range(first, len(whole) - 1):
        try:
            table = read_opensim_table(write(tmp_path, whole[:end]))
        except InputError:
            continue
        # a cut within the last number is not seen, nor, without a count of rows, in any row's last
        within = whole[whole.rindex("\n", 0, end) + 1 : end].count("\t") == 2
        counted = "nRows" in header and end < whole.rindex("\t")
        assert table.remarks or (not counted and (within or whole[end - 1] == "\n"))


def test_gaps_matter_only_where_they_are_used(tmp_path):
    file = write(tmp_path, content(cell=(1, "nan")))
    table = read_opensim_table(file)
    assert np.isnan(table.columns["elbow_flexion"]).sum() == 1
    with pytest.raises(InputError, match=r"elbow_flexion: not a finite number: 'nan' at 0\.04 s"):
        opensim_motion(file, SKELETON, {"right_elbow_flexion": "elbow_flexion"})
    motion = opensim_motion(file, SKELETON, {"right_shoulder_flexion": "arm_flex"})
    np.testing.assert_allclose(motion.coordinates[:, 6], np.deg2rad(SHOULDER_DEG), rtol=1e-14)
    assert "Not taken: elbow_flexion (no coordinate of the skeleton)." in motion.provenance


def test_columns_of_one_name(tmp_path):
    names = "time\tright_elbow_flexion\tright_elbow_flexion"
    file = write(tmp_path, content().replace("time\telbow_flexion\tarm_flex", names))
    assert read_opensim_table(file).columns == {}
    with pytest.raises(InputError, match="column right_elbow_flexion: appears twice"):
        opensim_motion(file, SKELETON)


def test_a_row_that_stands_there_twice_is_read_once(tmp_path):
    lines = content().splitlines(keepends=True)
    table = read_opensim_table(write(tmp_path, "".join([*lines, lines[-1]])))
    np.testing.assert_array_equal(table.time_s, TIME)
    assert any("read once: 1" in remark for remark in table.remarks)


def test_a_header_that_says_both_units_is_asked_about(tmp_path):
    both = "Angles are in degrees.\n" + NEW.format("no")
    table = read_opensim_table(write(tmp_path, content(both)))
    with pytest.raises(InputError, match="says no unit"):
        table.angles(("elbow_flexion",))
    assert table.angles(("elbow_flexion",), in_degrees=True).max() < 2
    assert "both degrees and radians" in table.remarks[0]


def test_cells_of_several_numbers(tmp_path):
    places = np.random.default_rng(3).normal(size=(8, 2, 3))
    head = "DataRate=50.0\nDataType=Vec3\nversion=3\nOpenSimVersion=4.5\nendheader\n"
    rows = [
        "\t".join([repr(t), *(",".join(map(repr, p)) for p in row)])
        for t, row in zip(TIME.tolist(), places.tolist(), strict=True)
    ]
    file = write(tmp_path, head + "\n".join(["time\thand\thip", *rows]) + "\n", "a.sto")
    table = read_opensim_table(file)
    assert list(table.columns) == [f"{n}_{i}" for n in ("hand", "hip") for i in (1, 2, 3)]
    np.testing.assert_array_equal(table.columns["hip_2"], places[:, 1, 1])
    uneven = write(tmp_path, file.read_text().replace(",", "\t", 1), "b.sto")
    with pytest.raises(InputError, match="row 7: .* cells"):
        read_opensim_table(uneven)


def test_plain_rows_and_others_are_read_alike(tmp_path):
    """A table of plain numbers is read at once, one with an odd cell row by row: the same bits."""
    values = np.random.default_rng(8).normal(size=(200, 2)) * 10.0 ** np.array([-9.0, 12.0])
    rows = [f"{i / 50!r}\t{a!r}\t{b!r}" for i, (a, b) in enumerate(values.tolist())]
    head = "a\nendheader\ntime\ta\tb\n"
    plain = read_opensim_table(write(tmp_path, head + "\n".join(rows) + "\n"))
    odd = read_opensim_table(write(tmp_path, head + "\n".join([*rows, "4.0\t1\tnan"]) + "\n"))
    for i, name in enumerate("ab"):
        np.testing.assert_array_equal(plain.columns[name], values[:, i])
        np.testing.assert_array_equal(odd.columns[name][:-1], values[:, i])
    assert np.isnan(odd.columns["b"][-1])


def test_states_are_known_by_their_paths(tmp_path):
    path = "/jointset/elbow/right_elbow_flexion/value"
    text = content().replace("elbow_flexion", path)
    motion = opensim_motion(write(tmp_path, text), SKELETON)
    np.testing.assert_allclose(motion.coordinates[:, 9], np.deg2rad(ELBOW_DEG), rtol=1e-14)


def test_joint_motion_by_names(tmp_path):
    names = {"right_elbow_flexion": "elbow_flexion", "right_shoulder_flexion": "-arm_flex"}
    motion = opensim_motion(write(tmp_path, content()), SKELETON, names)
    q = motion.coordinates
    np.testing.assert_allclose(q[:, 9], np.deg2rad(ELBOW_DEG), rtol=1e-14)
    np.testing.assert_allclose(q[:, 6], -np.deg2rad(SHOULDER_DEG), rtol=1e-14)
    assert not q[:, [0, 1, 2, 3, 4, 5, 7, 8]].any()
    assert "right_shoulder_rotation" in motion.provenance[-1]


def test_a_shoulder_turns_as_opensims_does(tmp_path):
    """Rajagopal 2016 in OpenSim 4.6: the humerus in the torso, in our axes, for two postures."""
    angles = [
        [0.191746362, -0.322298601, -0.642637066, 0.67686131],
        [0.438578335, 0.577857808, 0.149290086, 0.321295185],
    ]
    turned = [
        [[0.74967048, 0.63664722, -0.18076088], [-0.56845005, 0.75929933, 0.31674764],
         [0.33890812, -0.13470282, 0.93112643]],
        [[0.86078533, -0.36403755, -0.35570391], [0.12458656, 0.82831762, -0.54623082],
         [0.49348434, 0.42587155, 0.75835785]],
    ]  # fmt: skip
    header = "reach\nnRows=2\nnColumns=5\ninDegrees=no\nendheader\n"
    names = "time\tarm_flex_r\tarm_add_r\tarm_rot_r\telbow_flex_r\n"
    rows = [f"{i}\t" + "\t".join(map(repr, row)) for i, row in enumerate(angles)]
    motion = opensim_motion(
        write(tmp_path, header + names + "\n".join(rows) + "\n"),
        SKELETON,
        {
            "right_shoulder_flexion": "arm_flex_r",
            "right_shoulder_abduction": "-arm_add_r",
            "right_shoulder_rotation": "arm_rot_r",
            "right_elbow_flexion": "elbow_flex_r",
        },
    )
    segments = {segment.name: segment for segment in SKELETON.segments}
    hinges = segments["right_upper_arm"].hinges
    columns = [SKELETON.coordinate(hinge.name) for hinge in hinges]
    for q, expected in zip(motion.coordinates[:, columns], turned, strict=True):
        # each hinge about the axis that those before it have turned
        found = np.eye(3)
        for hinge, angle in zip(hinges, q, strict=True):
            found = found @ Rotation.from_rotvec(angle * np.array(hinge.axis)).as_matrix()
        np.testing.assert_allclose(found, expected, atol=1e-7)
    np.testing.assert_allclose(motion.coordinates[:, 9], [0.67686131, 0.321295185])


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


def _written(time, angle, folder):
    rows = "".join(f"{t:.9f}\t{a:.9f}\n" for t, a in zip(time, angle, strict=True))
    head = f"name\nnRows={len(time)}\nnColumns=2\ninDegrees=no\nendheader\ntime\tflex\n"
    file = folder / "states.sto"
    file.write_text(head + rows)
    return file


def _uneven_times():
    """An integrator's steps of 2 to 15 ms."""
    return np.concatenate([[0.0], np.cumsum(np.random.default_rng(4).uniform(2e-3, 15e-3, 400))])


def test_an_integrators_steps_become_even_ones(tmp_path):
    time = _uneven_times()
    table = read_opensim_table(_written(time, np.sin(6.0 * time), tmp_path))
    np.testing.assert_allclose(np.diff(table.time_s), 1 / table.sample_rate_hz, rtol=1e-9)
    np.testing.assert_allclose(table.column("flex"), np.sin(6.0 * table.time_s), rtol=0, atol=2e-6)
    assert any("interpolated" in remark for remark in table.remarks)


@pytest.mark.parametrize("what", ["rough", "a gap", "lost samples", "a tiny usual step"])
def test_what_cannot_be_interpolated_is_refused(what, tmp_path):
    time = _uneven_times()
    angle = np.sin(6.0 * time)
    if what == "rough":
        angle += np.random.default_rng(5).normal(0, 0.05, len(time))
    elif what == "a gap":
        time[200:] += 1.0
    elif what == "lost samples":
        time = np.delete(np.arange(400) / 100, [50, 51, 200])
        angle = np.sin(6.0 * time)
    else:
        time = np.sort(np.concatenate([time, np.linspace(1.0, 1.001, 900)]))
        angle = np.sin(6.0 * time)
    with pytest.raises(InputError, match="equal steps"):
        read_opensim_table(_written(time, angle, tmp_path))
