"""EMG: what rectifying and smoothing must give, and refusals."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.emg.activation import activation, envelope

RATE = 1000.0


def test_envelope_of_gaussian_noise_is_its_mean_absolute_value():
    """E|x| = sd sqrt(2/pi); the 1 Hz envelope averages about 0.4 s, so 60 s give some 150
    independent values: tolerance 4 standard errors of that mean."""
    rng = np.random.default_rng(3)
    raw = 0.2 + rng.normal(0, 0.5, size=(60_000, 2))
    smooth = envelope(raw, RATE)
    expected = 0.5 * np.sqrt(2 / np.pi)
    error = 0.5 * np.sqrt(1 - 2 / np.pi) / np.sqrt(60_000)
    assert np.abs(smooth[2000:-2000].mean(axis=0) - expected).max() < 4 * error
    assert (smooth >= 0).all()


def test_envelope_follows_doubled_activity():
    rng = np.random.default_rng(4)
    t = np.arange(20_000) / RATE
    raw = rng.normal(size=20_000) * np.where(t < 10, 1.0, 2.0)
    smooth = envelope(raw, RATE)
    # Half a per cent: the standard error of a mean over 6000 white samples, times some 5.
    assert smooth[13_000:19_000].mean() / smooth[1000:7000].mean() == pytest.approx(2.0, rel=0.05)


def test_activation_is_the_share_of_the_mvc():
    assert activation(np.array([[0.1, 0.3]]), np.array([1.0, 0.5])) == pytest.approx(
        np.array([[0.1, 0.6]])
    )


def test_activation_above_mvc_is_clipped_then_refused():
    assert activation(np.array([1.1]), np.array([1.0])) == pytest.approx([1.0])
    with pytest.raises(InputError, match="activation 3.00 of muscle 2"):
        activation(np.array([[0.1, 3.0]]), np.array([1.0, 1.0]))


@pytest.mark.parametrize("mvc", [0.0, -1.0, float("nan")])
def test_bad_mvc_is_refused(mvc):
    with pytest.raises(InputError, match="MVC"):
        activation(np.array([0.1]), np.array([mvc]))


def test_too_short_a_record_is_refused():
    with pytest.raises(InputError, match="EMG record of"):
        envelope(np.zeros(500), RATE)
