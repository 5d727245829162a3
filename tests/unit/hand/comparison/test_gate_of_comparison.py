"""An inertia that changes between conditions of one posture: something else changed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armimpedance.hand.comparison.show import compare
from manipulandum_sim.hand import simulate
from manipulandum_sim.hand.robot import IDEAL


def test_a_gain_that_changes_between_conditions_is_told_by_the_inertia():
    names = ["cocontraction_05", "cocontraction_30"]
    recording, _ = simulate(
        "cocontraction", seed=3, sets=2, conditions=names, emg=False, servo=IDEAL
    )
    assert not compare(recording, permutations=9).warnings
    second = (recording.trials["condition"] == names[1]).to_numpy()
    gain = np.where(np.repeat(second, np.diff(recording.offsets)), 1.3, 1.0)
    changed = replace(recording, force=gain[:, None] * recording.force)
    told = compare(changed, permutations=9).warnings
    assert [sentence.split(":")[0] for sentence in told] == ["recording 1", "inertia"]
    assert "session: inertia" in told[0]
