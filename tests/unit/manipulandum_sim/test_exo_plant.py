"""Laws of the simulated elbow in its exoskeleton: Newton's, energy's, the control's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import simpson

from armimpedance.core.errors import InputError
from manipulandum_sim.elbow.device import Exoskeleton, Limits, Rendered
from manipulandum_sim.elbow.plant import (
    HIDING_GAIN,
    HIDING_HZ,
    KINEMATICS_HZ,
    Drive,
    run,
)
from manipulandum_sim.elbow.protocol import LOADS, RHYTHM_HZ
from manipulandum_sim.elbow.simulate import simulate_elbow
from manipulandum_sim.elbow.subject import ELBOW_SUBJECTS, OPERATING_ANGLE_RAD, effective

DEVICE = Exoskeleton()
#: A device that is hardly there.
FEATHER = Exoskeleton(inertia=0.005, viscosity=0.0, friction=0.0)


@pytest.fixture(scope="module", params=["1", "3"])
def exact(request):
    """Recording and truth of a posture without any noise, of two subjects by the same plant."""
    return simulate_elbow(
        "posture", subject=request.param, noise="none", repetitions=2, duration_s=1.0
    )


def solve(columns, torque):
    return np.linalg.lstsq(np.stack(columns, axis=1), torque, rcond=None)[0]


def gravity_s_curvature(truth):
    """Torque of gravity against the limb beyond its tangent at the operating angle."""
    q, q0 = truth.motion.angle, truth.operating_angle
    return truth.gravity * (np.sin(q) - np.sin(q0) - np.cos(q0) * (q - q0))


def test_the_limb_s_impedance_is_in_the_interaction_torque(exact):
    _, truth = exact
    m = truth.motion
    columns = [m.acceleration, m.rate, m.angle, np.ones_like(m.angle)]
    expected = [truth.I, truth.B[0], truth.K[0]]
    found = solve(columns, m.torque - gravity_s_curvature(truth))
    np.testing.assert_allclose(found[:3], expected, rtol=1e-7)
    # over a few degrees gravity is nearly a spring
    np.testing.assert_allclose(solve(columns, m.torque)[:3], expected, rtol=0.01)


def test_the_motor_s_torque_moves_arm_and_device(exact):
    recording, truth = exact
    m = truth.motion
    dry = np.tanh(m.rate / DEVICE.slip)
    columns = [m.acceleration, m.rate, m.angle, dry, np.ones_like(dry)]
    found = solve(columns, m.motor - gravity_s_curvature(truth))
    expected = [
        truth.I + truth.device_inertia,
        truth.B[0] + truth.device_viscosity,
        truth.K[0],
        truth.device_friction,
    ]
    np.testing.assert_allclose(found[:4], expected, rtol=1e-7)
    np.testing.assert_array_equal(recording.extra["motor1_Nm"], m.motor)


@pytest.mark.first_cases(1)
def test_the_torque_s_column_is_by_the_limb_and_the_one_asked_for(exact):
    felt, truth = exact
    options = {"noise": "none", "repetitions": 2, "duration_s": 1.0, "subject": truth.subject}
    told, _ = simulate_elbow("posture", torque="commanded", **options)
    assert (felt.torque, told.torque) == ("interaction", "commanded")
    np.testing.assert_array_equal(felt.force[:, 0], -truth.motion.torque)
    np.testing.assert_array_equal(told.force[:, 0], -truth.motion.motor)
    np.testing.assert_array_equal(felt.position, told.position)


def test_power_is_balanced_in_limb_and_device(exact):
    _, truth = exact
    own, m = ELBOW_SUBJECTS[truth.subject], truth.motion
    part = truth.samples_of(0)
    q, qd, K, B = m.angle[part], m.rate[part], truth.K_muscle[0], truth.B[0]
    q0 = truth.operating_angle

    def gained(values):
        return values[-1] - values[0]

    def work(power):
        return simpson(power, dx=1e-3)

    kinetic, spring = qd**2 / 2, K * (q - q0) ** 2 / 2
    tone = float(own.isometric_torque(truth.activation[0]))
    stored = truth.I * kinetic + spring - truth.gravity * np.cos(q) - tone * q
    given = work(m.torque[part] * qd)
    scale = work(np.abs(m.torque[part] * qd))
    # between samples the motor's torque bends as its current does: no rule for smooth curves does
    # better than the share of a millisecond's change in the torque itself
    assert abs(given - gained(stored) - work(B * qd**2)) < 3e-3 * scale
    lost, motor = work(DEVICE.resistance(qd) * qd), work(m.motor[part] * qd)
    assert abs(motor - lost - given - gained(truth.device_inertia * kinetic)) < 3e-3 * scale


def test_four_subjects_lie_in_the_source_s_range():
    found = []
    for own in ELBOW_SUBJECTS.values():
        K, B = own.impedance(own.posture(), np.array(OPERATING_ANGLE_RAD))
        assert 5.3 <= K <= 13.1
        assert 2.5 <= B <= 4.7
        assert own.muscle_stiffness(own.posture()) < K, "gravity helps below the horizontal"
        found.append(float(K))
    assert np.diff(found).min() > 1.0
    heights = [own.height_m for own in ELBOW_SUBJECTS.values()]
    assert np.mean(heights) == pytest.approx(1.73, abs=0.005)


def test_stiffness_is_the_gradient_of_the_torque_with_gravity_in_it():
    own = ELBOW_SUBJECTS["3"]
    a = np.array([[0.1, 0.05], [0.3, 0.2]])
    for angle in (0.4, 1.2, 2.0):
        K, B = own.impedance(a, np.full(2, angle))
        np.testing.assert_allclose(K, own.muscle_stiffness(a) + own.gravity * np.cos(angle))
        np.testing.assert_allclose(B, own.muscle_viscosity(a))


def test_the_saturating_law_bends_and_starts_and_agrees_where_it_should():
    a = np.linspace(0, 1, 50)
    bent = effective(a, "saturating")
    assert bent[0] == 0
    assert (np.diff(bent) > 0).all()
    assert (np.diff(bent, 2) < 0).all()
    assert effective(np.array(0.08), "saturating") == pytest.approx(0.08)


def test_the_limb_feels_the_device_divided_by_one_plus_the_gain():
    """No reference, no perturbation: ``interaction = -Z_d theta / (1 + G L delay motor)``."""
    device = Exoskeleton(inertia=0.05, viscosity=0.4, friction=0.0)
    w, samples = 2 * np.pi * 1.0, 3000
    fine = np.arange(2 * samples - 1) / 2000.0
    flat = np.ones((2 * samples - 1, 1))
    drive = Drive(
        inertia=0.07,
        gravity=0.0,
        K=9.0 * flat,
        B=3.0 * flat,
        push=3.0 * np.sin(w * fine)[:, None],
        load=np.zeros(1),
        perturbation=np.zeros((samples, 1)),
        rendered=Rendered(),
        q0=0.0,
        angle=np.zeros(1),
        rate=np.zeros(1),
    )
    motion = run(drive, device, None, Limits(1e3, 1e3))
    last = np.arange(2000, 3000)
    wave = np.exp(-1j * w * last / 1000.0)
    ratio = (motion.interaction[last, 0] @ wave) / (motion.angle[last, 0] @ wave)
    z = np.exp(1j * w / 1000.0)
    keep = np.exp(-2 * np.pi * HIDING_HZ / 1000.0)
    loop = HIDING_GAIN * (1 - keep) / (1 - keep / z)
    # one sample of delay, half of one for the hold, the motor's lag
    loop *= np.exp(-1.5j * w / 1000.0) / (1 + 1j * w * device.motor_lag_s)
    expected = -(-device.inertia * w**2 + 1j * w * device.viscosity) / (1 + loop)
    assert abs(ratio - expected) < 1e-3 * abs(expected)


@pytest.mark.first_cases(1)
@pytest.mark.parametrize("test", ["spring", "inertia", "damper"])
def test_a_rendered_load_shows_the_false_viscosity_of_its_filter(test):
    """A low-pass that lags by d turns a spring K into a viscosity -K d: it feeds the movement."""
    _, truth = simulate_elbow(test, noise="none", repetitions=1, duration_s=2.5, device=FEATHER)
    m, w = truth.motion, 2 * np.pi * RHYTHM_HZ
    wave = np.exp(-1j * w * np.arange(len(m.angle)) / 1000.0)
    # resistance of the device to the limb over one harmonic: K - I w^2 + j w B
    resistance = -(m.torque @ wave) / (m.angle @ wave)
    cut = 2 * np.pi * KINEMATICS_HZ
    s = 1j * w
    lag = 1 / (1 + np.sqrt(2) * s / cut + (s / cut) ** 2)
    lag *= np.exp(-1.5e-3 * s) / (1 + FEATHER.motor_lag_s * s)
    asked = LOADS[test]
    if test == "inertia":
        lag *= np.exp(-0.5e-3 * s)  # a backward difference
    ideal = asked.stiffness + s * asked.viscosity + s**2 * asked.inertia
    assert resistance == pytest.approx(ideal * lag, abs=0.05 * abs(ideal))
    false = resistance.imag / w - asked.viscosity
    if test == "spring":
        assert false < -0.15
    if test == "inertia":
        assert false > 0.03


@pytest.mark.study
def test_a_limit_ends_the_trial_there_and_says_so():
    options = {"duration_s": 10.0, "repetitions": 3}
    free, _ = simulate_elbow("posture", **options)
    limit = 0.999 * float(np.abs(free.extra["gyro1_rad_s"]).max())
    recording, truth = simulate_elbow("posture", velocity_limit=limit, **options)
    stopped = recording.trials["stopped"].to_numpy()
    assert set(stopped) == {"", "velocity"}
    for row, why in enumerate(stopped):
        speed = np.abs(recording.extra["gyro1_rad_s"][recording.samples_of(row)])
        length = len(speed)
        assert speed[:-1].max() <= limit
        if why:
            assert length < 10_000
            assert speed[-1] > limit
            assert f"trial {row + 1} stopped by the velocity limit" in recording.provenance
        else:
            assert length == 10_000
        part = free.samples_of(row)
        kept = slice(part.start, part.start + length)
        rows = recording.samples_of(row)
        np.testing.assert_array_equal(recording.position[rows], free.position[kept])
        np.testing.assert_array_equal(np.asarray(recording.emg)[rows], np.asarray(free.emg)[kept])
    assert truth.offsets[-1] == len(truth.K) == len(recording.position)


@pytest.mark.first_cases(2)
@pytest.mark.parametrize(
    ("test", "limits"),
    [
        ("posture", {"velocity_limit": 0.05}),
        ("calibration", {"torque_limit": 3.0}),
        ("posture", {"torque_limit": 0.5}),
    ],
)
def test_a_trial_stopped_at_once_is_an_error(test, limits):
    with pytest.raises(InputError, match="is stopped by the (velocity|torque) limit"):
        simulate_elbow(test, duration_s=1.0, repetitions=1, **limits)


def test_what_is_no_device_and_no_subject_is_refused():
    for wrong in ({"inertia": 0.0}, {"friction": -0.1}, {"viscosity": np.nan}, {"slip": np.inf}):
        with pytest.raises(InputError, match="a device of"):
            Exoskeleton(**wrong)
    with pytest.raises(InputError, match="elbow subject"):
        replace(ELBOW_SUBJECTS["1"], kF=-1.0)
