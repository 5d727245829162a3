"""Tables of results as OpenSim's .sto."""

from __future__ import annotations

import math

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.recordings.motion.opensim_tables import read_opensim_table
from armimpedance.show.files.tables import table_content, write_content


def write_table(rows, path):
    write_content(table_content(rows), path)


def parsed(path):
    """The keys, the other lines of the header, the labels and the numbers: by OpenSim's rules."""
    head, body = path.read_text(encoding="utf-8").split("\nendheader\n")
    lines = head.split("\n")
    keys = dict(line.split("=", 1) for line in lines if "=" in line)
    labels, *rows = (line.split("\t") for line in body.rstrip("\n").split("\n"))
    assert {len(row) for row in rows} == {len(labels)}
    assert (int(keys["nRows"]), int(keys["nColumns"])) == (len(rows), len(labels))
    return keys, [line for line in lines if "=" not in line], labels, np.array(rows, float)


def test_every_number_comes_back_to_the_last_bit(tmp_path):
    values = np.random.default_rng(5).normal(size=(20, 3)) * 10.0 ** np.arange(-4, 5, 4)
    rows = [dict(zip(("K_11", "K_12", "sd_K_11"), row, strict=True)) for row in values.tolist()]
    write_table(rows, tmp_path / "k.sto")
    keys, _, labels, numbers = parsed(tmp_path / "k.sto")
    assert labels == ["time", "K_11", "K_12", "sd_K_11"]
    assert keys["inDegrees"] == "no"
    np.testing.assert_array_equal(numbers[:, 1:], values)
    np.testing.assert_array_equal(numbers[:, 0], np.arange(20))
    table = read_opensim_table(tmp_path / "k.sto")
    np.testing.assert_array_equal(table.columns["K_12"], values[:, 1])
    assert table.remarks == ()


def test_the_courses_own_time_is_the_time(tmp_path):
    rows = [{"time_s": t / 50, "K": 3.0 * t} for t in range(5)]
    write_table(rows, tmp_path / "k.sto")
    _, lines, labels, numbers = parsed(tmp_path / "k.sto")
    assert labels == ["time", "K"]
    np.testing.assert_array_equal(numbers[:, 0], np.arange(5) / 50)
    assert not any("number of the row" in line for line in lines)


@pytest.mark.parametrize("times", [[0.0, 1.0, 1.0], [1.0, 0.5, 2.0], [0.0, None, 2.0]])
def test_a_time_that_does_not_rise_stays_a_column(times, tmp_path):
    write_table([{"time_s": t, "K": 1.0} for t in times], tmp_path / "k.sto")
    _, lines, labels, numbers = parsed(tmp_path / "k.sto")
    assert labels == ["time", "time_s", "K"]
    np.testing.assert_array_equal(numbers[:, 0], [0, 1, 2])
    np.testing.assert_array_equal(numbers[:, 1], np.array(times, float))
    assert any("number of the row" in line for line in lines)


def test_texts_stand_in_the_header_and_are_not_lost(tmp_path):
    rows = [
        {"condition": "push", "method": "qr", "K": 1.0, "fast": True},
        {"condition": "endheader\nx=1\ty", "method": "qr", "K": None, "fast": False},
        {"condition": 3, "method": "qr", "K": 2.0, "fast": None},
    ]
    write_table(rows, tmp_path / "k.sto")
    keys, lines, labels, numbers = parsed(tmp_path / "k.sto")
    assert labels == ["time", "K", "fast"]
    assert set(keys) == {"inDegrees", "nColumns", "nRows", "DataType", "version"}
    assert "Not in the table: method: all rows: qr" in lines
    assert any("row 0: push; row 1: endheader x:1 y; row 2: 3" in line for line in lines)
    assert [math.isnan(v) for v in numbers[:, 1]] == [False, True, False]
    np.testing.assert_array_equal(numbers[:2, 2], [1, 0])
    assert read_opensim_table(tmp_path / "k.sto").in_degrees is False


def test_labels_are_one_word_and_differ(tmp_path):
    write_table([{"a b": 1.0, "a\tb": 2.0, "Time": 3.0, "": 4.0}], tmp_path / "k.sto")
    labels = parsed(tmp_path / "k.sto")[2]
    assert labels == ["time", "a_b", "a_b_", "Time_", "column"]


@pytest.mark.parametrize("rows", [[], [{"condition": "push"}], [{"K": [1.0]}]])
def test_a_table_without_numbers_is_refused(rows, tmp_path):
    with pytest.raises(InputError, match=r"k\.sto"):
        write_table(rows, tmp_path / "k.sto")
    assert not list(tmp_path.iterdir())
