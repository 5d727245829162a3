"""The samples of one joint: signs, what a recording must say; compliance without a model."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError, RecordError
from armimpedance.core.records import Subject
from armimpedance.joint.elbow.frequency_response import frequency_response, model_compliance
from armimpedance.joint.elbow.samples import JointSamples, from_recording
from armimpedance.joint.elbow.stationary.identify import identify_elbow
from manipulandum_sim.elbow.bench import simulate_bench

JOINT = (0.07, 0.6, 20.0)


def test_the_torque_is_that_on_the_limb_and_the_perturbation_comes_along():
    recording, truth = simulate_bench(*JOINT, duration_s=2.0, trials=2, snr_db=30)
    samples = from_recording(recording)
    noise = samples.torque - truth.torque.ravel()
    assert np.corrcoef(samples.torque, truth.torque.ravel())[0, 1] > 0.99
    # 30 dB, 4000 samples: the ratio of powers is known within some 2 % (one standard error)
    assert 10 * np.log10(truth.torque.var() / noise.var()) == pytest.approx(30, abs=0.5)
    np.testing.assert_array_equal(samples.perturbation, truth.torque.ravel())
    assert samples.trials == ("1", "2")


def test_a_recording_must_say_which_torque_it_holds():
    recording, _ = simulate_bench(*JOINT, duration_s=1.0)
    with pytest.raises(InputError, match=r"column torque.*interaction.*commanded"):
        from_recording(replace(recording, torque=None))


def test_a_perturbation_that_is_not_said_to_be_random_is_told():
    recording, _ = simulate_bench(*JOINT, duration_s=1.0)
    assert from_recording(recording).notes == ()
    (note,) = from_recording(replace(recording, perturbation="returning")).notes
    assert "stochastic" in note


def test_a_perturbation_that_was_never_written_is_not_used():
    recording, _ = simulate_bench(*JOINT, duration_s=4.0, trials=2, snr_db=30)
    (column,) = recording.extra
    blank = np.where(np.arange(8000) < 4000, recording.extra[column], 0.0)
    samples = from_recording(replace(recording, extra={column: blank}))
    assert samples.perturbation is None
    assert "not used" in samples.notes[0]
    assert identify_elbow(samples).stiffness.value == pytest.approx(JOINT[2], rel=0.1)
    with pytest.raises(InputError, match="perturbation of trial 2"):
        identify_elbow(replace(samples, perturbation=blank))


def test_degrees_are_not_taken_for_radians():
    recording, _ = simulate_bench(*JOINT, duration_s=1.0)
    with pytest.raises(InputError, match="q1 up to .* degrees"):
        from_recording(replace(recording, position=70 + 180 / np.pi * recording.position))


@pytest.mark.parametrize("joint", [0, 2, -1])
def test_a_joint_that_is_not_there_is_refused(joint):
    recording, _ = simulate_bench(*JOINT, duration_s=1.0)
    with pytest.raises(InputError, match="expected 1 to 1"):
        from_recording(recording, joint)


def test_a_hand_is_no_joint():
    recording, _ = simulate_bench(*JOINT, duration_s=1.0)
    with pytest.raises(InputError, match="kind 'joint'"):
        from_recording(replace(recording, kind="hand"))


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"torque": np.zeros(3)}, "angle has shape"),
        ({"angle": np.full(4, np.nan)}, "not finite"),
        ({"offsets": np.array([0, 4, 4])}, "offsets"),
        ({"sample_rate_hz": 0.0}, "sample rate"),
        ({"perturbation": np.zeros(5)}, "perturbation has shape"),
    ],
)
def test_samples_that_do_not_belong_together_are_refused(change, match):
    good = {
        "sample_rate_hz": 100.0,
        "trials": ("1",),
        "offsets": np.array([0, 4]),
        "torque": np.zeros(4),
        "angle": np.zeros(4),
    }
    with pytest.raises(RecordError, match=match):
        JointSamples(**{**good, **change})


def _worst_error(samples, segment_s):
    measured = frequency_response(samples, segment_s)
    band = (measured.frequency_hz > 1) & (measured.frequency_hz < 10)
    model = model_compliance(measured.frequency_hz, np.array(JOINT))[band]
    error = np.abs(measured.compliance[band] / model - 1).max()
    return error, 1 - measured.coherence[band].min()


def test_the_compliance_without_noise_is_that_of_the_equation_but_for_leakage():
    recording, _ = simulate_bench(*JOINT, duration_s=30.0, trials=6)
    samples = from_recording(recording)
    short, long = _worst_error(samples, 2.0), _worst_error(samples, 8.0)
    # leakage falls with the square of the segments' length: sixteen-fold, its scatter less
    assert all(b < a / 4 for a, b in zip(short, long, strict=True))
    assert max(long) < 0.05


def test_voluntary_torque_does_not_bias_the_compliance_where_the_perturbation_is_known():
    recording, truth = simulate_bench(*JOINT, duration_s=15.0, trials=6, seed=1)
    # the subject pushes against a device that yields: the same torque in both channels, and motion
    push = np.random.default_rng(2).standard_normal(truth.torque.size) * truth.torque.std()
    samples = replace(from_recording(recording), torque=truth.torque.ravel() + push)
    f = frequency_response(samples)
    blind = frequency_response(replace(samples, perturbation=None))
    band = (f.frequency_hz > 1) & (f.frequency_hz < 8)
    model = model_compliance(f.frequency_hz[band], np.array(JOINT))
    found = np.abs(f.compliance[band] / model)
    seen = {round(v, 3) for v in blind.frequency_hz}
    known = np.array([round(v, 3) in seen for v in f.frequency_hz[band]])
    assert np.median(found[known]) == pytest.approx(1, abs=0.05)
    index = np.searchsorted(blind.frequency_hz, f.frequency_hz[band][known])
    biased = np.abs(blind.compliance[index] / model[known])
    assert np.median(biased) < np.median(found[known])


def test_a_trial_shorter_than_a_segment_has_no_spectrum():
    recording, _ = simulate_bench(*JOINT, duration_s=1.0)
    with pytest.raises(InputError, match="at least 4 s"):
        frequency_response(from_recording(recording))


def test_an_inertia_is_held_against_the_size_of_the_person():
    """Forearm and hand about the elbow, after Winter: by two rows of his table, or by that of both.

    The hand's row counts to the finger tip, that of both to the wrist: they differ by 7 %.
    """
    recording, _ = simulate_bench(0.07, 1.2, 20.0, duration_s=6.0, seed=3)
    assert from_recording(recording).expected_inertia is None
    person = Subject(mass_kg=70.0, height_m=1.75)
    assert from_recording(replace(recording, subject=person)).expected_inertia is None
    person = replace(person, forearm_hand_m=0.35)
    told = replace(recording, subject=person)
    # forearm and hand in one: .022 of the mass, radius of gyration .827 of elbow to wrist
    by_row = 0.022 * 70 * (0.827 * 0.146 * 1.75) ** 2
    assert from_recording(told).expected_inertia == pytest.approx(by_row, rel=0.1)
    for record, verdict in ((told, "ok"), (replace(told, force=told.force / 9.81), "warning")):
        (size,) = (c for c in identify_elbow(from_recording(record)).checks if c.name == "units")
        assert size.verdict == verdict
