"""Therapy robot, passive arm and contribution against the simulator's truth: one small session.

Faster and shorter than the source's, for the sake of time. A tolerance of four standard errors is
that of the estimate itself: its own statement of what it does not know.
"""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.cli.simulate_therapy import drawings_of
from armimpedance.contribution.calibrate import identify_robot
from armimpedance.contribution.metric import contribution_of
from armimpedance.contribution.mockup import check_mockup, source_mockup
from armimpedance.contribution.movements import movement_torques
from armimpedance.contribution.passive_arm import identify_arm
from armimpedance.contribution.person import segments_of
from armimpedance.contribution.sliding import slides
from manipulandum_sim.therapy_calibration import simulate_calibration
from manipulandum_sim.therapy_device import therapy_device
from manipulandum_sim.therapy_mockup import simulate_mockup
from manipulandum_sim.therapy_session import simulate_therapy

STANDARD_ERRORS = 4.0
SEED = 3
#: What the conditions ask of an able-bodied person, %.
ASKED = {"passive": 0.0, "half_active": 50.0, "active": 100.0}


@pytest.fixture(scope="module")
def robot():
    """The calibration and its truth."""
    recording, truth = simulate_calibration(
        seed=SEED, speeds_deg_s=(10.0, 20.0, 40.0), held_angles=5
    )
    return identify_robot(recording, drawings_of(therapy_device())), truth


@pytest.fixture(scope="module")
def session(robot):
    """The arm's calibration, the session's movements and contributions, its truth."""
    recording, truth = simulate_therapy(
        subject="S1", seed=SEED, conditions=tuple(ASKED), speed_deg_s=60.0
    )
    identified = robot[0].robot
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


def test_pipes_weigh_what_they_weigh(robot):
    recording, _ = simulate_mockup(seed=SEED, speed_deg_s=60.0, horizontal_deg_s=60.0)
    check = check_mockup(recording, robot[0].robot, source_mockup())
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


def true_sums(recording, truth, movement, rise_rad_s):
    """Person's and passive arm's torque and the robot's inertia torque where the axis slides."""
    row = int(np.flatnonzero(recording.trials["trial"].astype(str) == movement.trial)[0])
    samples = recording.samples_of(row)
    first = samples.start + np.searchsorted(recording.time_s[samples], movement.time_s[0] - 5e-4)
    rows = first + np.flatnonzero(slides(movement.qd, rise_rad_s))
    inertia = movement.robot_inertia[rows - first]
    return truth.motion.user[rows, movement.axis], truth.motion.tau_h[rows, movement.axis], inertia


def test_contributions_lie_within_their_own_intervals(robot, session):
    recording, _, movements, found, truth = session
    rise = robot[0].robot.identified.rise_rad_s
    for movement, result in zip(movements, found, strict=True):
        user, arm, inertia = true_sums(recording, truth, movement, float(rise[movement.axis]))
        # user (S,) = [tau_h, robot's inertia] (S, 2) (c, d) (2,), normal equations of the truth
        W = np.stack([arm, inertia], axis=1)
        share = 100 * np.linalg.solve(W.T @ W, W.T @ user)[0]
        label = f"{result.condition} {result.movement} {result.trial}"
        for name, true in (
            ("ratio", 100 * user.sum() / arm.sum()),
            ("projection", 100 * (user @ arm) / (arm @ arm)),
            ("share", share),
        ):
            off = getattr(result, f"{name}_percent") - true
            assert abs(off) < STANDARD_ERRORS * getattr(result, f"{name}_sd"), (label, name)


def test_an_able_bodied_person_comes_out_as_the_condition_asks(session):
    *_, found, truth = session
    for condition, asked in ASKED.items():
        own = [r for r in found if (r.condition, r.movement) == (condition, "elevation")]
        assert len(own) == 3
        assert all(r.ratio_valid and r.share_valid for r in own)
        assert np.mean([r.share_percent for r in own]) == pytest.approx(asked, abs=3.0)
        assert np.mean([r.ratio_percent for r in own]) == pytest.approx(asked, abs=3.0)
    for result in found:
        # (4) and (19) agree where both are valid, if the masses are right to 3 %
        if result.reference_valid and result.condition == "half_active":
            spread = np.hypot(result.ratio_sd, result.reference_sd)
            off = result.ratio_percent - result.reference_percent
            assert abs(off) < STANDARD_ERRORS * spread
