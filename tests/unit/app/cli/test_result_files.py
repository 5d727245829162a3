"""`--out` by its ending and `--long`, of every command that writes a table."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat
from sessions import pushes

from armimpedance.__main__ import main
from armimpedance.recordings.tables.folder import write_folder

LONG = {"quantity", "name", "i", "j", "value", "lower", "upper", "sd", "unit"}


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """A session of two conditions and its results."""
    folder = tmp_path_factory.mktemp("results")
    write_folder(pushes(1), folder / "session")
    ran(folder, "estimate", "session", "hand.csv")
    return folder


def ran(home, command, source, out, *options):
    source = home / source
    assert main([command, str(source), *options, "--out", str(home / out)]) == 0
    return home / out


def test_estimate_writes_a_workbook_with_its_checks(home):
    path = ran(home, "estimate", "session", "hand.xlsx")
    book = pd.read_excel(path, sheet_name=None)
    pd.testing.assert_frame_equal(
        book["results"], pd.read_csv(home / "hand.csv"), check_dtype=False, rtol=1e-15
    )
    checks = book["checks"].set_index("check")["verdict"]
    assert checks["force sign"] == "ok"
    told = dict(book["methods"].itertuples(index=False))
    assert told["recordings"] == "session"
    assert str(home) not in " ".join(map(str, told.values()))


def test_estimate_writes_structs_with_its_checks(home):
    path = ran(home, "estimate", "session", "hand.mat")
    read = loadmat(path, struct_as_record=False, squeeze_me=True)
    assert [one.keys.condition for one in read["results"]] == [
        "cocontraction_10",
        "cocontraction_30",
    ]
    assert "force sign" in [one.check for one in read["checks"]]


@pytest.mark.parametrize(
    ("command", "options", "quantity"),
    [
        ("estimate", (), "K_11"),
        ("map", ("--to", "joint"), "K_12"),
        ("map", ("--to", "muscle", "--arm", "planar6"), "K_sum_ss"),
        ("compare", ("--by", "condition"), "K_22"),
        ("reflex", (), "K_11"),
    ],
    ids=["estimate", "joint", "muscle", "compare", "reflex"],
)
def test_long_tables(home, command, options, quantity):
    source = "session" if command in ("estimate", "reflex") else "hand.csv"
    more = ("--recording", str(home / "session")) if command == "map" else ()
    path = ran(home, command, source, "long.csv", *options, *more, "--long")
    table = pd.read_csv(path)
    assert set(table.columns) >= LONG
    rows = table[table["quantity"] == quantity]
    assert rows["unit"].isin(["N/m", "N m/rad"]).all()
    assert len(rows)
    limits = rows.dropna(subset=["lower"])
    assert (limits["lower"] < limits["value"]).all()
    assert (limits["value"] < limits["upper"]).all()


@pytest.mark.study
def test_a_fit_is_a_row_a_parameter_and_fit_json_as_before(relaxed, tmp_path):
    options = ("--rest-angle", "1.5", "--method", "ls")
    for out in ("fit.json", "fit.csv", "fit.xlsx", "fit.mat", "long.csv"):
        long = ("--long",) if out == "long.csv" else ()
        call = ["passive", str(relaxed), *options, *long, "--out", str(tmp_path / out)]
        assert main(call) == 0
    told = json.loads((tmp_path / "fit.json").read_text())["parameters"]
    table = pd.read_csv(tmp_path / "fit.csv")
    # as text they are the same; not all versions of pandas read a text's last bit
    np.testing.assert_allclose(table["value"], [one["value"] for one in told], rtol=1e-14)
    long = pd.read_csv(tmp_path / "long.csv").set_index("quantity")
    for one in told:
        row = long.loc[one["name"]]
        limits = row[["value", "lower", "upper"]].to_numpy(float)
        np.testing.assert_allclose(limits, [one["value"], *one["ci95"]], rtol=1e-14)
        assert row["unit"] == one["unit"]
    struct = loadmat(tmp_path / "fit.mat", struct_as_record=False, squeeze_me=True)["results"]
    assert [one.name for one in struct.parameters] == [one["name"] for one in told]


@pytest.mark.parametrize("options", [("--long",), ("--long", "--out", "a.xlsx")])
def test_long_without_effect_is_refused_before_any_work(refusal, options):
    assert "--long" in refusal("estimate", "no_such_session", *options)
