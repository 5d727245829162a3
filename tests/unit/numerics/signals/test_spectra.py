"""Coherence of known systems."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.spectra import multiple_coherence

RATE = 500.0


def test_a_noise_free_linear_system_is_fully_coherent():
    rng = np.random.default_rng(0)
    x = rng.normal(size=(30_000, 2))
    force = x @ np.array([[1.0, 2.0], [-0.5, 1.0]]).T
    found = multiple_coherence(x, force, RATE)
    assert found.mean(5, 200) == pytest.approx(1.0, abs=1e-6)


def test_known_noise_gives_known_coherence():
    """Unit signal plus unit noise: coherence 1/2. About 120 segments: se of each bin near .05,
    of the mean over some 200 bins below .01; tolerance three of those."""
    rng = np.random.default_rng(1)
    x = rng.normal(size=(30_000, 1))
    found = multiple_coherence(x, x + rng.normal(size=x.shape), RATE)
    assert found.mean(5, 200) == pytest.approx(0.5, abs=0.03)


def test_independent_force_is_incoherent():
    """With n segments and no relation the expected coherence is of order 1/n."""
    rng = np.random.default_rng(2)
    found = multiple_coherence(rng.normal(size=(30_000, 1)), rng.normal(size=(30_000, 1)), RATE)
    assert found.mean(5, 200) < 4 / found.segments


def test_a_short_record_is_refused():
    with pytest.raises(InputError, match="for a coherence"):
        multiple_coherence(np.zeros((600, 1)), np.zeros((600, 1)), RATE)
