"""Stochastic perturbations of a known joint."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.hand.still.estimation import Options, estimate
from armimpedance.hand.still.show import estimate as estimate_verb
from armimpedance.numerics.regression import t_factor

I_TRUE, B_TRUE, K_TRUE = 0.017, 1.2, 110.0
RATE = 1000.0


def _joint(seconds=30, noise=0.0, seed=0):
    """A joint driven through a known band-limited motion; torque from its own derivatives."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * RATE)) / RATE
    frequencies = np.arange(0.5, 50.0, 0.5)
    amplitude = 0.01 / np.sqrt(len(frequencies)) / (1 + (frequencies / 15) ** 2)
    phase = rng.uniform(0, 2 * np.pi, len(frequencies))
    omega = 2 * np.pi * frequencies
    argument = np.outer(t, omega) + phase
    q = np.cos(argument) @ amplitude
    qd = -np.sin(argument) @ (amplitude * omega)
    qdd = -np.cos(argument) @ (amplitude * omega**2)
    torque = -(I_TRUE * qdd + B_TRUE * qd + K_TRUE * q) + rng.normal(0, noise, len(t))
    return Recording(
        kind="joint",
        sample_rate_hz=RATE,
        trials=pd.DataFrame({"trial": [1], "condition": ["c"], "onset_s": [0.0]}),
        offsets=np.array([0, len(t)]),
        time_s=t,
        position=0.3 + q[:, None],
        force=2.0 + torque[:, None],
        perturbation="stochastic",
    )


def _values(made):
    return np.array([made.inertia[0, 0], made.viscosity[0, 0], made.stiffness[0, 0]])


TRUE = np.array([I_TRUE, B_TRUE, K_TRUE])


def test_noise_free_joint_is_recovered():
    made = estimate(_joint())[0]
    assert _values(made) == pytest.approx(TRUE, rel=1e-3)
    assert made.quality.coherence > 0.99
    assert made.warnings == ()


def test_noise_stays_within_the_interval():
    """White torque noise as large as the torque itself: four standard errors."""
    made = estimate(_joint(seconds=60, noise=0.3))[0]
    assert (np.abs(_values(made) - TRUE) < 4 * made.sd.ravel()).all()
    assert (made.sd.ravel() < 0.1 * TRUE).all()


def test_low_coherence_is_flagged():
    made = estimate(_joint(noise=3.0))[0]
    assert any("low coherence" in warning for warning in made.warnings)


def test_a_short_trial_is_refused():
    with pytest.raises(InputError, match="trial 1 lasts 3.00 s"):
        estimate(_joint(seconds=3))


def test_a_band_beyond_nyquist_is_refused():
    with pytest.raises(InputError, match="cut-off 5 to 700 Hz"):
        estimate(_joint(), options=Options(band_hz=(5.0, 700.0)))


def test_a_trial_must_outlast_the_ringing_of_a_low_band():
    with pytest.raises(InputError, match=r"trial 1 lasts 30.00 s.*at least 44.0 s"):
        estimate(_joint(), options=Options(band_hz=(0.05, 45.0)))


@pytest.mark.parametrize("band", [(0.0, 45.0), (45.0, 5.0)])
def test_an_empty_band_is_refused(band):
    with pytest.raises(InputError, match="0 < low < high"):
        estimate(_joint(), options=Options(band_hz=band))


def test_the_sign_convention_is_that_of_the_limb():
    recording = _joint()
    made = estimate(replace(recording, force=-recording.force))[0]
    assert _values(made) == pytest.approx(-TRUE, rel=1e-3)
    assert any("not positive definite" in warning for warning in made.warnings)


def test_what_the_band_decides_is_said_and_held():
    """A limb whose torque lags: its lower and its upper half give stiffnesses that differ."""
    made = _joint(seconds=60, noise=0.02)
    late = np.concatenate([np.zeros(60), made.position[:-60, 0] - made.position[:-60, 0].mean()])
    answering = replace(made, force=made.force - 60.0 * late[:, None])
    with_band = [estimate(one)[0] for one in (made, answering)]
    said = [any("band decides" in warning for warning in one.warnings) for one in with_band]
    assert said == [False, True]
    halves = [
        estimate(answering, options=Options(band_hz=band))[0].stiffness[0, 0]
        for band in ((5.0, 15.0), (15.0, 45.0))
    ]
    half = t_factor(with_band[1].dof) * with_band[1].sd[2, 0, 0]
    assert np.abs(np.array(halves) - with_band[1].stiffness[0, 0]).max() <= half


def test_one_joint_goes_to_elbow_unless_a_band_is_given():
    with pytest.raises(InputError, match="elbow"):
        estimate_verb(_joint())
    made = estimate_verb(_joint(), band_hz=(5, 45))[0]
    assert _values(made) == pytest.approx(TRUE, rel=1e-3)
