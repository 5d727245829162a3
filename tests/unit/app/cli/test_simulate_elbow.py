"""`armimpedance simulate elbow...`: a recording, its truth, options that belong elsewhere."""

from __future__ import annotations

import json

import numpy as np
import pytest

from armimpedance.__main__ import main
from armimpedance.recordings.tables.folder import read_folder
from manipulandum_sim.elbow.truth import ElbowTruth

SHORT = ("--sets", "1", "--duration-s", "1")


@pytest.mark.parametrize(
    "experiment",
    ["elbow", "elbow-cocontraction", "elbow-varying", "elbow-calibration", "elbow-damper"],
)
def test_each_test_is_written_with_its_truth(experiment, tmp_path, capsys):
    out = tmp_path / "session"
    assert main(["simulate", experiment, "--out", str(out), *SHORT, "--subject", "3"]) == 0
    recording, truth = read_folder(out), ElbowTruth.read(out / "truth.json")
    assert recording.kind == "joint"
    assert recording.torque == "interaction"
    assert truth.subject == recording.subject.id == "3"
    assert len(truth.K) == len(recording.time_s)
    assert "EMG (V): biceps, triceps" in capsys.readouterr().out


@pytest.mark.study
def test_options_reach_the_rig(tmp_path):
    def simulated(*options):
        out = tmp_path / "_".join(options or ("plain",)).replace("-", "")
        assert main(["simulate", "elbow-varying", "--out", str(out), *SHORT, *options]) == 0
        return read_folder(out), ElbowTruth.read(out / "truth.json")

    plain, truth = simulated()
    commanded, _ = simulated("--commanded")
    assert commanded.torque == "commanded"
    assert np.abs(commanded.force - plain.force).max() > 0.1
    _, faster = simulated("--frequency-hz", "2")
    assert np.abs(np.diff(faster.K)).max() > 2 * np.abs(np.diff(truth.K)).max()
    assert simulated("--law", "saturating")[1].law == "saturating"
    binary, _ = simulated("--perturbation", "prbs")
    assert len(np.unique(binary.extra["tau1_perturbation_Nm"])) == 2
    seeded, _ = simulated("--seed", "7")
    assert not np.array_equal(seeded.position, plain.position)


def test_inspect_says_what_an_elbow_recording_holds_and_lacks(tmp_path, capsys):
    out = tmp_path / "session"
    main(["simulate", "elbow", "--out", str(out), *SHORT, "--table", "csv"])
    about = json.loads((out / "recording.json").read_text())
    del about["torque"]
    (out / "recording.json").write_text(json.dumps(about))
    capsys.readouterr()
    assert main(["inspect", str(out)]) == 0
    said = capsys.readouterr().out
    assert "not known: torque" in said
    assert "EMG MVC: of every muscle" in said
    assert "EMG saturated" in said


@pytest.mark.parametrize(
    ("options", "match"),
    [
        (["elbow", "--subject", "A"], "1 or 2 or 3 or 4"),
        (["elbow", "--noise", "loud"], "loud"),
        (["elbow", "--sets", "0"], "repetitions"),
        (["elbow", "--duration-s", "0.2"], "0.2 s"),
        (["elbow", "--frequency-hz", "1"], "simulate elbow: no such option here: --frequency-hz"),
        (
            ["elbow", "--disturbance", "biphasic"],
            "simulate elbow: no such option here: --disturbance biphasic",
        ),
        (["elbow", "--servo", "5000"], "simulate elbow: no such option here: --servo 5000"),
        (["elbow", "--markers"], "simulate elbow: no such option here: --markers"),
        (["elbow-varying", "--frequency-hz", "-1"], "-1.0 Hz"),
        (["elbow-flight"], "elbow-varying"),
        (["postures", "--commanded"], "simulate postures: no such option here: --commanded"),
        (["p5", "--law", "saturating"], "simulate p5: no such option here: --law"),
        (["body", "--perturbation", "prbs"], "simulate body: no such option here: --perturbation"),
    ],
    ids=lambda v: " ".join(v) if isinstance(v, list) else "",
)
def test_a_wrong_call_is_one_line_and_writes_nothing(options, match, refusal):
    assert match in refusal("simulate", *options, "--out", "session")
