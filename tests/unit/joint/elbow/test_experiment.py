"""What the rig imposes: told, recorded or asked of the record, and I, B, K accordingly.

Records are synthesised over frequency, exactly, and independently of the analysis' equations of
the ends: a trial is a part of a period twice as long.
"""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError, RecordError
from armimpedance.joint.elbow.checks import spectra_of
from armimpedance.joint.elbow.imposed import NATS, answered, hull, middle, shifted
from armimpedance.joint.elbow.samples import from_recording
from armimpedance.joint.elbow.stationary.band import source_of
from armimpedance.joint.elbow.stationary.identify import identify_elbow
from armimpedance.joint.elbow.stationary.instruments import explained_motion
from armimpedance.joint.elbow.stationary.methods import METHODS
from armimpedance.joint.elbow.stationary.preparation import prepare
from armimpedance.numerics.regression import Parameters
from manipulandum_sim.elbow import simulate_bench, simulate_servo

JOINT = np.array([0.015, 1.2, 100.0])
HEAVY = (0.15, 0.5, 10.0)


def servo(seed, joint=JOINT, **options):
    recording, _ = simulate_servo(*joint, seed=seed, **options)
    return from_recording(recording)


def estimated(samples, method="iv"):
    """I, B, K over what the record does not exclude, and the finding, no further doubt."""
    answer = answered(prepare(samples, spectra_of(samples)), METHODS.named(method))
    found = [way.estimate.parameters for way in answer.ways]
    return answer.parameters(found), answer.finding(found)


def standardised(fits, joint=JOINT):
    return np.array([(fit.values - joint) / fit.sd for fit in fits])


def assert_unbiased(fits, joint=JOINT):
    """Mean of standardised errors, t with some 19 degrees each: 4 standard errors."""
    z = standardised(fits, joint)
    assert (np.abs(z.mean(axis=0)) < 4 * 1.06 / np.sqrt(len(z))).all(), z.mean(axis=0)


def test_the_servo_obeys_the_limb_s_equation():
    """Without own torque the torque is Z theta; what the subject adds is what is missing of it."""
    free, truth = simulate_servo(*JOINT, own_Nm=0.0, snr_db=None, duration_s=4.0, seed=1)
    theta = truth.angle[0]
    rate, acceleration = np.gradient(theta, 1e-3), np.gradient(np.gradient(theta, 1e-3), 1e-3)
    left = truth.torque[0] - np.array([acceleration, rate, theta]).T @ JOINT
    # Second differences at 1 kHz of a motion below 50 Hz: some (pi f / rate)^2 / 3 of a per cent.
    assert np.std(left[5:-5]) < 0.02 * np.std(truth.torque[0])
    assert free.imposed == "position"
    soft, _ = simulate_servo(*JOINT, device=HEAVY, duration_s=4.0, told=False, command=False)
    assert soft.imposed is None
    assert soft.extra == {}
    with pytest.raises(InputError, match="positive numbers"):
        simulate_servo(*JOINT, own_Nm=-1.0)


def test_what_is_told_or_recorded_chooses_the_instrument():
    both = servo(0, duration_s=4.0)
    pushed = replace(both, perturbation=both.torque, command=None)
    blind = replace(both, command=None)
    assert source_of(both) == "command"
    assert source_of(blind) == "angle"
    assert source_of(replace(blind, imposed=None)) is None
    assert source_of(replace(blind, imposed="both")) is None
    assert source_of(replace(blind, imposed="torque")) == "torque"
    assert source_of(replace(pushed, imposed=None)) == "perturbation"
    assert source_of(pushed) == "angle"
    assert source_of(replace(both, imposed=None)) == "command"


def test_the_option_stands_above_the_file_and_says_so():
    recording, _ = simulate_servo(*JOINT, duration_s=4.0)
    samples = from_recording(recording, imposed="torque")
    assert samples.imposed == "torque"
    assert any("recording.json says position" in note for note in samples.notes)
    assert from_recording(recording, imposed="position").notes == ()
    for wrong in ("force", "angle"):
        with pytest.raises(InputError, match="of a joint one of position, torque, both"):
            from_recording(recording, imposed=wrong)
    with pytest.raises(InputError, match="imposed 'force'"):
        from_recording(replace(recording, imposed="force"))
    with pytest.raises(RecordError, match="imposed"):
        replace(samples, imposed="force")
    still = replace(recording, extra={"q1_command_rad": np.zeros(len(recording.time_s))})
    assert from_recording(still).command is None


def test_a_line_s_own_noise_is_not_in_what_is_explained_of_it():
    rng = np.random.default_rng(4)
    n = 200
    command = rng.standard_normal(n) + 1j * rng.standard_normal(n)
    response = (2 - 1j) * np.exp(-1j * np.linspace(0, 6, n))
    explained = explained_motion(response * command, command)
    # A phase of .03 a line, ten lines to either side: curvature beyond the square is below 1 %.
    assert np.abs(explained / (response * command) - 1).max() < 0.01
    disturbed = response * command
    disturbed[100] += 50
    again = explained_motion(disturbed, command)
    assert again[100] == explained[100]
    assert np.abs(again[95:100] - explained[95:100]).min() > 0.01


@pytest.mark.first_cases(4)
@pytest.mark.parametrize("own", [0.1, 3.0])
@pytest.mark.parametrize(
    ("method", "command"),
    [("iv", True), ("output-error", False), ("iv", False), ("derivative", True)],
)
def test_the_subject_s_torque_is_noise_where_the_angle_is_imposed(own, method, command):
    records = [servo(seed, own_Nm=own, command=command, duration_s=20.0) for seed in range(5)]
    fits = [estimated(samples, method)[0] for samples in records]
    assert_unbiased(fits)
    # The torque as instrument is off by S_v / S_tau, 3 N m beside some 2 N m: more than twice.
    if own == 3.0 and method == "iv":
        wrong = estimated(replace(records[0], command=None, imposed="torque"))[0]
        assert wrong.values[2] > 2 * JOINT[2]


@pytest.mark.study
def test_an_imposed_angle_may_be_noisy():
    """At 5 dB plain least squares of torque on angle loses a quarter of K."""
    records = [servo(s, own_Nm=0.3, command=False, snr_db=5.0, duration_s=20.0) for s in range(8)]
    assert_unbiased([estimated(samples)[0] for samples in records])


@pytest.mark.study
def test_output_error_takes_the_angle_for_the_output_of_an_imposed_torque():
    joint = np.array([0.07, 0.6, 20.0])
    fits = []
    for seed in range(10):
        limb = {"own_Nm": 0.0, "command": False, "duration_s": 20.0}
        samples = replace(servo(seed, joint, snr_db=40.0, **limb), imposed="torque")
        # Linear: what a second torque, the subject's, makes is added to the angle alone.
        own = servo(1000 + seed, joint, snr_db=None, **limb)
        moved = replace(samples, angle=samples.angle + 0.3 * own.angle)
        fits.append(estimated(moved, "output-error")[0])
    assert_unbiased(fits, joint)


def test_arx_is_held_against_instruments_of_the_experiment():
    fit, _ = estimated(servo(3, own_Nm=1.0, command=False), "arx")
    low, high = fit.interval().T
    assert ((low < JOINT) & (high > JOINT)).all()


@pytest.mark.parametrize("own", [0.5, 3.0])
def test_an_untold_record_holds_the_truth_or_says_that_it_cannot_tell(own):
    for seed in range(2):
        samples = servo(seed, own_Nm=own, told=False, command=False, duration_s=20.0)
        fit, imposed = estimated(samples)
        low, high = fit.interval().T
        half = (high - low) / 2
        assert (np.abs((low + high) / 2 - JOINT) < 1.5 * half).all()
        assert imposed.name == "imposed"
        if imposed.verdict == "ok":
            assert "the torque is imposed" not in imposed.message


def test_a_device_that_gives_way_is_found_beside_own_torque():
    joint = np.array([0.07, 0.6, 20.0])
    for seed in range(2):
        samples = servo(
            seed, joint, device=HEAVY, own_Nm=0.3, angle_rms=0.05, told=False, command=False,
            duration_s=20.0,
        )  # fmt: skip
        fit, imposed = estimated(samples)
        low, high = fit.interval().T
        half = (high - low) / 2
        assert (np.abs((low + high) / 2 - joint) < 1.5 * half).all()
        # Neither limit is claimed: it gives way, cannot be told, or makes no difference.
        assert imposed.verdict == "cannot tell" or "is imposed" not in imposed.message
        if "gives way" in imposed.message:
            assert imposed.verdict in ("warning", "cannot tell")


def test_the_command_serves_whatever_the_device():
    joint = np.array([0.07, 0.6, 20.0])
    records = [servo(s, joint, device=HEAVY, own_Nm=0.3, angle_rms=0.05) for s in range(5)]
    assert all(source_of(samples) == "command" for samples in records)
    assert_unbiased([estimated(samples)[0] for samples in records], joint)


def test_nothing_is_asked_of_a_clean_record():
    """Sensors' noise alone: the torque's result, to the bit, and no warning."""
    recording, _ = simulate_bench(0.07, 1.2, 20.0, trials=3, snr_db=30.0)
    for row in range(3):
        samples = replace(from_recording(recording.select([row])), perturbation=None)
        asked, imposed = estimated(samples)
        told, _ = estimated(replace(samples, imposed="torque"))
        np.testing.assert_array_equal(asked.values, told.values)
        assert imposed.verdict == "ok"
        # No wider than by what was called alike: a standard error, or 1 % of the value.
        assert (asked.sd <= 2 * told.sd + 0.01 * told.values).all()


def test_a_limb_that_is_not_of_second_order_chooses_no_experiment():
    """A reflex bends the impedance: likelihoods of I, B, K then tell of the reflex."""
    samples = servo(2, own_Nm=0.3, told=False, command=False)
    late = np.concatenate([np.zeros(50), samples.angle[:-50]])
    bent = replace(samples, torque=samples.torque + 0.3 * JOINT[2] * late)
    answer = answered(prepare(bent, spectra_of(bent)), METHODS.named("iv"))
    assert answer.nats > 3 * NATS
    found = [way.estimate.parameters for way in answer.ways]
    assert {"torque", "angle"} <= set(answer.kept)
    finding = answer.finding(found)
    assert finding.verdict == "cannot tell"
    assert "departs from I, B and K" in finding.message


def test_a_hull_holds_what_it_is_made_of():
    units = ("kg m^2", "N m s/rad", "N m/rad")
    one = Parameters(("I", "B", "K"), units, JOINT, np.diag((0.01 * JOINT) ** 2), dof=20.0)
    other = replace(one, values=1.1 * JOINT, covariance=np.diag((0.02 * JOINT) ** 2))
    for centre in (one.values, middle([one, other])):
        limits = hull(one, [other], centre).interval()
        for part in (one, other):
            assert (limits[:, 0] <= part.interval()[:, 0] + 1e-12).all()
            assert (limits[:, 1] >= part.interval()[:, 1] - 1e-12).all()
    moved = shifted(replace(one, values=2 * JOINT), one, other)
    np.testing.assert_allclose(moved.values, 2.1 * JOINT)
    np.testing.assert_allclose(moved.sd, other.sd)


def test_the_fit_tells_what_was_imposed_and_how_it_is_known():
    fit = identify_elbow(servo(5, duration_s=20.0))
    assert fit.checks[0].name == "imposed"
    assert fit.checks[0].verdict == "ok"
    assert fit.summary.checks == fit.checks
    assert any("commanded angle" in note for note in fit.preparation)
    asked = identify_elbow(servo(5, own_Nm=3.0, duration_s=20.0, told=False, command=False))
    assert asked.checks[0].name == "imposed"


def test_a_command_that_the_joint_does_not_follow_is_left_out():
    samples = servo(6, duration_s=20.0)
    foreign = replace(samples, command=np.random.default_rng(1).standard_normal(20_000))
    fit = identify_elbow(foreign)
    assert any("explains 0 % of the motion: not used" in note for note in fit.preparation)
    assert any("measured angle" in note for note in fit.preparation)


def test_a_word_that_the_record_contradicts_is_named():
    """3 N m of own torque in a servo, told as an imposed torque; and the same told rightly."""
    samples = servo(1, own_Nm=3.0, command=False)
    _, wrong = estimated(replace(samples, imposed="torque"))
    assert wrong.verdict == "warning"
    assert "nats likelier otherwise" in wrong.message
    assert estimated(samples)[1].verdict == "ok"


@pytest.mark.study
def test_a_word_that_the_record_hardly_contradicts_is_said_and_allowed_for():
    """A device that gives way like the limb, told as an imposed torque: .3 N m of own torque."""
    joint, said = np.array([0.07, 0.6, 20.0]), []
    for seed in range(4):
        samples = servo(
            seed, joint, device=HEAVY, own_Nm=0.3, angle_rms=0.05, told=False, command=False,
            duration_s=10.0,
        )  # fmt: skip
        parameters, finding = estimated(replace(samples, imposed="torque"))
        said.append(finding.verdict)
        low, high = parameters.interval().T
        held = np.abs(joint - (low + high) / 2) < 0.75 * (high - low)
        assert finding.verdict == "warning" or held.all()
    assert "cannot tell" in said


@pytest.mark.study
def test_the_verb_takes_the_word_for_all_parts():
    from armimpedance.joint.elbow.show import elbow

    recording, _ = simulate_servo(*JOINT, trials=2, duration_s=6.0, told=False, command=False)
    fit = elbow(recording, imposed="position")
    for one in (fit, *fit.parts.values()):
        assert one.checks[0].name == "imposed"
        assert "as told" in one.checks[0].message
