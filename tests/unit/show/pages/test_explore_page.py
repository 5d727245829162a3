"""The page to play with, as Python writes it: what it holds, whose arm it is, what is refused."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from armimpedance.app.cli.main import run as main
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Quality, Subject
from armimpedance.hand.levels import kinematic_arm
from armimpedance.hand.show import write_results
from armimpedance.muscles.models import JointRows, fit_posture_model, matrix, write_model
from armimpedance.muscles.show import write_explore
from armimpedance.muscles.show.explore_data import lengths_of

SUBJECT = Subject(id="X", upper_arm_m=0.31, forearm_hand_m=0.33)
ARM = kinematic_arm(SUBJECT)
HOSTILE = '</script><img src=x onerror="alert(1)">'


def measured(q, name="relaxed", **other):
    J = ARM.jacobian(q)
    K = np.linalg.inv(J).T @ [[15.0, 6.0], [6.0, 16.0]] @ np.linalg.inv(J)
    quality = Quality(40, 1000, 0.99, 0.99, 3.0, 500.0, 6, 0.1)
    made = ImpedanceEstimate(
        "hand",
        "weighted",
        np.eye(2),
        K / 15,
        K,
        np.diag(np.arange(1.0, 13.0)),
        39.0,
        quality,
        keys={"condition": name},
        position=ARM.hand_position(q),
        shoulder_m=np.zeros(2),
        force=np.array([1.0, 2.0]),
        joint_angles=np.array(q),
    )
    return replace(made, **other)


@pytest.fixture(scope="module")
def model():
    rng = np.random.default_rng(2)
    q = rng.uniform([0.3, 0.7], [1.4, 2.1], (20, 2))
    K = matrix(np.array([15.0, 6.0, 16.0]) + q @ rng.normal(size=(2, 3)))
    return fit_posture_model(JointRows(q, K, K / 15), order=1)


def held(path, parse):
    return parse(path.read_text(encoding="utf-8"))._json("more")


def test_lengths_follow_from_hand_positions_and_joint_angles(tmp_path, parse):
    rows = [measured((1.0, 1.5)), measured((0.6, 1.1))]
    assert lengths_of(rows) == pytest.approx((0.31, 0.33))
    write_explore(rows, tmp_path / "page.html")
    more = held(tmp_path / "page.html", parse)
    assert more["arm"]["upper_arm_m"] == pytest.approx(0.31)
    assert "found from hand positions" in more["lengths_from"]
    assert not more["arm"]["mass_known"]


@pytest.mark.parametrize(
    "rows",
    [
        [measured((1.0, 1e-4))],
        [measured((1.0, 1.5), shoulder_m=None)],
        [measured((1.0, 1.5)), measured((0.6, 1.1), shoulder_m=np.array([0.1, 0.0]))],
    ],
    ids=["stretched", "no shoulder", "another shoulder"],
)
def test_lengths_that_do_not_follow_are_asked_for(rows, tmp_path):
    assert lengths_of(rows) is None
    with pytest.raises(InputError, match="lengths are not known .*--recording"):
        write_explore(rows, tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()


def test_a_measured_row_is_the_same_at_hand_and_joints(tmp_path, parse):
    row = measured((1.0, 1.5), force=np.zeros(2))
    write_explore([row], tmp_path / "page.html", recording=SUBJECT)
    [one] = held(tmp_path / "page.html", parse)["measured"]
    assert one["joint"]["K"]["value"] == pytest.approx([15.0, 6.0, 16.0])
    assert matrix(one["hand"]["K"]["value"]) == pytest.approx(row.stiffness)
    variance = np.array(one["hand"]["K"]["covariance"])[[0, 2, 5]]
    # of K_11, of the mean of K_12 and K_21, of K_22
    assert variance == pytest.approx([9.0, (10.0 + 11.0) / 4, 12.0])


def test_rows_that_are_no_hand_in_a_plane_are_left_out_and_said(tmp_path):
    other = measured((1.0, 1.5), name="odd", joint_angles=None, position=np.array([2.0, 2.0]))
    notes = write_explore([measured((0.6, 1.2)), other], tmp_path / "a.html", recording=SUBJECT)
    assert notes[0].startswith("1 of 2 estimates are left out; odd: ")
    with pytest.raises(InputError, match="no estimate can be shown"):
        write_explore([other], tmp_path / "b.html", recording=SUBJECT)


def test_a_hand_elsewhere_than_the_angles_say_is_told(tmp_path):
    notes = write_explore([measured((0.6, 1.2))], tmp_path / "a.html", upper_arm_m=0.35)
    assert "lengths" in notes[0]
    assert "mm from where it was measured" in notes[0]


def test_hostile_texts_stay_inside_of_the_data(model, tmp_path, parse):
    rows = [measured((0.6, 1.2), name=HOSTILE)]
    write_explore([model, rows], tmp_path / "page.html", recording=SUBJECT)
    page = parse((tmp_path / "page.html").read_text(encoding="utf-8"))
    assert page._json("more")["measured"][0]["name"] == HOSTILE
    assert "img" not in {tag for tag, _ in page.elements}
    links = {a.get(name, "") for _, a in page.elements for name in ("src", "href")}
    assert links <= {"", "data:,", None}


def test_the_command_takes_files_and_refuses_in_one_line(model, tmp_path, capsys):
    write_model(model, tmp_path / "posture.json")
    write_results([measured((0.6, 1.2)), measured((1.0, 1.5))], tmp_path / "hand.csv")
    (tmp_path / "session").mkdir()
    (tmp_path / "fit.json").write_text(json.dumps({"format": "other"}))
    out = str(tmp_path / "page.html")
    model_file, results = str(tmp_path / "posture.json"), str(tmp_path / "hand.csv")
    assert main(["explore", model_file, results, "--out", out]) == 0
    assert main(["explore", model_file, "--upper-arm-m", ".3", "--forearm-hand-m", ".3"]
                + ["--out", out]) == 0  # fmt: skip
    capsys.readouterr()
    for arguments, said in (
        ([model_file], "lengths are not known"),
        ([str(tmp_path / "session")], "a folder"),
        ([str(tmp_path / "fit.json")], "holds no model"),
        ([model_file, "--upper-arm-m", "-1", "--forearm-hand-m", ".3"], "upper_arm_m is -1"),
    ):
        assert main(["explore", *arguments, "--out", str(tmp_path / "no.html")]) == 2
        message = capsys.readouterr().err
        assert said in message
        assert message.count("\n") == 1
        assert not (tmp_path / "no.html").exists()
