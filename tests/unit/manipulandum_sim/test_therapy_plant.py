"""Laws of the therapy robot's plant: Newton's, energy's, friction's; solvers of others agree."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from armimpedance.core.errors import ArmImpedanceError, EstimationError, InputError, RecordError
from armimpedance.limb.arm.skeleton_model import skeleton_model
from manipulandum_sim.therapy.device import RATE_HZ, therapy_device
from manipulandum_sim.therapy.dynamics import (
    Moments,
    Payload,
    inverse_dynamics,
    mass_and_bias,
)
from manipulandum_sim.therapy.friction import GIVE_RAD
from manipulandum_sim.therapy.plant import Motion, run

DEVICE = therapy_device()
#: Axis of a recording's column -> coordinate of the chain.
CHAIN = [DEVICE.axes.index(name) for name in DEVICE.skeleton.coordinates]
NEUTRAL = np.deg2rad([70.0, 30.0, 10.0, 50.0, 20.0])


def carried_skeleton(rng, upper_arm_m):
    """The robot's joints with an arm of random bodies on all links."""
    frame = DEVICE.adjusted_to(upper_arm_m).skeleton
    bodies = []
    for segment in frame.segments:
        half = rng.normal(size=(3, 3)) * 0.05
        bodies.append(
            replace(
                segment,
                mass_kg=float(rng.uniform(0.5, 3.0)),
                com_m=rng.normal(size=3) * 0.1,
                inertia_kgm2=half @ half.T + 0.01 * np.eye(3),
            )
        )
    return replace(frame, segments=tuple(bodies))


class Pd:
    """A gentle controller about a moving reference; elementwise."""

    gains = (np.array([900.0, 900, 300, 250, 60]), np.array([60.0, 60, 12, 10, 2]))

    def __init__(self, start, size=0.25, quick=10.0):
        still = np.zeros_like(start)
        self.start, self.size, self.quick = start, size, quick
        self.load = DEVICE.springs(start) + DEVICE.rigid_torque(start, still, still)

    def __call__(self, k, q, qd):
        time = max(k, 0) / RATE_HZ
        wanted = self.start + self.size * (1 - np.cos(self.quick * time))
        rate = self.quick * self.size * np.sin(self.quick * time) * (k >= 0)
        return self.load + self.gains[0] * (wanted - q) + self.gains[1] * (rate - qd)


@pytest.fixture(scope="module")
def loaded():
    """Three trials with payload, person and passive arm, through two reversals."""
    rng = np.random.default_rng(5)
    skeletons = [carried_skeleton(rng, length) for length in (0.28, 0.30, 0.34)]
    start = NEUTRAL + rng.normal(size=(3, 5)) * 0.05
    stiffness, rest = rng.uniform(1, 6, (3, 5)), rng.normal(size=(3, 5))
    push = rng.normal(size=(3, 5))
    scene = {
        "user": lambda t, _q, qd: push * np.sin(3 * t) - 0.5 * qd,
        "passive": lambda q, qd: stiffness * (q - rest) + 0.3 * qd,
    }
    payload = Payload.of_skeletons(skeletons)
    motion = run(DEVICE, payload, start, Pd(start), 700, run_in=50, measured=False, **scene)
    return skeletons, payload, start, motion, scene


@pytest.mark.parametrize("length", [0.25, 0.30, 0.37])
def test_mass_matrix_and_bias_are_pinocchios(length):
    rng = np.random.default_rng(3)
    skeleton = carried_skeleton(rng, length)
    model = skeleton_model(skeleton)
    data, trials = model.createData(), 6
    q, qd, qdd = rng.normal(size=(3, 5, trials))
    payload = Payload.of_skeletons([skeleton] * trials)
    chain, bodies = DEVICE.chain(payload.upper_arm_m), Moments.of(payload)
    M, bias = mass_and_bias(chain, bodies, q, qd)
    needed = inverse_dynamics(chain, bodies, q, qd, qdd)
    for t in range(trials):
        state = q[CHAIN, t], qd[CHAIN, t]
        upper = np.triu(pin.crba(model, data, state[0]))
        whole = upper + np.triu(upper, 1).T
        np.testing.assert_allclose(M[np.ix_(CHAIN, CHAIN, [t])][..., 0], whole, atol=1e-12)
        np.testing.assert_allclose(bias[CHAIN, t], pin.nle(model, data, *state), atol=1e-11)
        wanted = pin.rnea(model, data, *state, qdd[CHAIN, t])
        np.testing.assert_allclose(needed[CHAIN, t], wanted, atol=1e-11)


def test_the_plants_equation_holds_at_every_sample(loaded):
    *_, motion, _ = loaded
    assert np.abs(motion.balance).max() < 1e-9
    assert np.abs(motion.arm).max() > 1.0
    assert np.abs(motion.user).max() > 0.5


def test_the_sensor_of_axis_2_sees_all_beyond_the_gear(loaded):
    *_, motion, _ = loaded
    beyond = (motion.robot + motion.springs + motion.arm + motion.passive - motion.user)[..., 1]
    beyond = beyond - DEVICE.motor_inertia_kgm2[1] * motion.qdd[..., 1]
    np.testing.assert_allclose(motion.sensor, beyond, atol=1e-9)


def test_energy_is_conserved_but_for_work_and_friction(loaded):
    """``E(t) - E(0) = sum (motor + user) dq - int (friction + passive) qd dt``."""
    skeletons, _, _, motion, _ = loaded
    for t, skeleton in enumerate(skeletons):
        length = -skeleton.segments[skeleton.index("forearm")].origin_m[2]
        parts = (skeleton, DEVICE.adjusted_to(length).skeleton)
        energy = sum(_energy(part, motion.q[:, t], motion.qd[:, t]) for part in parts)
        energy += motion.qd[:, t] ** 2 @ DEVICE.motor_inertia_kgm2 / 2
        energy += (motion.q[:, t] - DEVICE.cable_rest_rad) ** 2 @ DEVICE.cable_stiffness / 2
        energy += DEVICE.spring.energy(motion.q[:, t, 0])
        held = (motion.motor + motion.user)[:-1, t]
        work = (held * np.diff(motion.q[:, t], axis=0)).sum()
        lost = ((motion.friction + motion.passive)[:, t] * motion.qd[:, t]).sum(axis=1)
        lost = np.trapezoid(lost, dx=1 / RATE_HZ)
        assert lost > 1.0
        assert energy[-1] - energy[0] == pytest.approx(work - lost, abs=2e-3 * lost)


def _energy(skeleton, q, qd):
    model = skeleton_model(skeleton)
    data = model.createData()
    return np.array(
        [
            pin.computeKineticEnergy(model, data, a[CHAIN], b[CHAIN])
            + pin.computePotentialEnergy(model, data, a[CHAIN])
            for a, b in zip(q, qd, strict=True)
        ]
    )


def test_a_solver_of_another_kind_finds_the_same_motion():
    """Whole plant, equations written anew, between held commands to 1e-10."""
    law, samples = DEVICE.friction, 150
    start = NEUTRAL[None]
    control = Pd(start, size=0.4)
    motion = run(DEVICE, None, start, control, samples, run_in=0, measured=False)
    model = skeleton_model(DEVICE.skeleton)
    model.armature = DEVICE.motor_inertia_kgm2[CHAIN].copy()
    data = model.createData()
    s0 = law.static / GIVE_RAD
    s1 = 0.6 * np.sqrt(s0 * DEVICE.motor_inertia_kgm2)

    def change(_time, y, motor):
        q, v, z = y.reshape(3, 5)
        level = law.coulomb + (law.static - law.coulomb) * np.exp(-np.abs(v) / law.stribeck_rad_s)
        bending = v - s0 * np.abs(v) / level * z
        torque = motor - s0 * z - s1 * bending - law.viscous * v - DEVICE.springs(q)
        a = np.empty(5)
        a[CHAIN] = pin.aba(model, data, q[CHAIN], v[CHAIN], torque[CHAIN])
        return np.concatenate([v, a, bending])

    y = np.concatenate([start[0], np.zeros(10)])
    worst = 0.0
    for k in range(samples - 1):
        span = (k / RATE_HZ, (k + 1) / RATE_HZ)
        held = (motion.motor[k, 0],)
        y = solve_ivp(change, span, y, "DOP853", args=held, rtol=1e-9, atol=1e-12).y[:, -1]
        worst = max(worst, float(np.abs(y[:5] - motion.q[k + 1, 0]).max()))
    assert np.ptp(motion.q[:, 0, 0]) > 0.2
    assert worst < 2e-6


def test_the_error_falls_with_the_substeps(loaded):
    _, payload, start, _, scene = loaded
    runs = [
        run(DEVICE, payload, start, Pd(start), 125, run_in=0, measured=False, substeps=n, **scene)
        for n in (5, 10, 40)
    ]
    coarse, fine = (np.abs(r.q - runs[2].q).max() for r in runs[:2])
    assert fine < 1e-6
    # of second order: four times less; the corner of |v| may take its share
    assert fine < coarse / 2.5


def test_a_trials_bits_do_not_depend_on_its_neighbours(loaded):
    _, payload, start, motion, _ = loaded
    parts = (payload.mass_kg, payload.com_m, payload.inertia_kgm2, payload.upper_arm_m)
    both = run(DEVICE, payload, start, Pd(start), 60, run_in=20)
    alone = run(
        DEVICE, Payload(*(p[1:2] for p in parts)), start[1:2], Pd(start[1:2]), 60, run_in=20
    )
    for field in fields(Motion):
        one, many = getattr(alone, field.name), getattr(both, field.name)
        assert one[:, 0].tobytes() == many[:, 1].tobytes(), field.name


def test_bristles_come_to_the_law_at_constant_velocity_and_are_odd():
    law = DEVICE.friction
    bristles = law.bristles(DEVICE.motor_inertia_kgm2)
    for speed in np.deg2rad([0.1, 0.5, 2.0, 60.0]):
        v = np.full((5, 1), speed)
        forth, back = np.zeros((2, 5, 1))
        rate = bristles.rate(v)
        for _ in range(round(0.02 / speed / 1e-3)):
            forth = bristles.bent(forth, v, rate, 1e-3)
            back = bristles.bent(back, -v, rate, 1e-3)
        settled = bristles.torque(forth, v)[:, 0]
        np.testing.assert_allclose(settled, law.steady(v[:, 0]), rtol=1e-6)
        np.testing.assert_array_equal(bristles.torque(back, -v)[:, 0], -settled)


@pytest.mark.study
def test_stiction_gives_way_a_little_and_slips_above_the_static_torque():
    """Slowly growing pushes on the last axis: it gives ``-s ln(1 - share)`` way, then slips.

    In between, above tau_c, the torque at which it slips falls with the rate of the load.
    """
    start = np.tile(NEUTRAL, (4, 1))
    still = np.zeros_like(start)
    load = DEVICE.springs(start) + DEVICE.rigid_torque(start, still, still)
    shares = np.array([0.5, 0.7, -0.7, 1.1])
    assert 0.7 * DEVICE.friction.static[4] < DEVICE.friction.coulomb[4]
    push = np.zeros_like(start)
    push[:, 4] = shares * DEVICE.friction.static[4]

    def growing(k, *_):
        return load + push * min(1.0, k / 1500)

    motion = run(DEVICE, None, start, growing, 1700, run_in=0)
    way = motion.q[-1, :, 4] - start[:, 4]
    # integral of dz / (1 - z / z_s); while it creeps, g is a few percent below tau_s
    expected = -GIVE_RAD * np.log(1 - np.abs(shares[:3])) * np.sign(shares[:3])
    np.testing.assert_allclose(way[:3], expected, rtol=0.1)
    assert way[3] > 100 * GIVE_RAD
    np.testing.assert_allclose(motion.friction[-1, :3, 4], push[:3, 4], rtol=0.02)


def test_the_spring_is_the_slope_of_its_energy_and_nearly_a_parabola():
    spring = DEVICE.spring
    q = np.linspace(*DEVICE.limits_rad[0], 200)
    slope = (spring.energy(q + 1e-5) - spring.energy(q - 1e-5)) / 2e-5
    np.testing.assert_allclose(spring.torque(q), slope, atol=1e-6)
    left = spring.torque(q) - np.polyval(np.polyfit(q, spring.torque(q), 2), q)
    assert 0.05 < np.abs(left).max() < 0.4
    posture = np.tile(np.deg2rad([90.0, 0, 0, 0, 0]), (1, 1))
    weight = DEVICE.rigid_torque(posture, 0 * posture, 0 * posture)[0, 0]
    carried = -spring.torque(posture[0, 0]) / weight
    assert 0.6 < carried < 1.0


def test_gravity_alone_lets_a_frictionless_free_robot_fall_as_it_should():
    """No motor, hardly any friction: the acceleration at the start is ``-M^-1 (G + springs)``."""
    start = NEUTRAL[None]
    free = replace(DEVICE, friction=DEVICE.friction.scaled(1e-9))
    motion = run(free, None, start, lambda *_: np.zeros((1, 5)), 2, run_in=0)
    still = np.zeros_like(start)
    unit = np.stack([DEVICE.rigid_torque(start, still, e[None])[0] for e in np.eye(5)], axis=1)
    weight = DEVICE.rigid_torque(start, still, still)[0]
    M = unit - weight[:, None]
    expected = np.linalg.solve(M, -weight - DEVICE.springs(start)[0])
    np.testing.assert_allclose(motion.qdd[0, 0], expected, atol=1e-6)
    assert np.abs(expected).max() > 1.0


def test_motors_are_limited_and_a_runaway_is_told():
    start = NEUTRAL[None]

    def push(*_):
        return np.full((1, 5), 1e3)

    motion = run(DEVICE, None, start, push, 20, run_in=0)
    np.testing.assert_array_equal(motion.motor[-1, 0], DEVICE.torque_limit_Nm)
    with pytest.raises(EstimationError, match="runs away"):
        run(DEVICE, None, start, push, 1500, run_in=0)


def test_what_is_no_robot_no_payload_and_no_start_is_refused():
    nothing = Payload.nothing(np.full(2, 0.3), 5)
    with pytest.raises(InputError, match="payload of 2 trials"):
        run(DEVICE, nothing, NEUTRAL[None], Pd(NEUTRAL[None]), 5)
    with pytest.raises(InputError, match="outside of the robot's limits"):
        run(DEVICE, None, NEUTRAL[None] + 3.0, Pd(NEUTRAL[None]), 5)
    with pytest.raises(InputError, match=r"0\.15 to 0\.5 m"):
        DEVICE.adjusted_to(0.7)
    with pytest.raises(RecordError, match="negative mass"):
        replace(nothing, mass_kg=nothing.mass_kg - 1)
    for wrong in ({"coulomb": DEVICE.friction.static * 2}, {"viscous": -np.ones(5)}):
        with pytest.raises(InputError, match="no such friction"):
            replace(DEVICE.friction, **wrong)
    with pytest.raises(ArmImpedanceError):
        replace(DEVICE, encoder_rad=np.zeros(5))


def test_a_mismatched_plant_differs_by_what_was_asked():
    other = DEVICE.mismatched(mass=0.1, friction=0.4, cable=0.2)
    assert other.skeleton.mass_kg == pytest.approx(1.1 * DEVICE.skeleton.mass_kg)
    still = np.zeros((1, 5))
    weights = [d.rigid_torque(NEUTRAL[None], still, still) for d in (other, DEVICE)]
    np.testing.assert_allclose(weights[0], 1.1 * weights[1])
    v = np.deg2rad([1.0, -20, 3, 0, 60])
    np.testing.assert_allclose(other.friction.steady(v), 1.4 * DEVICE.friction.steady(v))
    np.testing.assert_allclose(other.cable_stiffness, 1.2 * DEVICE.cable_stiffness)
    moved = DEVICE.adjusted_to(0.35)
    assert moved.upper_arm_m == 0.35
    assert moved.skeleton.mass_kg == DEVICE.skeleton.mass_kg
