"""A submission is read as it stands, or refused in one line with row and column."""

from __future__ import annotations

import math

import pytest

from armimpedance.core.errors import InputError
from armimpedance.lab.benchmark import AskedQuantity
from armimpedance.lab.benchmark.scoring import read_submission

ASKED = [
    AskedQuantity(task, record, "I", quantity, unit)
    for task, quantity, unit in (("joint", "I", "kg m^2"), ("hand", "K_11", "N/m"))
    for record in ("p01", "s01")
]


def written(folder, text):
    file = folder / "mine.csv"
    file.write_text(text, encoding="utf-8")
    return file


def test_rows_in_any_order_with_or_without_what_is_optional(tmp_path):
    text = "value,quantity,record,task\n 5 ,K_11,s01,hand\n,I,p01,joint\ninf,I,s01,joint\n"
    claims = read_submission(written(tmp_path, text), ASKED)
    assert claims[("hand", "s01", "K_11")].value == 5
    assert not claims[("hand", "s01", "K_11")].has_interval
    assert not claims[("joint", "p01", "I")].answers
    assert not claims[("joint", "s01", "I")].answers
    full = (
        "task,record,quantity,value,low,high,unit,warned,time_s\r\n"
        "joint,p01,I,.07,.06,inf,kg m^2,true,2.5\r\njoint,s01,I,.07,,,,,\r\n"
    )
    claims = read_submission(written(tmp_path, "\ufeff" + full), ASKED)
    first = claims[("joint", "p01", "I")]
    assert first.warned
    assert first.time_s == 2.5
    assert math.isinf(first.high)
    assert first.has_interval
    assert not claims[("joint", "s01", "I")].has_interval
    # NaN is as good as empty, of a limit as of a value
    bare = read_submission(written(tmp_path, HEAD + "joint,p01,I,1,nan,NaN,,,\n"), ASKED)
    assert bare[("joint", "p01", "I")].answers
    assert not bare[("joint", "p01", "I")].has_interval


HEAD = "task,record,quantity,value,low,high,unit,warned,time_s\n"
GOOD = "joint,p01,I,1,0,2,kg m^2,0,1\n"


@pytest.mark.parametrize(
    ("rows", "row", "column"),
    [
        (GOOD + GOOD, 3, "quantity"),
        ("joints,p01,I,1,,,,,\n", 2, "task"),
        (GOOD + "joint,p99,I,1,,,,,\n", 3, "record"),
        ("joint,p01,K_11,1,,,,,\n", 2, "quantity"),
        ("joint,p01,I,1,,,g cm^2,,\n", 2, "unit"),
        ("joint,p01,I,one,,,,,\n", 2, "value"),
        ("joint,p01,I,1_0,,,,,\n", 2, "value"),
        ("joint,p01,I,1e300,,,,,\n", 2, "value"),
        ("joint,p01,I,1,2,1,,,\n", 2, "low"),
        ("joint,p01,I,1,inf,inf,,,\n", 2, "low"),
        ("joint,p01,I,1,nan,2,,,\n", 2, "low"),
        ("joint,p01,I,1,0,nan,,,\n", 2, "high"),
        ("joint,p01,I,1,0,,,,\n", 2, "high"),
        ("joint,p01,I,1,,,,perhaps,\n", 2, "warned"),
        ("joint,p01,I,1,,,,,-1\n", 2, "time_s"),
        ("joint,p01,I\n", 2, None),
        (GOOD.strip() + ",9\n", 2, None),
        ("", None, None),
    ],
)
def test_what_cannot_be_scored_is_refused_with_its_place(tmp_path, rows, row, column):
    with pytest.raises(InputError) as caught:
        read_submission(written(tmp_path, HEAD + rows), ASKED)
    told = str(caught.value)
    assert "\n" not in told
    assert "mine.csv" in told
    assert row is None or f"row {row}" in told
    assert column is None or column in told


@pytest.mark.parametrize(
    "head",
    [
        "task,record,quantity\n",
        "task,record,quantity,value,value\n",
        "task,record,quantity,value,lo,hi\n",
        "task,record,quantity,value,low\n",
        "",
    ],
)
def test_a_header_of_another_kind_is_refused(tmp_path, head):
    with pytest.raises(InputError, match=r"mine\.csv"):
        read_submission(written(tmp_path, head + GOOD), ASKED)
