"""Trials that are left out by hand: the estimate is that of the others, and says what it lacks."""

from __future__ import annotations

import numpy as np
import pytest

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.show.verbs.results import without_trials
from manipulandum_sim.hand import simulate
from manipulandum_sim.hand.robot import IDEAL

NAMES = ["cocontraction_10", "cocontraction_20"]


@pytest.fixture(scope="module")
def session():
    return simulate("cocontraction", seed=5, sets=2, conditions=NAMES, emg=False, servo=IDEAL)[0]


@pytest.fixture
def listed(tmp_path):
    path = tmp_path / "left_out.csv"
    path.write_text("trial,why\n3,coughed\n7,\n")
    return path


def test_the_estimate_is_that_of_the_other_trials_and_names_those_left_out(session, listed):
    found = ai.estimate(session, leave_out=listed)
    other = ai.estimate(session.select(~np.isin(session.trials["trial"], [3, 7])))
    for one, two in zip(found, other, strict=True):
        np.testing.assert_array_equal(one.parameters, two.parameters)
        assert one.quality.n_trials == two.quality.n_trials
    told = [step for one in found for step in one.provenance if "left out" in step]
    assert " ".join(told).count("3 (coughed)") == 1
    assert sum(one.quality.n_trials for one in found) == session.n_trials - 2


def test_a_list_in_memory_and_one_in_a_file_are_the_same(session, listed):
    kept = without_trials(session, listed)
    assert list(kept.trials["trial"]) == list(without_trials(session, [7, 3]).trials["trial"])
    assert "coughed" in kept.provenance[-1]
    assert without_trials(session, None) is session


@pytest.mark.parametrize(
    "content",
    ["trial\n999\n", "trial\n1\n1\n", "trial\nx\n", "number\n1\n", "trial\n1.5\n", ""],
    ids=["unknown", "twice", "no number", "no column", "half", "empty"],
)
def test_a_list_that_cannot_be_meant_is_refused(session, tmp_path, content):
    path = tmp_path / "left_out.csv"
    path.write_text(content)
    with pytest.raises(ai.InputError, match="left_out.csv"):
        without_trials(session, path)


def test_nobody_leaves_out_everything(session):
    with pytest.raises(ai.InputError, match="every trial"):
        without_trials(session, session.trials["trial"].tolist())


def test_the_command_line_takes_the_list(session, listed, tmp_path, capsys):
    one = session.select(np.flatnonzero(session.trials["condition"] == NAMES[0]))
    ai.write_recording(one, tmp_path / "session")
    arguments = ["estimate", str(tmp_path / "session"), "--leave-out", str(listed)]
    assert main([*arguments, "--out", str(tmp_path / "hand.csv")]) == 0
    assert "coughed" in (tmp_path / "hand.csv").read_text()
    page = tmp_path / "page.html"
    assert main(["report", str(tmp_path / "session"), *arguments[2:], "--out", str(page)]) == 0
    assert "Left out by hand" in page.read_text()
    assert main(["trials", *arguments[1:], "--out", str(tmp_path / "choice.html")]) == 0
    assert "coughed" in (tmp_path / "choice.html").read_text()
