"""The weak form: test functions that cannot see a drift, and what their support decides."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.still.estimation import Options, estimate
from armimpedance.hand.still.methods.weak_form import drift_free_splines, weak_rows
from armimpedance.numerics.regression.equations import solve_total
from armimpedance.numerics.signals.windows import cut_windows

WEAK = Options(method="weak_form")


@pytest.mark.parametrize("spacing", [2, 7, 27])
def test_test_functions_are_blind_to_offset_and_ramp(spacing):
    tests = drift_free_splines(601, 1000.0, spacing)
    t = np.arange(601) / 1000
    size = np.abs(tests.smooth).sum(axis=1)
    for drift in (np.ones_like(t), t - 0.3):
        for rows in (tests.smooth, tests.first, tests.second):
            scale = np.abs(rows).sum(axis=1).max()
            assert np.abs(rows @ drift).max() < 1e-11 * scale
    # nothing else is lost: as many functions as splines of degree 5 less the two
    assert np.linalg.matrix_rank(tests.smooth) == len(tests.smooth)
    assert (size > 0).all()


def test_derivatives_fall_on_the_test_functions():
    """Sums of psi x' and psi x'' of a smooth x equal what `first` and `second` make of x."""
    tests = drift_free_splines(601, 1000.0, 20)
    t = np.arange(601) / 1000
    w = 2 * np.pi * 4.0
    x, v, a = np.sin(w * t), w * np.cos(w * t), -(w**2) * np.sin(w * t)
    assert tests.first @ x == pytest.approx(tests.smooth @ v, abs=1e-6 * w)
    assert tests.second @ x == pytest.approx(tests.smooth @ a, abs=1e-6 * w**2)


def test_noise_free_gives_the_truth_whatever_the_drift_and_the_end(limb):
    recording = limb.record(sets=1, drift=0.05)
    recording = replace(recording, trials=recording.trials.assign(end_s=0.25 + 0.21))
    made = estimate(recording, options=WEAK)[0]
    assert np.linalg.norm(made.stiffness - limb.K) < 2e-3 * np.linalg.norm(limb.K)
    assert np.linalg.norm(made.inertia - limb.M) < 2e-3 * np.linalg.norm(limb.M)


def test_narrow_supports_let_encoder_steps_bias_the_inertia(limb):
    """What the method assumes: white position noise of 20 us takes more than 5 % off M behind
    splines of 0.04 s, less than 1 % behind those of 0.16 s."""
    recording = limb.record(sets=5)
    noise = np.random.default_rng(0).normal(0, 2e-5, recording.position.shape)
    window = cut_windows(replace(recording, position=recording.position + noise))

    def inertia(support_s):
        equations = weak_rows(window, "hand", support_s).trial_equations("hand")
        return solve_total(equations)[0]

    assert inertia(0.04) < 0.95 * limb.M[0, 0]
    assert abs(inertia(0.16) / limb.M[0, 0] - 1) < 0.01


def test_short_records_narrow_the_support_and_say_so(limb):
    recording = limb.record(sets=1, duration=0.1, before=0.03, after=0.03)
    made = estimate(recording, options=WEAK)[0]
    assert any("too short for a support" in note for note in made.provenance)
    assert np.linalg.norm(made.inertia - limb.M) < 0.02 * np.linalg.norm(limb.M)


def test_windows_without_room_for_test_functions_are_refused(limb):
    window = cut_windows(limb.record(sets=1, rate=100.0, before=0.02, after=0.02, duration=0.2))
    with pytest.raises(InputError, match="at least 31 samples"):
        weak_rows(window, "hand", 0.16)
