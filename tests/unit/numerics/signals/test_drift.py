"""What the drift operators must annihilate, keep, and what the source's version misses."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.response import correct_force_only, end_operator, ramp_basis

LAG = np.arange(-50, 351) / 1000


def ramp_projector(lag):
    q = ramp_basis(lag)
    return np.eye(len(lag)) - q @ q.T


def test_both_operators_annihilate_offset_and_ramp():
    ramp = 2.0 - 3.0 * LAG
    assert np.abs(ramp_projector(LAG) @ ramp).max() < 1e-12
    assert np.abs(end_operator(LAG, 50, 350) @ ramp).max() < 1e-12


def test_projector_is_a_projector():
    p = ramp_projector(LAG)
    assert np.allclose(p @ p, p, atol=1e-14)
    assert np.allclose(p, p.T)
    assert np.trace(p) == pytest.approx(len(LAG) - 2)


def test_end_operator_is_zero_at_both_ends_whatever_the_signal():
    signal = np.random.default_rng(1).normal(size=len(LAG))
    ended = end_operator(LAG, 50, 350) @ signal
    assert ended[50] == pytest.approx(0.0, abs=1e-12)
    assert ended[350] == pytest.approx(0.0, abs=1e-12)


def test_source_correction_is_equation_29():
    rng = np.random.default_rng(2)
    force = rng.normal(size=(3, len(LAG), 2))
    corrected = correct_force_only(force, LAG, 50, 350)
    relative = force - force[:, 50:51]
    r = (LAG - LAG[50]) / (LAG[350] - LAG[50])
    assert np.allclose(corrected, relative - r[None, :, None] * relative[:, 350:351])


def test_a_window_of_two_samples_is_refused():
    with pytest.raises(InputError, match="window of 2 samples"):
        ramp_basis(np.array([0.0, 0.001]))
