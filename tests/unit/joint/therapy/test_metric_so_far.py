"""The share so far: it ends at the whole movement's, and waits until arm and robot differ."""

from __future__ import annotations

import numpy as np
import pytest
from metric_bench import (
    MOVEMENTS,
    bench_arm,
    bench_elastic,
    bench_robot,
    helping,
    motion,
    no_errors,
    torques,
    true_arm,
)

from armimpedance.joint.therapy.share.of_movement import (
    STEADY_S,
    contribution_of,
    contribution_so_far,
)

METRICS = ("share", "projection")


@pytest.mark.parametrize("name", MOVEMENTS)
@pytest.mark.parametrize("metric", METRICS)
def test_the_last_sample_is_the_whole_movement(name, metric):
    arm, robot, m = bench_arm(), bench_robot(), motion(name)
    seen = torques(m, arm, 2 * np.sin(np.linspace(0, 5, len(m.q))))
    whole, so_far = contribution_of(seen, robot, arm), contribution_so_far(seen, robot, arm, metric)
    assert so_far.percent[-1] == pytest.approx(getattr(whole, metric).percent)
    assert so_far.sd[-1] == pytest.approx(getattr(whole, metric).sd)
    assert so_far.valid[-1] == getattr(whole, metric).valid


@pytest.mark.parametrize("name", MOVEMENTS)
def test_who_moves_arm_and_robot_is_given_the_arm_at_every_time(name):
    arm, robot, m = bench_arm(), bench_robot(), motion(name)
    own = true_arm(m, arm, no_errors(len(m.q)))
    so_far = contribution_so_far(torques(m, arm, own + m.inertia), robot, arm)
    known = ~np.isnan(so_far.percent) & (so_far.sd < 50)
    assert known.any()
    assert so_far.percent[known] == pytest.approx(100, abs=1e-6)
    # the bench's shoulder rests in the middle: about the vertical too little is left of tau_h
    assert so_far.valid[-1] == (name != "horizontal")
    assert not so_far.valid[0]


def test_an_arm_that_is_but_inertia_is_never_told_from_the_robot():
    line = bench_elastic("horizontal", stiffness=0.0, offset=0.0)
    arm = bench_arm(elastic=(bench_elastic("elevation"), line))
    m = motion("horizontal")
    so_far = contribution_so_far(helping(m, arm, 0.5), bench_robot(), arm)
    assert not so_far.valid.any()
    known = ~np.isnan(so_far.percent)
    assert (so_far.sd[known] >= 0).all()


def test_it_is_told_once_it_has_been_valid_for_a_fifth_of_a_second():
    """A heavy arm: nothing comes and goes."""
    arm, robot, m = bench_arm(), bench_robot(), motion("elevation")
    so_far = contribution_so_far(helping(m, arm, 0.5), robot, arm, "projection")
    first = np.flatnonzero(so_far.valid)[0]
    assert first >= round(STEADY_S * 1000) - 1
    assert so_far.valid[first:].all()
