"""The picture of `estimate` shows trials that were estimated, none that was left out by hand."""

from __future__ import annotations

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.hand.still.show import plot
from manipulandum_sim.hand import simulate


def test_no_trial_that_was_left_out_is_drawn(tmp_path, monkeypatch):
    session, _ = simulate("cocontraction", seed=5, sets=1, conditions=["cocontraction_10"])
    ai.write_recording(session, tmp_path / "session")
    (tmp_path / "left_out.csv").write_text("trial,why\n1,coughed\n2,coughed\n")
    drawn = []
    real = plot.plot_motion_and_force
    monkeypatch.setattr(
        plot, "plot_motion_and_force", lambda *given: drawn.append(given[0]) or real(*given)
    )
    arguments = ["estimate", str(tmp_path / "session"), "--figure", str(tmp_path / "hand.png")]
    assert main([*arguments, "--leave-out", str(tmp_path / "left_out.csv")]) == 0
    assert set(drawn[0].trials["trial"]) == set(session.trials["trial"]) - {1, 2}
