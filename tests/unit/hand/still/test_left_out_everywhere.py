"""Pictures, checks and pages are of the trials that were estimated, of none left out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.hand.still.show import plot
from armimpedance.show.verbs import checks
from manipulandum_sim.hand import simulate


def test_no_trial_that_was_left_out_is_drawn_or_checked(tmp_path, monkeypatch):
    session, _ = simulate("cocontraction", seed=5, sets=1, conditions=["cocontraction_10"])
    ai.write_recording(session, tmp_path / "session")
    (tmp_path / "left_out.csv").write_text("trial,why\n1,coughed\n2,coughed\n")
    drawn, checked = [], []
    real, findings = plot.plot_motion_and_force, checks.findings_of
    monkeypatch.setattr(
        plot, "plot_motion_and_force", lambda *given: drawn.append(given[0]) or real(*given)
    )
    monkeypatch.setattr(
        checks, "findings_of", lambda *given: checked.append(given[0]) or findings(*given)
    )
    outputs = ["--figure", str(tmp_path / "hand.png"), "--out", str(tmp_path / "hand.xlsx")]
    arguments = ["estimate", str(tmp_path / "session"), *outputs]
    assert main([*arguments, "--leave-out", str(tmp_path / "left_out.csv")]) == 0
    for shown in (drawn[0], checked[-1]):
        assert set(shown.trials["trial"]) == set(session.trials["trial"]) - {1, 2}


def with_copy_of(recording, row):
    """The recording with one of its trials a second time, under the next number."""
    start, end = recording.offsets[[row, row + 1]]
    copied = recording.trials.iloc[[row]].assign(trial=recording.n_trials + 1)
    samples = {
        name: np.concatenate([getattr(recording, name), getattr(recording, name)[start:end]])
        for name in ("time_s", "position", "force", "joint_angles")
    }
    return replace(
        recording,
        trials=pd.concat([recording.trials, copied], ignore_index=True),
        offsets=np.append(recording.offsets, recording.offsets[-1] + end - start),
        **samples,
    )


def test_a_page_without_a_copied_trial_says_that_with_it_there_is_no_estimate(tmp_path):
    conditions = ["cocontraction_10"]
    session, _ = simulate("cocontraction", seed=5, sets=1, conditions=conditions, emg=False)
    ai.write_recording(with_copy_of(session, 2), tmp_path / "twice")
    listed = tmp_path / "left_out.csv"
    listed.write_text(f"trial,why\n{session.n_trials + 1},a copy\n")
    with pytest.raises(ai.InputError, match="copies"):
        ai.estimate(tmp_path / "twice")
    ai.write_report(tmp_path / "twice", tmp_path / "page.html", leave_out=listed)
    assert "nothing can be estimated" in (tmp_path / "page.html").read_text()
