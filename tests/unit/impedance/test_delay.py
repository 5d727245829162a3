"""A force or a position that comes late is found and named."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.impedance.delay import check_delay


def _late(samples, by):
    parts = samples.reshape(16, -1, samples.shape[1])
    return np.roll(parts, by, axis=1).reshape(samples.shape)


@pytest.fixture(scope="module")
def sound(limb):
    return limb.record(sets=2, force_noise=0.03)


def test_no_delay_is_no_warning(sound):
    assert check_delay(sound)[0].verdict == "ok"


@pytest.mark.parametrize("by", [1, 4])
def test_late_force(sound, by):
    check = check_delay(replace(sound, force=_late(sound.force, by)))[0]
    assert check.verdict == "warning"
    found = float(check.message.split()[1])
    assert "force" in check.message
    assert found == pytest.approx(by, abs=0.3)


def test_late_kinematics(sound):
    check = check_delay(replace(sound, position=_late(sound.position, 3)))[0]
    assert "kinematics" in check.message
    assert float(check.message.split()[1]) == pytest.approx(3.0, abs=0.3)
