"""Inputs that once ended a command with a traceback, a warning or too much memory, kept small.

Each was found by `benchmarks/doors/hostile_commands.py`; an edit of a sound file makes it again.
"""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from sessions import pushes

from armimpedance.__main__ import main
from armimpedance.recordings import write_recording


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A session, its results and those at the joints, as the commands write them."""
    folder = tmp_path_factory.mktemp("sound")
    recording = pushes(1, ("cocontraction_10",))
    write_recording(recording, folder / "hand")
    run = [["estimate", "hand", "--out", "hand.csv"]]
    run += [["map", "hand.csv", "--recording", "hand", "--to", "joint", "--out", "joint.csv"]]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for words in run:
            assert main(words) == 0
    return folder


@pytest.fixture
def shop(sound, tmp_path, monkeypatch):
    """A copy to damage, where the command runs."""
    shutil.copytree(sound, tmp_path / "shop")
    monkeypatch.chdir(tmp_path / "shop")
    return tmp_path / "shop"


def column(file: str, name: str, value: str) -> None:
    """Another value in a column of a table, which is added where there is none."""
    with Path(file).open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    with Path(file).open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, dict.fromkeys([*rows[0], name]))
        writer.writeheader()
        writer.writerows({**row, name: value} for row in rows)


def field(file: str, name: str, value: object) -> None:
    """Another value of a field of a JSON."""
    content = json.loads(Path(file).read_text(encoding="utf-8"))
    Path(file).write_text(json.dumps({**content, name: value}), encoding="utf-8")


def append(file: str, data: bytes) -> None:
    """Bytes at the end of the first line."""
    head, rest = Path(file).read_bytes().split(b"\n", 1)
    Path(file).write_bytes(head + data + b"\n" + rest)


def impossible() -> list[float]:
    """A lower triangle of ones (12, 12) with one correlation that is of the other sign."""
    triangle = np.ones((12, 12))
    triangle[1, 0] = -1.0
    return triangle[np.tril_indices(12)].tolist()


FALLEN = {
    "text as MVC": (
        "estimate hand --out out.csv",
        lambda: column("hand/trials.csv", "mvc_biceps_long_V", "strong"),
    ),
    "level at rest beyond all measure": (
        "estimate hand --out out.csv",
        lambda: column("hand/trials.csv", "rest_biceps_long_V", "1e300"),
    ),
    "rate of nothing": (
        "inspect hand",
        lambda: field("hand/recording.json", "sample_rate_hz", 5e-324),
    ),
    "half a character": (
        "inspect hand",
        lambda: field("hand/recording.json", "subject", {"id": "\ud800"}),
    ),
    "table that is no UTF-8": (
        "report hand.csv --out out.html",
        lambda: append("hand.csv", b"\xff"),
    ),
    "a hundred million muscles": (
        "fit activation joint.csv --out out.json",
        lambda: column("joint.csv", "alpha_99999999", "0.1"),
    ),
    "infinite posture": (
        "map hand.csv --recording hand --to joint --out out.csv",
        lambda: column("hand.csv", "q_shoulder_rad", "inf"),
    ),
    "variances beyond all measure": (
        "compare hand.csv joint.csv --out out.csv",
        lambda: column("hand.csv", "covariance", json.dumps([1e300] * 78)),
    ),
    "hardly a degree of freedom": (
        "report hand.csv --out out.html",
        lambda: column("hand.csv", "dof", "3e-323"),
    ),
    "a hundred thousand brackets": (
        "report FIT.json --out out.html",
        lambda: Path("FIT.json").write_bytes(b"[" * 100_000),
    ),
    "brackets in a cell": (
        "compare hand.csv --out out.csv",
        lambda: column("hand.csv", "covariance", "[" * 100_000),
    ),
    "a number that no float holds": (
        "report FIT.json --out out.html",
        lambda: Path("FIT.json").write_text('{"cond_raw": ' + "9" * 401 + "}"),
    ),
    "correlations that cannot be together": (
        "report hand.csv --out out.html",
        lambda: column("hand.csv", "covariance", json.dumps(impossible())),
    ),
    "a fit of one posture": ("fit moment-arms joint.csv --out out.json", lambda: None),
}


@pytest.mark.parametrize("name", FALLEN)
@pytest.mark.filterwarnings("default")
def test_what_once_fell_is_refused_in_one_line_that_names_it(name, shop, capsys):
    call, damage = FALLEN[name]
    damage()
    before = sorted(shop.rglob("*"))
    capsys.readouterr()
    assert main(call.split()) == 2
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1, told
    assert any(word in told[0] for word in call.split()[1:-2] if Path(word).exists()) or (
        call.split()[1] in told[0]
    )
    assert sorted(shop.rglob("*")) == before


@pytest.mark.filterwarnings("default")
def test_an_mvc_of_nothing_costs_the_activation_only(shop, capsys):
    column("hand/trials.csv", "mvc_biceps_long_V", "5e-324")
    assert main(["estimate", "hand", "--out", "out.csv"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert "activation left out" in said.out


@pytest.mark.first_cases(1)
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize(
    "call", ["inspect hand --figure out.svg", "estimate hand --out out.csv --figure out.png"]
)
def test_letters_that_a_picture_cannot_show_are_one_line(shop, capsys, call):
    column("hand/trials.csv", "condition", "安静 $x_{")
    assert main(call.split()) == 0
    told = capsys.readouterr().err.splitlines()
    assert len(told) <= 1
    assert all("its font lacks" in line for line in told)
    assert list(shop.glob("out*.[sp][vn]g"))
