"""Therapy robot, passive arm and contribution against the simulator's truth: one small session.

Faster and shorter than the source's, for the sake of time. A tolerance of four standard errors is
that of the estimate itself: its own statement of what it does not know.
"""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.joint.therapy.arm.calibrate import identify_arm
from armimpedance.joint.therapy.arm.mockup import check_mockup, pipes
from armimpedance.joint.therapy.arm.movements import movement_torques
from armimpedance.joint.therapy.arm.passive_arm import segments_of
from armimpedance.joint.therapy.robot.calibrate import identify_robot
from armimpedance.joint.therapy.robot.steady import slides
from armimpedance.joint.therapy.share.of_movement import contribution_of
from armimpedance.lab.simulated.therapy import drawings_of
from manipulandum_sim.therapy.device import therapy_device

STANDARD_ERRORS = 4.0
#: What the conditions ask of an able-bodied person, %.
ASKED = {"passive": 0.0, "half_active": 50.0, "active": 100.0}


@pytest.fixture(scope="module")
def robot(therapy_calibration):
    """The calibration and its truth."""
    recording, truth = therapy_calibration
    return identify_robot(recording, drawings_of(therapy_device())), truth


@pytest.fixture(scope="module")
def session(robot, therapy_able):
    """The recording, the arm's calibration, movements and contributions, the truth."""
    (recording, truth), identified = therapy_able, robot[0].robot
    calibration = identify_arm(recording, identified, segments_of(recording.subject))
    movements = movement_torques(recording, identified, calibration.arm)
    found = [contribution_of(m, identified, calibration.arm) for m in movements]
    return recording, calibration, movements, found, truth


def test_friction_and_cables_come_back(robot):
    calibration, truth = robot
    loads, cables = calibration.robot.identified, truth.cable_stiffness > 0
    np.testing.assert_allclose(loads.term("coulomb"), truth.coulomb, rtol=0.01)
    stiffness = loads.term("cable_stiffness")
    np.testing.assert_allclose(stiffness[cables], truth.cable_stiffness[cables], rtol=0.03)
    assert not stiffness[~cables].any()
    rest = np.rad2deg(loads.cable_rest_rad - truth.cable_rest_rad)
    assert np.abs(rest[cables]).max() < 1.0


def test_viscous_friction_lies_within_its_own_interval(robot):
    calibration, truth = robot
    found = [p for p in calibration.summary.parameters if p.name == "k_v"]
    for parameter, true in zip(found, truth.viscous, strict=True):
        # what static friction has not quite died away at the lowest speed: .3 % of tau_c a rad/s
        allowed = STANDARD_ERRORS * parameter.sd_robust
        allowed += 0.003 * truth.coulomb[parameter.joint - 1] / np.deg2rad(30)
        assert abs(parameter.value - true) < allowed


def test_the_spring_comes_back_over_the_whole_range(robot):
    calibration, truth = robot
    spring = np.polynomial.Polynomial(calibration.robot.identified.spring)
    off = spring(truth.spring_angle_rad) - truth.spring_Nm
    assert np.sqrt((off**2).mean()) < 0.5


@pytest.mark.study
def test_pipes_weigh_what_they_weigh(robot, therapy_mockup):
    recording, _ = therapy_mockup
    check = check_mockup(recording, robot[0].robot, pipes())
    assert check.gravity.value == pytest.approx(10.66, rel=0.01)
    assert check.inertia.value == pytest.approx(check.inertia_model_kgm2, rel=0.01)
    assert check.inertia_model_kgm2 == pytest.approx(0.450, rel=0.01)


def test_stiffness_and_rest_angle_lie_within_their_own_intervals(session):
    _, calibration, _, _, truth = session
    for axis in calibration.axes:
        assert axis.elastic.repeatable
        for parameter, true in ((axis.stiffness, truth.stiffness), (axis.rest, truth.rest_rad)):
            off = parameter.value - true[:, axis.axis].mean()
            assert abs(off) < STANDARD_ERRORS * parameter.sd_robust


def truth_of(recording, truth, movement, rise_rad_s):
    """(4), the projection and the share, %, of the exact torques where the axis slides."""
    row = int(np.flatnonzero(recording.trials["trial"].astype(str) == movement.trial)[0])
    counts = slides(movement.qd, rise_rad_s)
    at = truth.samples_at(row, movement.time_s[counts])
    true = truth.motion.contribution(movement.axis, at, movement.robot_inertia[counts])
    return {"ratio": true.ratio, "projection": true.projection, "share": true.share}


@pytest.fixture(scope="module")
def contributions(robot, session):
    """Pairs of a movement's contribution and its truth."""
    recording, _, movements, found, truth = session
    rise = robot[0].robot.identified.rise_rad_s
    exact = [truth_of(recording, truth, m, float(rise[m.axis])) for m in movements]
    return list(zip(found, exact, strict=True))


def test_contributions_lie_within_their_own_intervals(contributions):
    for result, exact in contributions:
        label = f"{result.condition} {result.movement} {result.trial}"
        for name, true in exact.items():
            off = getattr(result, name).percent - true
            assert abs(off) < STANDARD_ERRORS * getattr(result, name).sd, (label, name)


def test_every_condition_of_elevation_comes_out_within_three_points(contributions):
    # of what the person truly gave: who moves freely does not give 100 %, 106 with another seed
    for condition, asked in ASKED.items():
        pairs = [p for p in contributions if p[0].condition == condition]
        own = [p for p in pairs if p[0].movement == "elevation"]
        assert len(own) == 3
        for result, exact in own:
            assert result.ratio.valid
            assert result.share.valid
            for name in ("ratio", "share"):
                assert getattr(result, name).percent == pytest.approx(exact[name], abs=3.0)
                assert exact[name] == pytest.approx(asked, abs=15.0)


def test_the_reference_agrees_where_both_are_valid(contributions):
    half = [r for r, _ in contributions if r.condition == "half_active" and r.reference_valid]
    assert "elevation" in {r.movement for r in half}
    for result in half:
        off = result.ratio.percent - result.reference.percent
        assert abs(off) < STANDARD_ERRORS * np.hypot(result.ratio.sd, result.reference.sd)
