"""The exoskeleton's sessions: conditions, noise, perturbations, EMG, truth, bad arguments."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError, RecordError
from armimpedance.numerics.signals.emg.activation import mvc_column, rest_column
from manipulandum_sim.elbow.device import (
    EMG_INPUT,
    GYROSCOPE,
    MOTOR_COMMAND,
    POTENTIOMETER,
    STRAIN_GAUGE,
)
from manipulandum_sim.elbow.emg import Electrodes, raw_emg
from manipulandum_sim.elbow.perturbation import CLOCK_HZ, CUTOFF_HZ, REGISTER, RMS_Nm, perturbation
from manipulandum_sim.elbow.protocol import ISOMETRIC, LEVELS
from manipulandum_sim.elbow.restless import TREMOR_Nm, VOLUNTARY_Nm, restless_torque
from manipulandum_sim.elbow.simulate import simulate_elbow
from manipulandum_sim.elbow.subject import ELBOW_SUBJECTS, OPERATING_ANGLE_RAD
from manipulandum_sim.elbow.truth import ElbowTruth

SHORT = {"duration_s": 1.0, "repetitions": 1}
#: How far the session `nominal` was, each time it told.
TOLD: list[tuple[int, int]] = []


@pytest.fixture(scope="module")
def nominal():
    return simulate_elbow(
        "posture",
        seed=5,
        repetitions=2,
        duration_s=3.0,
        progress=lambda done, of: TOLD.append((done, of)),
    )


@pytest.fixture(scope="module")
def calibration():
    return simulate_elbow("calibration", seed=1, four_muscles=True, noise="sensor", duration_s=8.0)


@pytest.fixture(scope="module")
def exact():
    """A posture without any noise."""
    return simulate_elbow("posture", noise="none", **SHORT)


@pytest.fixture(scope="module")
def varying():
    return simulate_elbow("varying", activation_delay_s=0.05, **SHORT)


def trial_levels(recording):
    """Mean rectified EMG (T, m)."""
    emg = np.abs(np.asarray(recording.emg))
    rows = range(recording.n_trials)
    return np.array([emg[recording.samples_of(r)].mean(axis=0) for r in rows])


@pytest.mark.study
def test_a_trial_depends_on_the_seed_and_its_number_alone(nominal):
    recording, truth = nominal
    one, alone = simulate_elbow("posture", seed=5, repetitions=1, duration_s=3.0)
    part = recording.samples_of(0)
    np.testing.assert_array_equal(one.position, recording.position[part])
    np.testing.assert_array_equal(one.force, recording.force[part])
    np.testing.assert_array_equal(one.emg, np.asarray(recording.emg)[part])
    np.testing.assert_array_equal(alone.motion.restless, truth.motion.restless[part])
    for name, column in one.extra.items():
        np.testing.assert_array_equal(column, recording.extra[name][part])


@pytest.mark.study
def test_trials_subjects_and_seeds_differ(nominal):
    recording, _ = nominal
    added = recording.extra["tau1_perturbation_Nm"]
    first, second = (added[recording.samples_of(r)][:1000] for r in (0, 1))
    others = [
        simulate_elbow("posture", seed=seed, subject=subject, **SHORT)[0]
        for seed, subject in ((5, "2"), (6, "1"))
    ]
    draws = [first, second, *(o.extra["tau1_perturbation_Nm"] for o in others)]
    for i, a in enumerate(draws):
        for b in draws[:i]:
            assert np.abs(a - b).max() > 0.1 * RMS_Nm


def test_sensors_show_the_truth_with_their_noise_and_steps(nominal):
    recording, truth = nominal
    m = truth.motion
    for shown, exact, sensor in (
        (recording.position[:, 0], m.angle, POTENTIOMETER),
        (recording.extra["gyro1_rad_s"], m.rate, GYROSCOPE),
        (-recording.force[:, 0], m.torque, STRAIN_GAUGE),
    ):
        sd = np.hypot(sensor.noise_sd, sensor.step / np.sqrt(12))
        # the sd of n draws is uncertain by 1 / sqrt(2 n)
        n = len(shown)
        assert (shown - exact).std() == pytest.approx(sd, rel=5 / np.sqrt(2 * n))
        assert abs((shown - exact).mean()) < 5 * sd / np.sqrt(n)
        counts = (shown - sensor.low) / sensor.step
        np.testing.assert_allclose(counts, np.rint(counts), atol=1e-6)


def test_converters_round_and_end_at_their_full_scale():
    assert MOTOR_COMMAND.step == pytest.approx(48 / 4096)
    x = np.linspace(-23.9, 23.9, 1001)
    assert np.abs(MOTOR_COMMAND.convert(x) - x).max() <= MOTOR_COMMAND.step / 2 * (1 + 1e-9)
    ends = MOTOR_COMMAND.convert(np.array([-99.0, 99.0]))
    np.testing.assert_allclose(ends, [-24.0, 24.0 - MOTOR_COMMAND.step])


def test_noise_levels_leave_out_what_they_say(exact):
    still, known = exact
    np.testing.assert_array_equal(still.position[:, 0], known.motion.angle)
    np.testing.assert_array_equal(-still.force[:, 0], known.motion.torque)
    assert (still.trials["rest_biceps_V"] == 0).all()
    sensors, truth = simulate_elbow("posture", noise="sensor", **SHORT)
    assert not truth.motion.restless.any()
    assert np.abs(sensors.position[:, 0] - truth.motion.angle).max() > POTENTIOMETER.noise_sd


def test_the_subject_is_restless_as_much_as_said():
    draws = np.stack([restless_torque(np.random.default_rng(s), 60_000) for s in range(20)])
    # a time constant of 0.8 s: 60 s hold 37 independent draws
    expected = np.hypot(VOLUNTARY_Nm, TREMOR_Nm)
    assert draws.std() == pytest.approx(expected, rel=4 / np.sqrt(2 * 37 * 20))
    fast = np.abs(np.fft.rfft(draws, axis=1)) ** 2
    hz = np.arange(fast.shape[1]) / 60.0
    tremor, beside = fast[:, (hz > 9) & (hz < 11)].mean(), fast[:, (hz > 15) & (hz < 20)].mean()
    assert tremor > 3 * beside


def test_the_elbow_moves_by_a_few_degrees_about_the_operating_angle(nominal):
    _, truth = nominal
    away = np.rad2deg(truth.motion.angle - truth.operating_angle)
    assert 1.0 < away.std() < 6.0
    assert abs(away.mean()) < 3.0


def test_the_binary_sequence_has_two_levels_and_a_flat_spectrum():
    period, hold = 2**REGISTER - 1, round(1000 / CLOCK_HZ)
    x = perturbation("prbs", np.random.default_rng(0), period * hold)
    assert set(x) == {-RMS_Nm, RMS_Nm}
    changes = np.flatnonzero(np.diff(x)) + 1
    assert len(set(changes % hold)) == 1
    power = np.abs(np.fft.rfft(x))[1:] ** 2
    hz = np.arange(1, len(power) + 1) / (period * hold / 1000)
    # a held white sequence: sinc^2 of the clock's period, its lines else equal to the last bit
    level = power / np.sinc(hz / CLOCK_HZ) ** 2
    low = hz <= CLOCK_HZ / 3
    assert power[low].min() > 0.5 * power[low].max()
    np.testing.assert_allclose(level[low] / level[0], 1.0, rtol=0.01)


def test_white_noise_stays_below_its_low_pass():
    x = np.stack([perturbation("white", np.random.default_rng(s), 20_000) for s in range(8)])
    assert x.std() == pytest.approx(RMS_Nm, rel=0.06)
    power = (np.abs(np.fft.rfft(x, axis=1)) ** 2).mean(axis=0)
    hz = np.arange(len(power)) / 20
    half = power[(hz > 1) & (hz < 5)].mean() / power[(hz > 5) & (hz < 8)].mean()
    assert half == pytest.approx(1.0, abs=0.2)
    assert power[hz > 4 * CUTOFF_HZ].mean() < 1e-4 * power[(hz > 1) & (hz < 5)].mean()


@pytest.mark.parametrize("kind", ["white", "prbs"])
def test_the_column_of_the_perturbation_is_what_was_added(kind, exact):
    """The limb feels it: the interaction torque follows it, less the device's own and reference."""
    recording, truth = exact
    if kind != "white":
        recording, truth = simulate_elbow("posture", perturbation=kind, noise="none", **SHORT)
    added, felt = recording.extra["tau1_perturbation_Nm"], truth.motion.torque
    assert np.corrcoef(added[:-4], felt[4:])[0, 1] > 0.8
    assert f"perturbed by {kind} torque" in recording.provenance


def test_cocontraction_tells_flexor_and_extensor_apart():
    """And muscles, load and gravity are in balance at the operating angle."""
    recording, truth = simulate_elbow("cocontraction", noise="none", **SHORT)
    rest, still = np.full(recording.n_trials, OPERATING_ANGLE_RAD), np.zeros(recording.n_trials)
    own = ELBOW_SUBJECTS["1"]
    limb = own.torque(rest, still, truth.trial_means("activation"), rest, still)
    np.testing.assert_allclose(limb + recording.trials["load_Nm"], 0.0, atol=1e-12)
    assert tuple(recording.trials["condition"]) == tuple(LEVELS)
    targets = recording.trials[["target_flexor", "target_extensor"]].to_numpy()
    np.testing.assert_allclose(targets, truth.trial_means("activation"), rtol=1e-12)
    W = np.column_stack([np.ones(len(targets)), targets])
    assert np.linalg.cond(W / np.linalg.norm(W, axis=0)) < 10
    k = np.linalg.lstsq(W, truth.trial_means("K_muscle"), rcond=None)[0]
    np.testing.assert_allclose(k, truth.stiffness_law, rtol=1e-9)
    b = np.linalg.lstsq(W, truth.trial_means("B"), rcond=None)[0]
    np.testing.assert_allclose(b, truth.viscosity_law, rtol=1e-7)


@pytest.mark.first_cases(2)
@pytest.mark.parametrize(
    ("law", "depth"),
    [("linear", 0.1), ("linear", 0.3), ("linear", 0.5), ("saturating", 0.1), ("saturating", 0.3)],
)
def test_stiffness_varies_as_deep_as_asked_and_the_torque_stays(law, depth):
    _, truth = simulate_elbow(
        "varying", law=law, depth=depth, frequency_hz=2.0, duration_s=1.0, repetitions=3
    )
    for row in range(3):
        K = truth.K[truth.samples_of(row)]
        reached = (K.max() - K.min()) / (K.max() + K.min())
        assert reached == pytest.approx(depth, rel=1e-3)  # samples miss the peaks by a little
        torque = truth.activation[truth.samples_of(row)] @ truth.torque_per_activation
        np.testing.assert_allclose(torque, torque[0], rtol=1e-12)
    assert truth.activation.min() > 0
    torques = truth.trial_means("activation") @ truth.torque_per_activation
    W = np.column_stack([np.ones(len(truth.K)), truth.activation])
    if depth == 0.3:
        assert np.ptp(torques) > 0.5, "repetitions tell flexor and extensor apart"
        fit = W @ np.linalg.lstsq(W, truth.K_muscle, rcond=None)[0] - truth.K_muscle
        assert (np.abs(fit).max() < 1e-9) == (law == "linear")


def test_stiffness_follows_the_emg_by_the_activation_delay(varying):
    _, truth = varying
    K = truth.stiffness_law[0] + truth.activation @ truth.stiffness_law[1:]
    np.testing.assert_allclose(truth.K_muscle[50:], K[:-50], rtol=1e-9)
    assert np.abs(truth.K_muscle - K).max() > 0.1


@pytest.mark.first_cases(1)
@pytest.mark.parametrize("test", ["spring", "damper", "inertia"])
def test_the_rhythm_is_tens_of_degrees_and_the_muscles_carry_its_torque(test):
    recording, truth = simulate_elbow(test, noise="none", repetitions=1, duration_s=3.0)
    swing = np.rad2deg(np.ptp(truth.motion.angle))
    assert 30 < swing < 70
    assert truth.activation.min() > 0
    muscle = truth.activation @ truth.torque_per_activation
    weight = truth.gravity * np.sin(truth.motion.angle)
    # what the muscles do for the movement, gravity and load, their impedance has not to do
    need = truth.I * truth.motion.acceleration + weight - truth.motion.torque
    assert (need - muscle).std() < 0.3 * (need - need.mean()).std()
    columns = ["rendered_I_kgm2", "rendered_B_Nms_rad", "rendered_K_Nm_rad"]
    np.testing.assert_array_equal(recording.trials[columns].to_numpy()[0], truth.rendered)
    assert "tau1_perturbation_Nm" not in recording.extra, "nothing perturbs it"


def test_isometric_torque_is_the_sum_over_the_muscles(calibration):
    recording, truth = calibration
    assert "tau1_perturbation_Nm" not in recording.extra
    assert len(truth.muscles) == 4
    count = len(ISOMETRIC)
    assert tuple(recording.trials["condition"][:count]) == tuple(ISOMETRIC)
    muscle = truth.trial_means("activation") @ truth.torque_per_activation
    np.testing.assert_allclose(muscle, recording.trials["target_torque_Nm"], atol=1e-12)
    held = np.array([truth.motion.torque[truth.samples_of(r)].mean() for r in range(count)])
    weight = truth.gravity * np.sin(truth.operating_angle)
    np.testing.assert_allclose(-held, muscle[:count] - weight, atol=1e-12)
    assert not truth.motion.rate.any()
    W = truth.trial_means("activation")[:count]
    assert np.linalg.matrix_rank(W / np.linalg.norm(W, axis=0), tol=0.05) == 4


def test_rectified_emg_is_activation_times_mvc_beside_electrode_noise(calibration):
    recording, truth = calibration
    mvc = recording.trials[[mvc_column(m) for m in truth.muscles]].to_numpy()
    rest = recording.trials[[rest_column(m) for m in truth.muscles]].to_numpy()
    expected = np.hypot(truth.trial_means("activation") * mvc, rest)
    # 8 s of a band of 430 Hz: 2 B T independent draws, of relative sd sqrt(pi / 2 - 1) each
    error = np.sqrt((np.pi / 2 - 1) / (2 * 430 * 8.0))
    loud = expected > 10 * rest
    ratio = trial_levels(recording)[loud] / expected[loud]
    assert loud.mean() > 0.5
    np.testing.assert_allclose(ratio, 1.0, atol=5 * error)


@pytest.mark.study
def test_emg_follows_a_varying_activation():
    recording, truth = simulate_elbow("varying", repetitions=2, duration_s=10.0, noise="none")
    for muscle in range(2):
        level = np.abs(np.asarray(recording.emg)[:, muscle])
        a = truth.activation[:, muscle]
        mvc = recording.trials[mvc_column(truth.muscles[muscle])][0]
        slope = ((a - a.mean()) @ level) / ((a - a.mean()) @ (a - a.mean()))
        scatter = np.sqrt(np.pi / 2 - 1) * mvc * a.mean()
        error = scatter / np.sqrt(len(a) * a.var() * 0.86)
        assert slope == pytest.approx(mvc, abs=5 * error)


@pytest.mark.parametrize("hz", [50.0, 60.0])
def test_hum_and_artefact_are_where_they_belong(hz):
    rng = np.random.default_rng(2)
    rate = np.cumsum(rng.standard_normal(10_000)) * 0.01
    silent = np.zeros((10_000, 2))
    electrodes = Electrodes(noise_V=0.0, hum_V=3e-5, hum_hz=hz, artefact=1e-4)
    emg = raw_emg(rng, silent, np.full(2, 5e-4), rate, electrodes, converted=False)
    amplitude = 2 * np.abs(np.fft.rfft(emg, axis=0)) / 10_000
    np.testing.assert_allclose(amplitude[round(hz * 10)], 3e-5, rtol=0.02)
    low = slice(1, 200)
    above = np.delete(amplitude[400:], round(hz * 10) - 400, axis=0)
    assert amplitude[low].max() > 1e-5
    assert above.max() < 0.01 * amplitude[low].max()


def test_a_strong_emg_clips_at_the_converter():
    emg = raw_emg(np.random.default_rng(0), np.ones((2000, 1)), np.array([5e-3]), np.zeros(2000),
                  Electrodes())  # fmt: skip
    assert emg.max() == EMG_INPUT.high - EMG_INPUT.step
    assert emg.min() == EMG_INPUT.low


def test_truth_is_written_and_read(tmp_path, nominal, varying):
    path = tmp_path / "truth.json"
    for _, truth in (nominal, varying):
        truth.write(path)
        back = ElbowTruth.read(path)
        for name in ("K", "B", "K_muscle", "activation", "offsets", "stiffness_law"):
            np.testing.assert_array_equal(getattr(back, name), getattr(truth, name))
        assert (back.I, back.muscles, back.motion) == (truth.I, truth.muscles, None)


@pytest.mark.parametrize("text", ["", "{}", '{"offsets": [0, 2], "K": 3}', "[]"])
def test_what_is_no_truth_is_refused(tmp_path, text):
    path = tmp_path / "truth.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"truth\.json"):
        ElbowTruth.read(path)


def test_a_truth_of_other_lengths_is_refused(nominal):
    _, truth = nominal
    from dataclasses import replace

    with pytest.raises(RecordError):
        replace(truth, K=truth.K[:-1])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"test": "walking"}, "walking"),
        ({"subject": "9"}, "subject '9'"),
        ({"seed": -1}, "seed -1"),
        ({"repetitions": 0}, "0 repetitions"),
        ({"repetitions": 2.5}, "2.5 repetitions"),
        ({"duration_s": 0.5}, "0.5 s"),
        ({"duration_s": np.nan}, "nan s"),
        ({"perturbation": "pink"}, "pink"),
        ({"noise": "loud"}, "loud"),
        ({"torque": "felt"}, "felt"),
        ({"law": "cubic"}, "cubic"),
        ({"test": "varying", "depth": 0.9}, "varies by 0.9"),
        ({"test": "varying", "depth": -0.1}, "varies by -0.1"),
        ({"test": "varying", "depth": np.nan}, "varies by nan"),
        ({"test": "varying", "frequency_hz": 0.0}, "0.0 Hz"),
        ({"activation_delay_s": -0.1}, "delay of -0.1 s"),
        ({"hum_V": -1.0}, "hum"),
        ({"hum_hz": 500.0}, "500.0 Hz"),
        ({"electrode_noise_V": np.inf}, "noise"),
        ({"velocity_limit": 0.0}, "limits of 0.0"),
        ({"torque_limit": np.nan}, "nan N m"),
        ({"four_muscles": True}, "four muscles"),
    ],
)
def test_what_makes_no_recording_is_refused(arguments, message):
    with pytest.raises(InputError, match=message) as caught:
        simulate_elbow(**{"test": "posture", **SHORT, **arguments})
    assert "\n" not in str(caught.value)


def test_progress_ends_at_its_end(nominal):
    done, of = zip(*TOLD, strict=True)
    assert done[-1] == of[-1] > 1
    assert len(set(of)) == 1
    assert list(done) == sorted(done)


def test_the_subjects_emg_fits_the_converter():
    for own in ELBOW_SUBJECTS.values():
        # 0.35 of the maximum is the strongest contraction; 5 sd of it are within the full scale
        sd = 0.35 * max(own.mvc_F_V, own.mvc_E_V) * np.sqrt(np.pi / 2)
        assert 5 * sd < EMG_INPUT.high
