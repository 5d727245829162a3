"""The index of co-contraction: absolute torques, calibrated isometrically."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.joint.elbow.emg.imcj import calibrate_imcj, imcj
from armimpedance.joint.elbow.emg.roles import roles_of
from manipulandum_sim.elbow.simulate import simulate_elbow


@pytest.fixture(scope="module", params=[False, True], ids=["two", "four"])
def calibration(request):
    recording, truth = simulate_elbow(
        "calibration", seed=3, repetitions=3, duration_s=3.0, four_muscles=request.param
    )
    return recording, truth, calibrate_imcj(recording)


@pytest.fixture(scope="module")
def two():
    return simulate_elbow("calibration", seed=4, repetitions=2, duration_s=3.0)


def test_gains_are_the_subjects_torques_per_activation(calibration):
    """t with 22 or 24 degrees of freedom: beyond 4.5 standard errors once in 5,000."""
    _, truth, made = calibration
    a = made.law.parameters.values[1:]
    assert (np.abs(a - truth.torque_per_activation) < 4.5 * made.law.parameters.sd[1:]).all()
    assert np.sign(a).tolist() == [role.sign for role in made.roles]
    assert made.warnings == ()
    assert (made.law.parameters.sd[1:] < 0.1 * np.abs(a)).all()


def test_the_index_is_the_sum_of_absolute_torques(calibration):
    """Where flexors and extensors cancel, the net torque is near zero and the index is not."""
    _, truth, made = calibration
    true = np.abs(truth.torque_per_activation)
    s = 0.2 * true.max() / true
    value, sd = (float(x) for x in imcj(made, s))
    assert abs(value - true @ s) < 4.5 * sd
    assert abs(s @ truth.torque_per_activation) < 0.2 * value
    batch, sds = imcj(made, np.stack([s, 2 * s, 0 * s]))
    assert batch == pytest.approx([value, 2 * value, 0])
    assert sds == pytest.approx([sd, 2 * sd, 0])


def test_errors_of_amplitudes_add_to_its_standard_error(two):
    made = calibrate_imcj(two[0])
    a = made.law.parameters.values[1:]
    exact, blurred = (imcj(made, [0.2, 0.2], sd)[1] for sd in (0.0, [0.01, 0.02]))
    assert blurred**2 - exact**2 == pytest.approx(((a * [0.01, 0.02]) ** 2).sum())


def test_standard_error_is_the_spread_of_the_index_over_draws_of_the_gains(two):
    """20,000 draws: a standard deviation known to 0.5 %; no |a_i| changes its sign here."""
    made = calibrate_imcj(two[0])
    rng = np.random.default_rng(5)
    a = rng.multivariate_normal(made.law.parameters.values, made.law.covariance, 20_000)[:, 1:]
    s = np.array([0.3, 0.1])
    assert imcj(made, s)[1] == pytest.approx((np.abs(a) @ s).std(), rel=0.02)


def test_its_sign_convention_does_not_matter(two):
    recording, _ = two
    turned = replace(recording, position=-recording.position, force=-recording.force)
    made, other = calibrate_imcj(recording), calibrate_imcj(turned, flexion_positive=False)
    assert other.law.parameters.values == pytest.approx(made.law.parameters.values, rel=1e-9)
    wrong = calibrate_imcj(turned)
    assert "every muscle pulls the wrong way" in wrong.warnings[-1]
    assert imcj(wrong, [0.2, 0.2])[0] == pytest.approx(imcj(made, [0.2, 0.2])[0], rel=1e-9)


def test_an_extensor_that_flexes_is_warned_of(calibration):
    recording, _, _ = calibration
    if len(recording.muscles) == 2:
        exchanged = replace(recording, emg=recording.emg[:, ::-1])
        assert "every muscle pulls the wrong way" in calibrate_imcj(exchanged).warnings[-1]
    else:
        made = calibrate_imcj(recording, roles={"brachioradialis": "extensor"})
        assert len(made.warnings) == 1
        assert made.warnings[0].startswith("brachioradialis, an extensor, has a_brachioradialis")
        assert "surely" in made.warnings[0]


def test_a_joint_that_moves_is_refused(two):
    recording, _ = two
    moving = np.array(recording.position)
    moving[recording.samples_of(3)] += 0.1 * np.sin(np.arange(3000) / 100)[:, None]
    number = recording.trials["trial"].iloc[3]
    with pytest.raises(InputError, match=rf"trial {number}: the joint moves by 0\.07\d rad"):
        calibrate_imcj(replace(recording, position=moving))


def test_the_motors_command_is_refused(two):
    for torque in ("commanded", None):
        with pytest.raises(InputError, match="expected interaction"):
            calibrate_imcj(replace(two[0], torque=torque))


def test_too_few_trials_and_trials_of_one_pattern_are_refused(two):
    recording, _ = two
    with pytest.raises(InputError, match="operating points"):
        calibrate_imcj(recording.select([0, 1, 2]))
    alike = np.array(recording.emg)
    alike[:, 1] = 0.3 * alike[:, 0]
    with pytest.raises(NotIdentifiableError, match="biceps and triceps"):
        calibrate_imcj(replace(recording, emg=alike))


def test_unknown_muscles_need_a_role(two):
    recording, _ = two
    columns = [c.replace("triceps", "m2").replace("biceps", "m1") for c in recording.trials]
    other = replace(
        recording, muscles=("m1", "m2"), trials=recording.trials.set_axis(columns, axis=1)
    )
    with pytest.raises(InputError, match="whether m1 flexes or extends"):
        calibrate_imcj(other)
    made = calibrate_imcj(other, roles={"m1": "flexor", "m2": "extensor"})
    known = calibrate_imcj(recording)
    assert made.law.parameters.values == pytest.approx(known.law.parameters.values)


@pytest.mark.parametrize(
    ("muscles", "given", "message"),
    [
        (("biceps", "brachialis"), None, "no extensor among"),
        (("triceps", "anconeus"), None, "no flexor among"),
        (("biceps", "x"), {"x": "pronator"}, "x as 'pronator'"),
    ],
)
def test_roles_that_make_no_index(muscles, given, message):
    with pytest.raises(InputError, match=message):
        roles_of(muscles, given)


def test_the_four_muscle_form_has_two_of_each_kind():
    roles = roles_of(("biceps", "triceps_long", "brachioradialis", "triceps_lateral"))
    assert sorted((r.action, r.biarticular) for r in roles) == [
        ("extensor", False),
        ("extensor", True),
        ("flexor", False),
        ("flexor", True),
    ]


def test_amplitudes_of_other_muscles_are_refused(two):
    with pytest.raises(InputError, match=r"expected \(\.\.\., 2\)"):
        imcj(calibrate_imcj(two[0]), [0.1, 0.2, 0.3])
