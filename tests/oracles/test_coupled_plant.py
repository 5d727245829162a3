"""The simulator's integration against the same machine in joint space and scipy's odeint."""

import numpy as np
import pytest
from joint_space_plant import JointSpacePlant
from scipy.integrate import odeint

from manipulandum_sim.hand.arm_plant import Arm
from manipulandum_sim.hand.coupled import CoupledPlant, integrate
from manipulandum_sim.hand.equilibrium import muscle_command
from manipulandum_sim.hand.experiments import Condition, hand_force, nominal_hand
from manipulandum_sim.hand.rig import RATE_HZ, Rig
from manipulandum_sim.hand.robot import Servo, servo_gains
from manipulandum_sim.hand.schedule import Run, make_schedule
from manipulandum_sim.hand.subjects import SUBJECTS
from manipulandum_sim.hand.trials import Batch, make_course
from manipulandum_sim.hand.truth import find_truth


def bump(duration, amplitude):
    def profile(time):
        s = time / duration
        if not 0 < s < 1:
            return 0.0, 0.0, 0.0
        w = s * (1 - s)
        velocity = 192 * w * w * (1 - 2 * s)
        acceleration = 384 * w * ((1 - 2 * s) ** 2 - w)
        return (
            amplitude * 64 * w**3,
            amplitude * velocity / duration,
            amplitude * acceleration / duration**2,
        )

    return profile


@pytest.fixture(scope="module", params=["stiff_relaxed", "soft_pushing_and_drifting"])
def case(request):
    arm = Arm.of(SUBJECTS["A"])
    relaxed = request.param == "stiff_relaxed"
    servo = Servo(20_000.0) if relaxed else Servo(2_000.0, 0.3, inertia_feedforward=False)
    rig = Rig(servo=servo, noise="none", emg=False, duration_s=0.2)
    force = (0.0, 0.0) if relaxed else hand_force(2.0, 135)
    truth = find_truth(
        arm, [Condition("c", nominal_hand(SUBJECTS["A"]), force)], handle_mass_kg=0.164
    )
    schedule = make_schedule(3, [Run(0, "c", (1, 0))], 1)
    batch = Batch(arm, rig, truth, schedule, np.arange(3))
    q, a = truth.posture[[0, 0, 0]], truth.activation[[0, 0, 0]]
    drift = None if relaxed else np.array([[0.01, -0.02], [-0.02, 0.0], [0.03, 0.01]])
    plant = CoupledPlant(
        arm,
        rig.robot,
        muscle_command(arm, q, a, drift=drift),
        servo_gains(rig.robot, servo, truth.hand[[0, 0, 0]], truth.force[[0, 0, 0]], 0.164),
        0.164,
    )
    return plant, make_course(batch), rig


def test_fixed_step_runge_kutta_agrees_with_odeint_in_joint_space(case):
    plant, course, rig = case
    track = integrate(plant, course, rig.samples, rig.steps_per_sample)
    times = np.arange(rig.samples) / RATE_HZ
    for trial in range(3):
        onset = course.onset[trial] * course.step_s
        oracle = JointSpacePlant(
            plant,
            trial,
            onset,
            course.place[:, trial],
            course.direction[:, trial],
            bump(rig.duration_s, rig.amplitude_m),
        )
        states = odeint(
            oracle.rate,
            oracle.start(),
            times,
            rtol=1e-12,
            atol=1e-13,
            tcrit=[onset, onset + rig.duration_s],
            mxstep=10_000,
        )
        hand = np.array([oracle.arm.position(*state[:2]) for state in states])
        moved = np.abs(hand - course.place[:, trial]).max()
        assert moved > 1e-3
        # 1 m at the hand is about 3 rad at the joints: 1e-8 rad
        assert np.abs(track.position[:, :, trial] - hand).max() < 3e-9
