"""Picture and checks of `estimate` are of the trials that were estimated, of none left out."""

from __future__ import annotations

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
