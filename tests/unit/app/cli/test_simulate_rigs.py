"""`armimpedance simulate` of moving bodies: what it writes can be analysed; what it refuses."""

from __future__ import annotations

import json
from functools import partial

import pytest

import manipulandum_sim.body
import manipulandum_sim.passive
from armimpedance.__main__ import main


@pytest.fixture
def brief(monkeypatch):
    """The rigs record seconds instead of half a minute."""
    passive, body = manipulandum_sim.passive, manipulandum_sim.body
    swing, squat = passive.simulate_passive, body.simulate_body
    monkeypatch.setattr(passive, "simulate_passive", partial(swing, trials=1, duration_s=4.0))
    monkeypatch.setattr(body, "simulate_body", partial(squat, ("squat",)))


@pytest.mark.study
@pytest.mark.parametrize("table", ["csv", "parquet"])
@pytest.mark.parametrize("rig", ["p5", "release"])
def test_a_simulated_arm_is_analysed(rig, table, brief, tmp_path, capsys):
    folder, out = tmp_path / "relaxed", tmp_path / "fit.json"
    call = ["simulate", rig, "--noise", "none", "--table", table, "--out", str(folder)]
    assert main(call) == 0
    assert "1 trial, 1 condition, 4.0 s at 30 Hz" in capsys.readouterr().out
    assert (folder / f"samples.{table}").is_file()
    truth = json.loads((folder / "truth.json").read_text())
    rest = str(truth["q_r"][-1])
    assert main(["passive", str(folder), "--rest-angle", rest, "--out", str(out)]) == 0
    stiffness = json.loads(out.read_text())["parameters"][0]
    # without noise what is left is the filter's: a hundredth
    assert stiffness["value"] == pytest.approx(truth["k"][-1], rel=0.01)


def test_a_simulated_body_is_inspected(brief, tmp_path, capsys):
    folder = tmp_path / "body"
    assert main(["simulate", "body", "--out", str(folder), "--table", "csv"]) == 0
    assert main(["inspect", str(folder)]) == 0
    assert "bear the body's weight" in capsys.readouterr().out
    assert (folder / "truth.json").is_file()


@pytest.mark.study
def test_the_seed_decides(brief, tmp_path):
    for name, seed in (("a", "3"), ("b", "3"), ("c", "4")):
        call = ["simulate", "body", "--seed", seed, "--table", "csv", "--out", str(tmp_path / name)]
        assert main(call) == 0
    a, b, c = ((tmp_path / n / "samples.csv").read_bytes() for n in "abc")
    assert a == b != c


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("swim",), ("'swim'", "cocontraction", "p5", "release", "body")),
        (("postures", "--markers"), ("simulate postures: no such option here: --markers",)),
        (("p5", "--subject", "Z"), ("'Z'", "1 or 2")),
        (("body", "--subject", "9"), ("'9'", "A or B")),
        (("p5", "--noise", "loud"), ("--noise", "'loud'", "nominal")),
        (("p5", "--seed", "-1"), ("seed -1", "0 or more")),
        (("p5", "--servo", "3"), ("simulate p5", "--servo 3")),
        (("p5", "--duration-s", "3"), ("simulate p5", "--duration-s 3")),
        (("body", "--amplitude-mm", "3"), ("simulate body", "--amplitude-mm 3")),
        (("body", "--disturbance", "biphasic"), ("simulate body", "--disturbance biphasic")),
    ],
)
def test_wrong_calls_are_one_line(arguments, says, refusal):
    line = refusal("simulate", *arguments, "--out", "folder")
    for word in says:
        assert word in line


def test_a_file_is_not_overwritten_by_a_folder(brief, refusal, tmp_path):
    (tmp_path / "notes").write_text("mine")
    line = refusal("simulate", "body", "--out", tmp_path / "notes")
    assert "is a file" in line
    assert (tmp_path / "notes").read_text() == "mine"
