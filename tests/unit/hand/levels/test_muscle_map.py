"""Joint -> muscle for one estimate: truth of a simulated subject, warnings, refusals."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.conventions import MUSCLES
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.hand.levels.muscle_map import curvature_term, joint_stiffness, to_muscle
from armimpedance.limb.arm.muscular_arms import arm_named
from armimpedance.limb.arm.polynomial_paths import MuscularArm
from armimpedance.limb.arm.table_paths import TablePaths
from manipulandum_sim.hand.arm_plant import Arm
from manipulandum_sim.hand.experiments import Condition, hand_force, nominal_hand
from manipulandum_sim.hand.muscles import human_paths, joint_basis
from manipulandum_sim.hand.subjects import SUBJECTS
from manipulandum_sim.hand.truth import find_truth

#: Springs and dampers of the simulated joints' own tissue.
TISSUE_K, TISSUE_B = np.eye(2), 0.2 * np.eye(2)


@pytest.fixture(scope="module")
def truth():
    subject = SUBJECTS["A"]
    hand = nominal_hand(subject)
    forces = {
        f"{size:g} at {angle}": hand_force(size, angle)
        for size, angle in ((1.0, 0), (3.0, 90), (3.0, 270), (2.0, 135))
    }
    conditions = [Condition(name, hand, force) for name, force in forces.items()]
    conditions.append(Condition("co-contraction", hand, cocontraction=0.2))
    return find_truth(Arm.of(subject), conditions, handle_mass_kg=0.164)


@pytest.fixture(scope="module")
def simulated_arm():
    """The simulated subject's own muscles, as a lab's table would hold them."""
    shoulder, elbow = np.deg2rad(np.arange(0, 121, 10)), np.deg2rad(np.arange(30, 151, 10))
    S, E = np.meshgrid(shoulder, elbow, indexing="ij")
    arms = np.stack(human_paths().moment_arms(joint_basis(S, E)), axis=-1)
    paths = TablePaths(MUSCLES, shoulder, elbow, arms)
    top = np.array([700.0, 700, 700, 700, 350, 400])
    return MuscularArm("simulated", paths, top, 75.0, paths.angle_range, "the simulator")


def estimate(truth, row, **changes):
    """The truth as an estimate of 40 trials, symmetric errors of 1 N m/rad and .05 N m s/rad."""
    swap = np.eye(4)[[0, 2, 1, 3]]
    block = (np.eye(4) + swap) / 2
    J = hand_jacobian(truth, row)
    fields = {
        "level": "joint",
        "method": "truth",
        "inertia": truth.M_j[row],
        "viscosity": truth.B_j[row],
        "stiffness": truth.K_j[row],
        "covariance": np.kron(np.diag([1e-6, 0.05**2, 1.0]), block),
        "dof": 39,
        "quality": Quality(40, 1000, 0.98, 0.96, 10.0, 3.0, 12, 0.1),
        "keys": {"condition": truth.conditions[row]},
        "joint_angles": truth.posture[row],
        "torque": J.T @ truth.force[row],
    }
    return ImpedanceEstimate(**(fields | changes))


def hand_jacobian(truth, row):
    q1, q12 = truth.posture[row, 0], truth.posture[row].sum()
    u2 = 0.34 * np.array([np.cos(q12), np.sin(q12)])
    X = 0.30 * np.array([np.cos(q1), np.sin(q1)]) + u2
    return np.array([[-X[1], -u2[1]], [X[0], u2[0]]])


@pytest.mark.parametrize("row", range(5))
def test_the_true_muscles_lie_in_the_feasible_ranges(truth, simulated_arm, row):
    found = to_muscle(estimate(truth, row), simulated_arm)
    assert found.warnings == ()
    for share, true in (
        (found.stiffness, truth.muscle_stiffness[row]),
        (found.viscosity, truth.muscle_viscosity[row]),
    ):
        assert share.outside_se == 0
        for reach in share.single:
            assert reach.outer_low <= true @ reach.coefficients <= reach.outer_high
        for reach in share.groups:
            # a joint's own tissue works beside its single-joint muscles
            unit = {"shoulder_ss": 1, "elbow_ee": 1}.get(reach.name, 0)
            own = unit * (TISSUE_K[0, 0] if share is found.stiffness else TISSUE_B[0, 0])
            assert reach.outer_low <= true @ reach.coefficients + own <= reach.outer_high


@pytest.mark.parametrize("row", range(5))
def test_the_sums_are_the_muscles_own_with_the_curvature_of_all_tension(truth, simulated_arm, row):
    # static optimisation finds the tension that the torque shows; the subject's rest tension and
    # co-contraction are beyond it, and come through measured activation
    rest = np.array([18.0, 18.0, 17.0, 24.0, 16.0, 16.0])
    borne = -truth.G[row].T @ truth.tension[row]
    activation = truth.tension[row] / simulated_arm.max_tension
    assert (rest / simulated_arm.max_tension < activation + 1e-12).all()
    joint = estimate(truth, row, torque=borne)
    found = to_muscle(joint, simulated_arm, activation=activation)
    np.testing.assert_allclose(found.tension, truth.tension[row], atol=1e-3)
    own = joint_stiffness(truth.G[row], truth.muscle_stiffness[row]) + TISSUE_K
    sums = {c.name: c.value for c in found.stiffness.combinations}
    # the table's splines and the plant's differences: 1e-3 of a N m/rad
    assert [sums[n] for n in ("ss", "se", "ee")] == pytest.approx(
        own[[0, 0, 1], [0, 1, 1]], abs=5e-3
    )


def test_the_curvature_term_is_what_switching_it_off_changes(truth, simulated_arm):
    joint = estimate(truth, 1)
    on, off = (to_muscle(joint, simulated_arm, curvature=c) for c in (True, False))
    C = simulated_arm.paths.curvature(truth.posture[1])
    term = curvature_term(on.tension, C)
    assert np.abs(term).max() > 0.3
    change = [
        a.value - b.value
        for a, b in zip(off.stiffness.combinations, on.stiffness.combinations, strict=True)
    ]
    assert change == pytest.approx(term[[0, 0, 1], [0, 1, 1]])
    assert on.viscosity.combinations[0].value == off.viscosity.combinations[0].value
    assert "without the curvature term" in off.provenance[-1]


def test_a_recording_of_joints_gives_angles_and_torque(truth, simulated_arm):
    mapped = estimate(truth, 0)
    straight = replace(
        mapped, joint_angles=None, torque=None, position=mapped.joint_angles, force=mapped.torque
    )
    a, b = to_muscle(mapped, simulated_arm), to_muscle(straight, simulated_arm)
    np.testing.assert_array_equal(a.tension, b.tension)
    np.testing.assert_array_equal(a.joint_angles, b.joint_angles)


def test_what_is_not_known_is_left_out_and_said(truth, simulated_arm):
    found = to_muscle(estimate(truth, 0, torque=None), simulated_arm)
    assert found.tension is None
    assert any("torque unknown" in w for w in found.warnings)
    beyond = to_muscle(estimate(truth, 0, torque=[300.0, 0.0]), simulated_arm)
    assert beyond.tension is None
    assert any("at most" in w and "left out" in w for w in beyond.warnings)


def test_a_posture_that_the_arm_was_not_made_for(truth, simulated_arm):
    away = estimate(truth, 0, joint_angles=np.deg2rad([130.0, 20.0]))
    warned = to_muscle(away, arm_named("planar6")).warnings
    assert sum("extrapolated" in w for w in warned) == 2
    assert "shoulder at 130 degrees" in warned[0]
    with pytest.raises(InputError, match="outside of the table"):
        to_muscle(away, simulated_arm)


def test_an_impossible_stiffness_is_said_and_has_no_ranges(truth, simulated_arm):
    odd = estimate(truth, 0, stiffness=[[20.0, -9.0], [-9.0, 20.0]])
    found = to_muscle(odd, simulated_arm)
    assert not found.stiffness.possible
    assert found.viscosity.possible
    assert any("joint stiffness lies" in w and "no ranges" in w for w in found.warnings)


@pytest.mark.parametrize(
    "change",
    [{"level": "hand"}, {"joint_angles": None}, {"joint_angles": [1.0, 1.0, 1.0]}],
)
def test_estimates_that_cannot_be_mapped(truth, simulated_arm, change):
    with pytest.raises(InputError):
        to_muscle(estimate(truth, 0, **change), simulated_arm)


def test_one_joint_is_not_an_arm_of_two(simulated_arm):
    one = ImpedanceEstimate(
        "joint",
        "m",
        [[1.0]],
        [[1.0]],
        [[1.0]],
        np.eye(3),
        9,
        Quality(8, 100, 0.9, 0.9, 1.0, 1.0, 3, 0.1),
    )
    with pytest.raises(InputError, match="1 joints"):
        to_muscle(one, simulated_arm)
