"""Five relaxed joints of one arm at once, from markers (the poster's simultaneous estimation)."""

from __future__ import annotations

import pytest

from armimpedance.joint.relaxed.identify import identify_passive
from armimpedance.joint.relaxed.passive_fit import summary_of
from armimpedance.joint.relaxed.samples import from_motion
from armimpedance.limb.mocap.joint_motion import joint_motion
from manipulandum_sim.passive.swing import simulate_passive

pytestmark = pytest.mark.study


@pytest.fixture(scope="module")
def fitted():
    markers, truth = simulate_passive("p5", subject="whole-arm", seed=3, duration_s=12.0)
    samples = from_motion(joint_motion(markers).motion, truth.joints)
    rest = dict(zip(truth.joints, truth.q_r.tolist(), strict=True))
    return identify_passive(samples, rest_angle=rest, cross_validate=False), truth


def test_every_joint_is_near_its_truth(fitted):
    fits, truth = fitted
    assert len(fits) == 5
    for i, fit in enumerate(fits):
        k, h, f = (fit.parameters[name] for name in "khf")
        # one trial of 12 s; the slack beyond four standard errors is the filter's own bias
        assert k.value == pytest.approx(truth.k[i], rel=0.02, abs=4 * k.sd_robust)
        assert h.value == pytest.approx(truth.h[i], abs=0.1 * truth.h[i] + 4 * h.sd_robust)
        assert f.value == pytest.approx(truth.f[i], abs=0.005 + 4 * f.sd_robust)


def test_stiff_and_soft_joints_are_told_apart(fitted):
    fits, truth = fitted
    found = [fit.parameters["k"].value for fit in fits]
    assert sorted(range(5), key=found.__getitem__) == sorted(range(5), key=truth.k.__getitem__)


def test_one_summary_numbers_the_joints(fitted):
    fits, _ = fitted
    parameters = summary_of(fits).parameters
    assert [(p.name, p.joint) for p in parameters[:4]] == [("k", 1), ("h", 1), ("f", 1), ("k", 2)]
    assert {p.joint for p in parameters} == {1, 2, 3, 4, 5}
