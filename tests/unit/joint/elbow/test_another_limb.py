"""A limb that no kind of the model describes: named, and never a narrow interval about nonsense."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.joint.elbow import JointSamples, identify_elbow

RATE_HZ, SECONDS = 1000.0, 10.0


def record(seed: int, impedance) -> JointSamples:
    """Torque through a limb of this impedance, periodic over twice the record, 30 dB."""
    rng = np.random.default_rng(seed)
    n = round(RATE_HZ * SECONDS)
    f = np.fft.rfftfreq(2 * n, 1 / RATE_HZ)
    torque = np.fft.rfft(rng.standard_normal(2 * n)) / np.sqrt(1 + (f / 10) ** 8)
    torque[0] = 0.0
    angle = torque / impedance(2j * np.pi * np.where(f > 0, f, 1.0))
    tau, theta = (np.fft.irfft(x, 2 * n)[:n] for x in (torque, angle))
    tau, theta = tau / tau.std(), theta / tau.std()
    noise = 10 ** (-30 / 20) * rng.standard_normal((2, n))
    channels = (tau + noise[0] * tau.std(), theta + noise[1] * theta.std())
    return JointSamples(RATE_HZ, ("1",), np.array([0, n]), *channels, imposed="torque")


def rigid(s):
    return 0.07 * s**2 + 1.2 * s + 20.0


def strapped(s):
    """The same limb behind soft tissue of 150 N m/rad."""
    return 1 / (1 / rigid(s) + 1 / (150 + s))


@pytest.mark.first_cases(1)
@pytest.mark.parametrize("seed", range(3))
def test_a_soft_strap_is_named_and_its_interval_holds_the_limb(seed):
    fit = identify_elbow(record(seed, strapped))
    assert "band" in [check.name for check in fit.checks if check.verdict == "warning"]
    low, high = fit.parameters.interval().T
    assert ((low < [0.07, 1.2, 20.0]) & (high > [0.07, 1.2, 20.0])).all()
    assert (fit.parameters.values > 0).all()


def test_a_limb_of_second_order_is_the_same_in_all_parts_of_the_band():
    checks = identify_elbow(record(7, rigid)).checks
    assert [check.verdict for check in checks if check.name == "band"] == ["ok"]
