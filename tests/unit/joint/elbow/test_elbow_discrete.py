"""I, B, K to a difference equation and back: exact, differentiable, and never NaN."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from armimpedance.core.errors import ArmImpedanceError, EstimationError, InputError
from armimpedance.joint.elbow.stationary.discrete import (
    DiscreteModel,
    jacobian,
    simulated,
    to_continuous,
    to_discrete,
)
from manipulandum_sim.elbow.bench import simulate_bench

JOINTS = {
    "underdamped": (0.07, 0.6, 20.0),
    "overdamped": (0.07, 3.5, 9.0),
    "critical": (0.07, 2 * np.sqrt(0.07 * 9.0), 9.0),
    "ankle": (0.0172, 1.22, 110.0),
}


@pytest.mark.parametrize("structure", ["zoh", "tustin"])
@pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS)
def test_there_and_back_at_1_khz(joint, structure):
    back = to_continuous(to_discrete(*joint, 1000.0, structure))
    np.testing.assert_allclose(back, joint, rtol=1e-9)


@settings(max_examples=60, deadline=None)
@given(
    I=st.floats(0.005, 0.3),
    damping=st.floats(0.05, 5.0),
    frequency=st.floats(2.0, 100.0),
    rate=st.sampled_from([200.0, 500.0, 1000.0]),
    structure=st.sampled_from(["zoh", "tustin"]),
)
def test_there_and_back_over_the_range_of_joints(I, damping, frequency, rate, structure):  # noqa: E741
    joint = np.array([I, 2 * damping * I * frequency, I * frequency**2])
    model = to_discrete(*joint, rate, structure)
    fastest = frequency * (damping + np.sqrt(max(damping**2 - 1, 0)))
    if structure == "tustin" and damping >= 1 and fastest >= 2 * rate:
        # A real pole so fast that the bilinear transform turns its sign.
        with pytest.raises(EstimationError, match="negative real axis"):
            to_continuous(model)
        return
    np.testing.assert_allclose(to_continuous(model), joint, rtol=1e-4)


@pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS)
def test_the_zero_order_hold_is_the_held_torques_motion(joint):
    """A held step of torque: the angle in closed form at every sample."""
    from scipy.signal import lti

    inertia, viscosity, stiffness = joint
    model = to_discrete(*joint, 200.0, "zoh")
    angle = simulated(model, np.ones(400))
    time = np.arange(400) / 200.0
    _, exact = lti([1.0], [inertia, viscosity, stiffness]).step(T=time)
    np.testing.assert_allclose(angle, exact, atol=1e-8 / stiffness)


@pytest.mark.parametrize("structure", ["zoh", "tustin"])
@pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS)
def test_the_jacobian_is_the_derivative(joint, structure):
    model = to_discrete(*joint, 100.0, structure)
    at = np.concatenate([model.a, model.b])

    def function(p):
        return to_continuous(DiscreteModel(p[:2], p[2:], 100.0, structure))

    columns = []
    for j, h in enumerate(1e-5 * np.abs(at)):
        e = np.zeros_like(at)
        e[j] = h
        f = [function(at + m * e) for m in (-2, -1, 1, 2)]
        columns.append((f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * h))
    scale = np.abs(at) / np.asarray(joint)[:, None]
    np.testing.assert_allclose(
        jacobian(model) * scale, np.stack(columns, axis=1) * scale, atol=1e-5, rtol=1e-5
    )


@pytest.mark.parametrize("structure", ["zoh", "tustin"])
@pytest.mark.parametrize(
    ("a", "b", "says"),
    [
        ((-2.1, 1.2), 1.0, "unstable"),
        ((-1.9, 1.0), 1.0, "unstable"),
        ((-0.4, -0.05), 1.0, "negative real axis"),
        ((0.9, 0.2), 1.0, "negative real axis"),
        ((-0.9, 0.0), 1.0, "negative real axis"),
        ((-1.9, 0.92), -1.0, "no joint"),
        ((-1.9, 0.92), 0.0, "no gain"),
    ],
)
def test_what_is_no_joint_is_a_typed_failure(a, b, says, structure):
    count = 2 if structure == "zoh" else 3
    model = DiscreteModel(np.array(a), np.full(count, b), 100.0, structure)
    for function in (to_continuous, jacobian):
        with pytest.raises(EstimationError, match=says) as told:
            function(model)
        assert "\n" not in str(told.value)


@settings(max_examples=200, deadline=None)
@given(
    a=st.tuples(st.floats(-3, 3), st.floats(-2, 2)),
    b=st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
)
def test_any_coefficients_give_a_joint_or_a_typed_failure(a, b):
    model = DiscreteModel(np.array(a), np.array(b), 100.0, "zoh")
    try:
        values = to_continuous(model)
    except ArmImpedanceError:
        return
    assert (values > 0).all()
    assert np.isfinite(values).all()


def test_parameters_rates_and_structures_that_cannot_be():
    for wrong in ((0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, np.nan)):
        with pytest.raises(InputError):
            to_discrete(*wrong, 100.0)
    with pytest.raises(InputError):
        to_discrete(0.07, 0.6, 20.0, 0.0)
    with pytest.raises(InputError):
        to_discrete(0.07, 0.6, 20.0, 100.0, "euler")


def test_the_bilinear_model_simulates_the_bench():
    """A band-limited torque: the model at 1 kHz follows an integration on a finer grid."""
    _, truth = simulate_bench(0.07, 3.5, 9.0, duration_s=4.0, seed=3)
    angle = simulated(to_discrete(0.07, 3.5, 9.0, 1000.0, "tustin"), truth.torque[0])
    settled = slice(3000, None)
    error = (angle - truth.angle[0])[settled]
    # What is left of the unlike states at the start: exp(-3 s * 2.7 /s).
    assert np.abs(error).max() < 2e-3 * np.abs(truth.angle).max()
