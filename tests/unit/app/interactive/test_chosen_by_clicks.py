"""A choice made by clicks is the one that its script makes, and asks what the file does not say."""

import runpy
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from sessions import LEVELS, pushes

import armimpedance as ai
from armimpedance.app.interactive.choice import ChosenAnalysis, groupings, questions_of
from armimpedance.core.errors import InputError

NAMES = [LEVELS[0], "later", LEVELS[1]]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    path = tmp_path_factory.mktemp("session") / "it's a session"
    recording = pushes()
    later = recording.trials["set"] == 2
    condition = recording.trials["condition"].mask(
        later & (recording.trials["trial"] > 8), NAMES[1]
    )
    trials = recording.trials.assign(condition=condition)
    ai.write_recording(replace(recording, trials=trials), path)
    return path


@pytest.mark.first_cases(1)
@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("reading", "conditions", "left_out", "mass", "trials"),
    [
        ({}, (NAMES[0], NAMES[2]), (2, 3), 0.3, 14),
        ({}, (), (), None, 32),
        ({"where": "set == 1 or trial == 20"}, (NAMES[0],), (1,), None, None),
    ],
    ids=["some", "all", "with where"],
)
def test_the_script_does_what_was_clicked(
    session, tmp_path, monkeypatch, reading, conditions, left_out, mass, trials
):
    choice = ChosenAnalysis(session, reading, mass, ("condition",), conditions, left_out)
    kept = choice.keep(ai.read(session, **reading))
    hand = ai.estimate(kept)
    script = tmp_path / "analysis.py"
    script.write_text(choice.script(compared=len(hand) > 1), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    done = runpy.run_path(str(script))
    assert done["recording"].n_trials == kept.n_trials
    assert trials in (None, kept.n_trials)
    assert set(left_out).isdisjoint(kept.trials["trial"])
    for clicked, run in zip(hand, done["hand"], strict=True):
        np.testing.assert_array_equal(clicked.covariance, run.covariance)
        np.testing.assert_array_equal(clicked.stiffness, run.stiffness)
    for file in ("hand.csv", "ellipses.svg", "report.html"):
        assert (tmp_path / file).stat().st_size > 0
    assert (tmp_path / "differences.csv").exists() == (len(hand) > 1)


def test_leaving_everything_out_is_refused(session):
    recording = ai.read(session)
    everyone = tuple(recording.trials["trial"].tolist())
    with pytest.raises(InputError, match="no trial is left"):
        ChosenAnalysis(session, left_out=everyone).keep(recording)


def test_a_group_has_trials_and_there_is_more_than_one():
    trials = pd.DataFrame(
        {
            "trial": range(1, 9),
            "condition": ["near", "far"] * 4,
            "day": 1,
            "direction_deg": [0.0, 0, 90, 90, 180, 180, 270, 270],
            "onset_s": np.linspace(0.3, 0.5, 8),
            "comment": list("abcdefgh"),
        }
    )
    assert groupings(trials) == ["condition", "direction_deg"]


def test_a_recording_asks_nothing_and_a_table_for_its_mapping(session, tmp_path):
    assert questions_of(session).mapping is None
    table = tmp_path / "log.csv"
    rows = "".join(f"{i},{i / 9},{i},1,{i % 3}\n" for i in range(90))
    table.write_text("Time (ms),x (mm),y (mm),Fx (N),Fy (N)\n" + rows)
    asked = questions_of(table)
    assert '"x (mm)"' in asked.mapping
    assert asked.cannot_tell
    (tmp_path / "columns.toml").write_text("kind = 'hand'\n")
    assert questions_of(table).mapping == "kind = 'hand'\n"


def test_what_is_no_table_has_no_questions(tmp_path):
    (tmp_path / "notes.txt").write_text("nothing to see\n")
    assert questions_of(tmp_path / "notes.txt").mapping is None
    assert questions_of(tmp_path / "absent").exam is None
