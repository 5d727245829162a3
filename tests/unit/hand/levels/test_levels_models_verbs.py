"""Verbs from the hand to joints, muscles and models: a path gives what the record gives."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.app.cli.main import run as main
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.records import Subject
from armimpedance.hand.levels.show import to_hand, to_joint, to_muscle
from armimpedance.hand.show import Estimates
from armimpedance.hand.still.show import estimate
from armimpedance.muscles.models import MODEL_KINDS, JointRows, fit_posture_model, write_model
from armimpedance.muscles.show import (
    at_hand,
    fit_activation,
    fit_model,
    fit_muscles,
    fit_posture,
    predict,
)
from armimpedance.recordings.tables.folder import write_folder
from manipulandum_sim.hand import simulate
from manipulandum_sim.hand.robot import IDEAL


@pytest.fixture(scope="module")
def recording():
    return simulate("cocontraction", seed=3, sets=1, servo=IDEAL)[0]


@pytest.fixture(scope="module")
def hand(recording):
    return estimate(recording)


@pytest.fixture(scope="module")
def folder(recording, hand, tmp_path_factory):
    home = tmp_path_factory.mktemp("levels")
    write_folder(recording, home / "session")
    hand.write(home / "hand.csv")
    to_joint(hand).write(home / "joint.csv")
    return home


@pytest.fixture(scope="module")
def model():
    rng = np.random.default_rng(3)
    q = rng.uniform([0.2, 0.7], [1.4, 2.0], (12, 2))
    K = np.array([[15.0, 6.0], [6.0, 16.0]]) * (1 + 0.2 * np.sin(q[:, :1, None]))
    return fit_posture_model(JointRows(q, K, K / 12), order=1)


def same(a, b):
    for one, other in zip(a, b, strict=True):
        for field in ("inertia", "viscosity", "stiffness", "covariance"):
            np.testing.assert_allclose(getattr(one, field), getattr(other, field), rtol=1e-12)


@pytest.mark.study
def test_a_path_and_a_record_give_the_same_joints(hand, folder, recording):
    joint = to_joint(hand)
    assert isinstance(joint, Estimates)
    assert joint.subject == recording.subject
    same(joint, to_joint(folder / "hand.csv", recording=folder / "session"))
    same(joint, to_joint(list(hand), recording=recording))
    assert np.abs(joint[-1].stiffness - to_joint(hand, force_term=False)[-1].stiffness).max() > 0


def test_the_way_to_the_joints_and_back_is_the_symmetric_part(hand):
    back = to_hand(to_joint(hand))
    for one, other in zip(hand, back, strict=True):
        np.testing.assert_allclose((one.stiffness + one.stiffness.T) / 2, other.stiffness)
        assert other.level == "hand"


@pytest.mark.study
def test_the_command_writes_what_the_verb_returns(hand, folder, tmp_path):
    call = ["map", str(folder / "hand.csv"), "--recording", str(folder / "session")]
    assert (
        main([*call, "--to", "muscle", "--arm", "planar6", "--out", str(tmp_path / "m.csv")]) == 0
    )
    muscles = to_muscle(hand, arm="planar6")
    muscles.write(tmp_path / "verb.csv")
    written, made = pd.read_csv(tmp_path / "m.csv"), pd.read_csv(tmp_path / "verb.csv")
    numbers = made.select_dtypes("number").columns
    np.testing.assert_allclose(written[numbers], made[numbers], rtol=1e-9, atol=1e-12)
    assert list(written) == list(made) == list(muscles.to_frame())


def test_muscles_are_found_by_name_and_shown_shortly(hand):
    muscles = to_muscle(hand, arm="planar6")
    assert len(muscles) == len(hand)
    assert muscles["cocontraction_30"] is muscles[muscles.names.index("cocontraction_30")]
    assert len(repr(muscles).splitlines()) <= 12
    hostile = replace(muscles[0], keys={"condition": "<script>"})
    assert "<script>" not in type(muscles)((hostile,))._repr_html_()
    with pytest.raises(InputError, match="cocontraction_00"):
        muscles["nobody"]


def test_errors_name_condition_and_file(hand, folder):
    with pytest.raises(InputError, match=r"hand\.csv: cocontraction_00: the arm is not known"):
        to_joint(folder / "hand.csv")
    with pytest.raises(InputError, match="cocontraction_00: an estimate at the joint level"):
        to_joint(to_joint(hand))
    with pytest.raises(InputError, match="no force term in rows of the joints"):
        to_muscle(to_joint(hand), arm="planar6", force_term=False)
    with pytest.raises(InputError, match="share 'guess'"):
        to_muscle(hand, arm="planar6", share="guess")


def test_subject_and_recording_stand_for_each_other(hand, folder, recording):
    bare = list(hand)
    same(to_joint(bare, recording=recording.subject), to_joint(bare, recording=folder / "session"))


def test_rows_may_be_a_path_paths_estimates_or_rows(hand, folder):
    path = folder / "joint.csv"
    fits = [
        fit_posture(rows, order=0).stiffness.coefficients for rows in (path, [path], to_joint(hand))
    ]
    for each in fits[1:]:
        np.testing.assert_allclose(each, fits[0], rtol=1e-9)


def test_models_of_activation_and_of_muscles(hand):
    joint = to_joint(hand)
    with pytest.raises(NotIdentifiableError, match="errors of the activation explain"):
        fit_activation(joint)
    steps = []
    made = fit_muscles(joint, order=0, progress=lambda done, total: steps.append((done, total)))
    assert steps[-1][0] == steps[-1][1]
    assert len(made.parameters) == len(made.values)
    assert made.parameters["K_passive_s"].unit == "N m/rad"


def test_degrees_are_the_radians_of_the_kind(model):
    q = np.random.default_rng(1).uniform([0.2, 0.7], [1.4, 2.0], (9, 2))
    K = np.tile([[15.0, 6.0], [6.0, 16.0]], (9, 1, 1)) * (1 + 0.1 * q[:, :1, None])
    rows, box = JointRows(q, K, K), np.array([[0, 90], [30, 130]])
    asked = {"order": 1, "model": "polynomial"}
    in_degrees = fit_posture(rows, box_deg=box, **asked)
    in_radians = fit_model("moment-arms", rows, box=np.radians(box), **asked)
    assert (
        in_degrees.stiffness.coefficients.tobytes() == in_radians.stiffness.coefficients.tobytes()
    )
    with pytest.raises(InputError, match="unknown kind of model 'tendons'"):
        fit_model("tendons", rows)


def test_a_model_and_its_file_predict_the_same(model, tmp_path):
    write_model(model, tmp_path / "model.json")
    (tmp_path / "q.csv").write_text("q_shoulder_rad,q_elbow_rad\n0.8,1.2\n2.5,0.1\n")
    here = predict(model, postures=[[0.8, 1.2], [2.5, 0.1]])
    there = predict(tmp_path / "model.json", postures=tmp_path / "q.csv")
    assert here.stiffness.tobytes() == there.stiffness.tobytes()
    frame = here.to_frame()
    assert {"q_elbow_rad", "K_11", "sd_K_12", "ci_high_B_22", "reason"} <= set(frame)
    assert frame["extrapolated"].tolist() == [0, 1]
    assert len(repr(here).splitlines()) <= 12
    hand = at_hand(here, recording=Subject(upper_arm_m=0.3, forearm_hand_m=0.34), force_N=[3, -4])
    assert hand.to_frame()["level"].tolist() == ["hand", "hand"]
    with pytest.raises(InputError, match="without postures"):
        predict(model)
    with pytest.raises(InputError, match="with activations"):
        predict(model, postures=[0.8, 1.2], activations=[[0.1] * 6])


def test_a_model_tells_of_itself(model):
    assert len(repr(model).splitlines()) <= 12
    assert list(model.to_frame().index) == [p.name for p in model.summary.parameters]
    assert json.dumps(model.to_dict()["quality"])
    given = model.parameters
    np.testing.assert_allclose(given.sd, [p.sd for p in model.summary.parameters])
    hostile = replace(model, summary=replace(model.summary, method="<script>"))
    assert "<script>" not in hostile._repr_html_()


def test_every_kind_says_what_it_is():
    assert list(MODEL_KINDS) == ["moment-arms", "activation", "muscles"]
    for name, kind in MODEL_KINDS.items():
        assert kind.name == name
        assert set(kind.needs) <= {"postures", "activations"}
