"""What every estimator has to show: copy to ``tests/unit/hand/still/``, rename METHOD.

`limb` is a linear limb with known M, B, K (``tests/conftest.py``); it shares no code with us.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.show import Estimates
from armimpedance.hand.still.estimation import Options, estimate

METHOD = "my_estimator"


def _estimated(recording):
    return estimate(recording, options=Options(method=METHOD))[0]


def _error_of_stiffness(limb, recording):
    return np.linalg.norm(_estimated(recording).stiffness - limb.K) / np.linalg.norm(limb.K)


def test_the_truth_comes_back_without_noise(limb):
    made = _estimated(limb.record(sets=1))
    for found, true in ((made.inertia, limb.M), (made.viscosity, limb.B), (made.stiffness, limb.K)):
        assert np.linalg.norm(found - true) < 1e-3 * np.linalg.norm(true)


def test_intervals_hold_the_truth_as_often_as_they_promise(limb):
    """95 %, within four standard errors of 30: the elements of one K depend on each other."""
    held = []
    for seed in range(30):
        made = _estimated(limb.record(sets=3, force_noise=0.5, seed=seed))
        found = Estimates((made,))["c"].stiffness
        held.append(np.mean((found.low <= limb.K) & (found.high >= limb.K)))
    assert np.mean(held) > 0.95 - 4 * np.sqrt(0.95 * 0.05 / 30)


def test_turned_axes_turn_the_matrices(limb):
    recording = limb.record(sets=1, force_noise=0.1)
    c, s = np.cos(0.7), np.sin(0.7)
    R = np.array([[c, -s], [s, c]])
    turned = replace(recording, position=recording.position @ R.T, force=recording.force @ R.T)
    K = _estimated(recording).stiffness
    np.testing.assert_allclose(_estimated(turned).stiffness, R @ K @ R.T, rtol=1e-6, atol=1e-6)


def test_the_assumption_matters(limb):
    """A virtual position that drifts breaks what `assumes` states, and moves the result."""
    drifting = limb.record(sets=1, drift=0.05)
    assert _error_of_stiffness(limb, drifting) > 0.1
    assert _error_of_stiffness(limb, limb.record(sets=1)) < 1e-3


def test_what_it_cannot_run_on_is_refused(limb):
    recording = limb.record(sets=1)
    with pytest.raises(InputError):
        _estimated(replace(recording, position=np.full_like(recording.position, 0.3)))
