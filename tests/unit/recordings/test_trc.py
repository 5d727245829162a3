"""Marker files in text (`.trc`)."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.recordings.motion.trc import read_trc
from armimpedance.recordings.opening import open_recording

PLACES = np.random.default_rng(1).uniform(-0.9, 0.9, (5, 2, 3))


def content(unit="m", rate="60.00", cell=None, empty=(), blank_line=True):
    """The text of a file of two markers; `empty`: (row, marker) that was not seen."""
    scale = {"mm": 1000.0, "m": 1.0}.get(unit, 1.0)
    lines = [
        "PathFileType\t4\t(X/Y/Z)\twalk.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame"
        "\tOrigNumFrames",
        f"{rate}\t60.00\t5\t2\t{unit}\t60.00\t1\t5",
        "Frame#\tTime\thand\t\t\thip\t\t",
        "\t\tX1\tY1\tZ1\tX2\tY2\tZ2",
    ]
    if blank_line:
        lines.append("")
    for row in range(5):
        cells = [str(row + 1), f"{row / 60:.4f}"]
        for marker in range(2):
            seen = (row, marker) not in empty
            cells += [repr(float(v * scale)) if seen else "" for v in PLACES[row, marker]]
        lines.append("\t".join(cells).rstrip("\t"))
    if cell:
        row, column, text = cell
        cells = lines[-5 + row].split("\t")
        cells[column] = text
        lines[-5 + row] = "\t".join(cells)
    return "\n".join(lines) + "\n"


def read(tmp_path, text, **options):
    file = tmp_path / "walk.trc"
    file.write_text(text)
    return read_trc(file, **options)


@pytest.mark.parametrize("unit", ["m", "mm"])
@pytest.mark.parametrize("blank_line", [True, False])
def test_units_and_opensims_axes(unit, blank_line, tmp_path):
    markers = read(tmp_path, content(unit, blank_line=blank_line))
    x, y, z = np.moveaxis(PLACES, 2, 0)
    np.testing.assert_allclose(markers.positions, np.stack([x, -z, y], axis=2), rtol=1e-14)
    assert markers.names == ("hand", "hip")
    assert markers.sample_rate_hz == 60.0
    assert markers.trials["condition"].tolist() == ["walk"]


def test_axes_as_they_are(tmp_path):
    markers = read(tmp_path, content(), axes=("x", "y", "z"))
    np.testing.assert_array_equal(markers.positions, PLACES)


@pytest.mark.parametrize("empty", [[(1, 0)], [(1, 1)], [(4, 1), (4, 0)]])
def test_empty_cells_are_lost_markers(empty, tmp_path):
    markers = read(tmp_path, content(empty=empty))
    found = np.argwhere(np.isnan(markers.positions[..., 0])).tolist()
    assert found == sorted(map(list, empty))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "is empty"),
        ("a,b\n1,2\n", "is no .trc file"),
        (content().replace("Frame#", "Frames"), "no names of markers"),
        (content().replace("hip", "hand"), "two of one name"),
        (content().replace("\tZ2", ""), "5 axes for 2 markers"),
        (content(unit="ft"), "unit of length 'ft'"),
        (content(rate="fast"), "DataRate fast"),
        (content(rate="120"), "time does not rise in steps"),
        (content(cell=(2, 3, "lost")), "row 9: not a finite number: 'lost'"),
        (content(cell=(2, 1, "")), "without a time"),
        (content(cell=(2, 1, "0.01")), "time does not rise"),
        (content(cell=(3, 4, "900")), "900 m away in m"),
        (content(cell=(1, 7, "1\t2\t3")), "row 8: 10 cells"),
    ],
)
def test_one_line_for_whatever_is_wrong(text, told, tmp_path):
    with pytest.raises(InputError, match=told) as error:
        read(tmp_path, text)
    assert "walk.trc" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: text.replace("\t", ","),
        lambda text: "\n".join(line + "\t\t" for line in text.split("\n")),
        lambda text: text.replace(
            "60.00\t60.00\t5\t2\tm\t", "  60.00\t\t 60.00\t  5\t \t2\t\t m\t"
        ),
        lambda text: text.replace("60.00\t60.00\t5\t2\tm\t", " 60.00  60.00   5  2 m "),
        lambda text: text.replace("PathFileType\t4\t", "PathFileType  4\t"),
        lambda text: text.replace("Time\thand\t\t\thip\t\t", "Time   hand     hip   "),
        lambda text: text.replace("Time\thand\t\t\thip", "Time\t\thand\t\thip"),
        lambda text: text.replace("Time", "Times").replace("Frame#", "frame#"),
        lambda text: text.replace("\t\tX1", "X1"),
        lambda text: text.replace("\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n", ""),
        lambda text: text.replace("\n\n", "\n,,,,,,,\n"),
        lambda text: text[:-1],
    ],
)
def test_headers_and_lines_as_programs_write_them(change, tmp_path):
    expected = read(tmp_path, content())
    (tmp_path / "other.trc").write_bytes(change(content()).encode())
    found = read_trc(tmp_path / "other.trc")
    np.testing.assert_array_equal(found.positions, expected.positions)
    np.testing.assert_array_equal(found.time_s, expected.time_s)
    assert found.names == expected.names
    assert len(found.provenance) == 1


@pytest.mark.parametrize("lost", ["nan", "NaN", "-nan", "-nan(ind)", "-1.#IND", "1.#QNAN"])
def test_lost_markers_as_programs_write_them(lost, tmp_path):
    markers = read(tmp_path, content(cell=(2, 3, lost)))
    assert np.argwhere(np.isnan(markers.positions[..., 0])).tolist() == [[2, 0]]


@pytest.mark.parametrize(
    ("stated", "told"),
    [
        ("\t9\t2\tm", "states 9 rows, it holds 5: cut or edited"),
        ("\t4\t2\tm", "states 4 rows, it holds 5."),
        ("\t5\t3\tm", "states 3 markers with a name, it holds 2"),
    ],
)
def test_a_header_that_counts_otherwise_is_told(stated, told, tmp_path):
    markers = read(tmp_path, content().replace("\t5\t2\tm", stated))
    assert any(told in sentence for sentence in markers.provenance)


def test_a_file_cut_anywhere_never_passes_in_silence(tmp_path):
    whole = content()
    unseen = []
    for end in range(len(whole)):
        try:
            markers = read(tmp_path, whole[:end])
        except InputError:
            continue
        if len(markers.provenance) == 1:
            unseen.append(end)
    # cut within the very last number all looks well; so it does without the last line's end
    assert all(end > whole.rindex("\t") for end in unseen)


def test_markers_beyond_those_with_a_name_are_told(tmp_path):
    lines = content().replace("\t5\t2\tm", "\t5\t4\tm").splitlines()
    lines[6:9] = [line + "\t1.0\t2.0\t3.0\t4.0\t5.0\t6.0" for line in lines[6:9]]
    markers = read(tmp_path, "\n".join(lines) + "\n")
    np.testing.assert_array_equal(markers.positions, read(tmp_path, content()).positions)
    assert "Not taken: 6 columns (beyond the markers with a name)." in markers.provenance


def test_metres_called_millimetres(tmp_path):
    lines = content().replace("hip\t\t", "hip\t\t\tknee\t\t").replace("Z2", "Z2\tX3\tY3\tZ3")
    rows = lines.replace("\t5\t2\tm", "\t5\t3\tmm").splitlines()
    rows[6:] = [row + "\t0.1\t0.2\t0.3" for row in rows[6:]]
    with pytest.raises(InputError, match="all markers within .* mm in mm"):
        read(tmp_path, "\n".join(rows) + "\n")


def test_no_unit_is_not_guessed(tmp_path):
    with pytest.raises(InputError, match="no unit of length"):
        read(tmp_path, content().replace("\tUnits\t", "\tUnit\t"))


def test_one_door(tmp_path):
    markers = read(tmp_path, content())
    opened = open_recording(tmp_path / "walk.trc")
    np.testing.assert_array_equal(opened.positions, markers.positions)
