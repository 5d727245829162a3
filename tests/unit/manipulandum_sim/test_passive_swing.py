"""Laws of the simulated relaxed arm: Newton's, energy's, dry friction's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError, RecordError
from manipulandum_sim.passive.chain import Chain, base_motion
from manipulandum_sim.passive.segments import ELBOW, SHOULDER, WRIST, arm_skeleton
from manipulandum_sim.passive.subject import PASSIVE_SUBJECTS, PassiveJoint, passive_subject
from manipulandum_sim.passive.swing import simulate_passive, simulate_passive_many
from manipulandum_sim.passive.truth import PassiveTruth
from manipulandum_sim.tree_dynamics import inverse_dynamics, marker_positions, mass_matrix

ONE = PASSIVE_SUBJECTS["1"]


@pytest.fixture(scope="module", params=["whole-arm", "1"])
def shaken(request):
    """Recording and truth of a short test p5, made beside another."""
    return simulate_passive_many("p5", [0, 1], subject=request.param, trials=1, duration_s=0.5)[1]


@pytest.fixture(scope="module")
def released():
    return simulate_passive("release", trials=2, duration_s=1.0, seed=1)


def elbow_regressor(truth):
    """[q - q_r, qd, sign(qd)] of the elbow, and its torque."""
    j = truth.joints.index(ELBOW)
    q, qd = truth.q[:, truth.columns[j]], truth.qd[:, truth.columns[j]]
    return np.stack([q - truth.q_r[j], qd, np.sign(qd)], axis=1), truth.torque[:, j]


def scaled_condition(W):
    return np.linalg.cond(W / np.linalg.norm(W, axis=0))


def elbow_energy(subject, truth):
    """Kinetic, of gravity and of the spring, where only the elbow moves; the shoulder's heights."""
    fore = subject.skeleton.segments[-1]
    c, joint = truth.columns[0], subject.joints[ELBOW]
    q, qd = truth.q[:, c], truth.qd[:, c]
    lever = -fore.com_m[2]
    inertia = fore.inertia_kgm2[1, 1] + fore.mass_kg * lever**2
    # the upper arm points back: the forearm hangs down at q = 90 degrees
    height = -lever * np.cos(q - np.pi / 2)
    e = q - joint.q_r
    spring = joint.k * e**2 / 2 + joint.K * e**3 / 3
    return inertia * qd**2 / 2 + fore.mass_kg * 9.80665 * height + spring


@pytest.mark.parametrize("first", [1, 2])
@pytest.mark.parametrize("wrist", [False, True])
def test_the_chain_s_dynamics_are_newton_s_and_euler_s(first, wrist):
    skeleton = arm_skeleton(70.0, 1.74, wrist=wrist)
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 5, len(skeleton.coordinates)))
    chain = Chain(skeleton.segments[first:])
    free = slice(len(skeleton.coordinates) - len(chain.axes), None)
    qdd[:, free] = 0
    base = base_motion(skeleton, skeleton.segments[first - 1].name, q, qd, qdd)
    M, bias = chain.mass_and_bias(q[:, free], qd[:, free], base)
    np.testing.assert_allclose(M, mass_matrix(skeleton, q)[:, free, free], atol=1e-13)
    np.testing.assert_allclose(bias, inverse_dynamics(skeleton, q, qd, qdd)[:, free], atol=1e-12)


@pytest.mark.study
def test_what_moves_the_free_joints_is_the_passive_torque(shaken):
    recording, truth = shaken
    tau = inverse_dynamics(recording.skeleton, truth.q, truth.qd, truth.qdd)[:, truth.columns]
    np.testing.assert_allclose(tau, truth.torque, atol=1e-11)
    q, qd = truth.q[:, truth.columns], truth.qd[:, truth.columns]
    e = q - truth.q_r
    law = -(truth.k * e + truth.K * e**2 + truth.h * qd + truth.f * np.sign(qd))
    np.testing.assert_allclose(truth.torque[~truth.held], law[~truth.held], atol=1e-11)
    holds = np.abs(truth.torque - law)[truth.held]
    assert (holds <= np.broadcast_to(np.abs(truth.f), law.shape)[truth.held] + 1e-12).all()
    assert (qd[truth.held] == 0).all()


def test_exact_derivatives_give_the_joint_back(shaken, released):
    for _, truth in (shaken, released):
        W, tau = elbow_regressor(truth)
        j = truth.joints.index(ELBOW)
        moves = ~truth.held[:, j]
        # W (n, 3) [k h f] = -tau (n,)
        found = np.linalg.lstsq(W[moves], -tau[moves], rcond=None)[0]
        np.testing.assert_allclose(found, [truth.k[j], truth.h[j], truth.f[j]], rtol=1e-9)


@pytest.mark.study
def test_the_derivatives_are_those_of_the_motion():
    rate = 500.0
    _, truth = simulate_passive("p5", subject="whole-arm", duration_s=0.5, rate_hz=rate, seed=4)
    # a reversal's jump of the acceleration spoils two samples on either side
    free = np.array(truth.columns)
    turns = (np.diff(np.sign(truth.qd[:, free]), axis=0) != 0).any(axis=1)
    near = np.convolve(turns, np.ones(9), "same")[2:-1] > 0
    assert near.mean() < 0.5
    for value, slope, size in ((truth.q, truth.qd, 1e-6), (truth.qd, truth.qdd, 1e-4)):
        central = 8 * (value[3:-1] - value[1:-3]) - (value[4:] - value[:-4])
        difference = central / 12 * rate - slope[2:-2]
        assert np.abs(difference[~near[: len(difference)]]).max() < size


def test_an_arm_without_damping_keeps_its_energy():
    subject = ONE.with_joint(ELBOW, h=0.0, f=0.0, K=0.5)
    _, truth = simulate_passive("release", subject=subject, trials=1, duration_s=2.0)
    energy = elbow_energy(subject, truth)
    assert np.ptp(energy) < 1e-8


def test_viscosity_and_friction_take_what_the_energy_loses():
    _, truth = simulate_passive("release", trials=1, duration_s=1.0, rate_hz=500.0)
    qd = truth.qd[:, truth.columns[0]]
    power = truth.h[0] * qd**2 + truth.f[0] * np.abs(qd)
    lost = np.sum((power[1:] + power[:-1]) / 2) / 500.0
    energy = elbow_energy(ONE, truth)
    assert energy[0] - energy[-1] == pytest.approx(lost, rel=1e-4)


def test_friction_holds_the_forearm_where_it_can():
    subject = ONE.with_joint(ELBOW, f=1.0)
    _, truth = simulate_passive("release", subject=subject, trials=1, duration_s=2.0)
    W, _ = elbow_regressor(truth)
    last = truth.held[-30:]
    assert last.all()
    assert np.ptp(W[-30:, 0]) == 0
    # what holds it is within the friction's reach, the rest is gravity against the spring
    assert np.abs(truth.torque + truth.k * W[:, :1])[-30:].max() <= 1.0
    strong = ONE.with_joint(ELBOW, f=50.0)
    _, truth = simulate_passive("release", subject=strong, trials=1, duration_s=0.2)
    assert truth.held.all()
    assert np.ptp(truth.q[:, truth.columns[0]]) == 0


@pytest.mark.study
def test_negative_friction_is_a_limit_cycle():
    """Describing function: the power of f sign(qd), 4 f A w / (2 pi), is that of h qd^2 / 2."""
    h, f, rate = 0.15, -0.075, 250.0
    subject = ONE.with_joint(ELBOW, h=h, f=f, q_r=np.pi / 2)
    _, truth = simulate_passive("release", subject=subject, trials=1, duration_s=8.5, rate_hz=rate)
    fore, c = subject.skeleton.segments[-1], truth.columns[0]
    lever = -fore.com_m[2]
    inertia = fore.inertia_kgm2[1, 1] + fore.mass_kg * lever**2
    omega = np.sqrt((subject.joints[ELBOW].k + fore.mass_kg * 9.80665 * lever) / inertia)
    amplitude = 4 * abs(f) / (np.pi * h * omega)
    swing = truth.q[-round(1.5 * rate) :, c]
    assert np.ptp(swing) / 2 == pytest.approx(amplitude, rel=0.01)


@pytest.mark.study
def test_the_tests_excite_as_the_source_s_do():
    """The source prints 2.2 to 3.1; which condition number that is, see `passive_subject`."""
    for test, seconds in (("p5", 3.0), ("release", 8.0)):
        made = simulate_passive_many(test, range(4), duration_s=seconds, trials=1)
        conditions = [scaled_condition(elbow_regressor(truth)[0]) for _, truth in made]
        assert 2.2 <= np.mean(conditions) <= 3.1, test


def test_the_same_seed_gives_the_same_bits_and_another_one_does_not(released):
    recording, truth = released
    again, also = simulate_passive("release", trials=2, duration_s=1.0, seed=1)
    assert np.array_equal(recording.positions, again.positions)
    assert np.array_equal(recording.emg.signals, again.emg.signals)
    assert np.array_equal(truth.qdd, also.qdd)
    other, _ = simulate_passive("release", trials=2, duration_s=1.0, seed=2)
    assert np.abs(other.positions - recording.positions).max() > 1e-3


@pytest.mark.first_cases(1)
def test_a_recording_does_not_depend_on_those_simulated_beside_it(shaken):
    recording, truth = shaken
    name = truth.subject
    alone, same = simulate_passive("p5", seed=1, subject=name, trials=1, duration_s=0.5)
    np.testing.assert_allclose(same.q, truth.q, atol=1e-9)
    np.testing.assert_allclose(alone.positions, recording.positions, atol=1e-9)


def test_the_exact_motion_shows_the_markers(shaken):
    recording, truth = shaken
    motion = truth.motion(recording)
    exact = marker_positions(motion.skeleton, motion.coordinates)
    sd = (recording.positions - exact).std()
    values = exact.size
    assert sd == pytest.approx(0.5e-3, abs=4 * 0.5e-3 / np.sqrt(2 * values))
    with pytest.raises(RecordError, match="another skeleton"):
        truth.motion(replace(recording, skeleton=None))


def test_a_truth_survives_the_disk(tmp_path, released):
    _, truth = released
    truth.write(tmp_path / "truth.json")
    back = PassiveTruth.read(tmp_path / "truth.json")
    assert back.joints == truth.joints
    assert back.k == truth.k
    for name in ("q", "qd", "qdd", "torque", "held"):
        assert np.array_equal(getattr(back, name), getattr(truth, name))
    (tmp_path / "broken.json").write_text('{"test": "p5"}')
    with pytest.raises(InputError, match="not a passive truth"):
        PassiveTruth.read(tmp_path / "broken.json")
    with pytest.raises(InputError, match="not a passive truth"):
        PassiveTruth.read(tmp_path / "absent.json")


def test_anatomy_positive_where_the_names_say_so():
    skeleton = arm_skeleton(70.0, 1.74, wrist=True)
    hand = skeleton.marker_names.index("hand")

    def moved(hinge):
        q = np.zeros((2, len(skeleton.coordinates)))
        q[1, skeleton.coordinate(ELBOW)] = q[0, skeleton.coordinate(ELBOW)] = 0.5
        q[1, skeleton.coordinate(hinge)] += 0.1
        return np.diff(marker_positions(skeleton, q)[:, hand], axis=0)[0]

    assert moved("right_shoulder_flexion")[0] > 0
    assert moved("right_shoulder_abduction")[1] < 0
    assert moved("right_shoulder_rotation")[1] > 0
    assert moved(ELBOW)[2] > 0
    assert moved(WRIST)[2] > 0


def test_forearm_and_hand_apart_weigh_what_they_weigh_together():
    one, two = arm_skeleton(70.0, 1.74), arm_skeleton(70.0, 1.74, wrist=True)
    assert one.mass_kg == pytest.approx(two.mass_kg, rel=1e-12)
    # Winter's row for both against his rows for each: torque of the weight at the bent elbow
    torques = []
    for skeleton in (one, two):
        q = np.zeros((1, len(skeleton.coordinates)))
        q[0, skeleton.coordinate(ELBOW)] = np.pi / 2
        torques.append(inverse_dynamics(skeleton, q)[0, skeleton.coordinate(ELBOW)])
    assert torques[1] == pytest.approx(torques[0], rel=0.01)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"test": "p6"}, "no passive test 'p6'"),
        ({"subject": "9"}, "no passive subject '9'"),
        ({"trials": 0}, "0 trials"),
        ({"seed": -1}, "none negative"),
        ({"duration_s": 0.0}, "trials of 0.0 s"),
        ({"duration_s": np.nan}, "trials of nan s"),
        ({"rate_hz": 0.0}, "0.0 frames/s"),
        ({"marker_noise_m": -1.0}, "marker_noise_m is -1.0"),
        ({"dropout": 1.0}, "dropout is 1.0"),
        ({"emg_percent": -1.0, "duration_s": 0.1}, "EMG level -1.0 %"),
    ],
)
def test_what_makes_no_recording_is_refused_in_one_line(arguments, message):
    with pytest.raises(InputError, match=message) as caught:
        simulate_passive(**{"test": "release", **arguments})
    assert "\n" not in str(caught.value)


def test_a_subject_that_nobody_is_is_refused():
    with pytest.raises(InputError, match="height in m is 17.4"):
        passive_subject("giant", 70.0, 17.4, PassiveJoint())
    with pytest.raises(InputError, match="k and h >= 0"):
        ONE.with_joint(ELBOW, k=-1.0)
    with pytest.raises(InputError, match="no joint 'knee'"):
        ONE.with_joint("knee", k=1.0)
    with pytest.raises(InputError, match="one passive joint per hinge"):
        replace(ONE, joints={name: PassiveJoint() for name in SHOULDER})
