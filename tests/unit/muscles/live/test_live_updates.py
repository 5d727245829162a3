"""Live updates: the batch result, derivatives, definiteness, lost channels, time, energy."""

from __future__ import annotations

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from made_up_arm import SUBJECT

from armimpedance.core.errors import InputError
from armimpedance.hand.levels import kinematic_arm
from armimpedance.limb.arm import TwoLinkArm
from armimpedance.muscles.live import Live, StiffnessForm
from armimpedance.muscles.live.activity import AGREEING, StreamClock
from armimpedance.muscles.live.result import VaryingSpring
from armimpedance.muscles.models import at_hand

SQUARE = np.array([1.0, 1.5])


def places(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    q = rng.uniform([0.3, 0.9], [1.8, 2.3], (count, 2))
    return q, rng.uniform(0, 0.35, (count, 6)), rng.normal(0, 5, (count, 2))


@pytest.mark.parametrize("gravity", [(0.0, 0.0), (0.0, -9.81)])
def test_a_live_update_is_the_batch_result(model, gravity):
    arm = replace(kinematic_arm(SUBJECT), gravity_m_s2=gravity)
    live = Live(model, arm)
    q, alpha, force = places(60)
    batch = at_hand(model.predict(q, alpha), arm, force)
    definite = 0
    for p in range(len(q)):
        one = live.update(alpha[p], q=q[p], force=force[p])
        assert one.extrapolating == batch.joint.extrapolated[p]
        definite += one.definite
        if one.definite:
            K, sd = batch.stiffness_matrices[p], batch.sd("stiffness")[p]
            np.testing.assert_allclose(one.stiffness, K, rtol=0, atol=1e-12 * np.abs(K).max())
            # of covariances much cancels
            np.testing.assert_allclose(one.sd, sd, rtol=0, atol=1e-11 * sd.max())
    assert definite > 50


def test_shares_and_rest_add_up_to_the_hands_stiffness(model):
    live = Live(model, SUBJECT)
    one = live.update(np.full(6, 0.1), q=SQUARE)
    form = live.form
    V = np.linalg.inv(live.arm.jacobian(SQUARE))
    passive = np.trace(V.T @ np.diag(form.passive) @ V) / np.trace(one.stiffness)
    assert one.share.sum() + passive == pytest.approx(1)
    assert (one.share > 0).all()


def test_the_reach_of_a_muscle_is_the_derivative_by_its_stiffness(model):
    form, h = Live(model, SUBJECT).form, 1e-3
    alpha = np.zeros(6)
    base = Live(form, SUBJECT).update(alpha, q=SQUARE)
    for i in range(6):
        stiffer = form.stiffness.copy()
        stiffer[i, 0] += h
        more = Live(replace(form, stiffness=stiffer), SUBJECT).update(alpha, q=SQUARE)
        u = base.reach[:, i]
        np.testing.assert_allclose((more.stiffness - base.stiffness) / h, np.outer(u, u), rtol=1e-4)


def test_bands_widen_by_the_errors_of_the_activations(model):
    live, h = Live(model, SUBJECT), 1e-6
    alpha, sd = np.full(6, 0.1), np.array([0.02, 0, 0, 0, 0.01, 0])
    sure, unsure = live.update(alpha, q=SQUARE), live.update(alpha, q=SQUARE, signal_sd=sd)
    packed = np.triu_indices(2)
    slopes = []
    for i in range(6):
        more = alpha.copy()
        more[i] += h
        slopes.append((live.update(more, q=SQUARE).stiffness - sure.stiffness)[packed] / h)
    spread = np.array(slopes) * sd[:, None]
    expected = sure.covariance + spread.T @ spread
    np.testing.assert_allclose(unsure.covariance, expected, rtol=1e-4)


class ThreeLinks:
    """A planar arm of three links: one joint more than the hand has axes."""

    joints, axes = 3, 2
    lengths = np.array([0.3, 0.25, 0.1])

    def hand_position(self, q):
        angle = np.cumsum(q)
        return np.array([self.lengths @ np.cos(angle), self.lengths @ np.sin(angle)])

    def jacobian(self, q):
        angle = np.cumsum(q)
        columns = np.stack([-self.lengths * np.sin(angle), self.lengths * np.cos(angle)])
        return np.cumsum(columns[:, ::-1], axis=1)[:, ::-1]

    def jacobian_derivative(self, q):
        h = 1e-6
        steps = h * np.eye(3)
        slopes = [(self.jacobian(q + s) - self.jacobian(q - s)) / (2 * h) for s in steps]
        return np.stack(slopes, axis=-1)

    def gravity_gradient(self, _):
        return np.zeros((3, 3))


def redundant_form() -> StiffnessForm:
    rng = np.random.default_rng(3)
    exponents = np.vstack([np.eye(3), 2 * np.eye(3), [[1, 1, 0], [0, 1, 1]]]).astype(int)
    m, count = 8, 4
    return StiffnessForm(
        muscles=tuple(f"m{i}" for i in range(m)),
        exponents=exponents,
        lengths=rng.normal(0, 0.03, (m, len(exponents))),
        muscle=np.arange(count),
        change=rng.normal(0, 0.003, (count, len(exponents))),
        box=np.tile([0.0, 2.0], (3, 1)),
        rising=np.eye(2),
        highest=np.full(m, 0.4),
        stiffness=rng.uniform(2e3, 8e3, (m, 2)),
        per_tension=1 / 75,
        passive=np.ones(3),
        covariance=np.diag(np.r_[np.ones(count), np.full(2 * m, 300.0**2), np.full(3, 0.1**2)]),
        dof=30.0,
    )


def test_a_redundant_arm_yields_with_all_its_joints():
    form, arm, q = redundant_form(), ThreeLinks(), np.array([0.4, 0.9, 0.6])
    alpha = np.full(8, 0.2)
    one = Live(form, arm).update(alpha, q=q, force=[1.0, -2.0])
    J = arm.jacobian(q)
    K_j = one.joint_stiffness
    np.testing.assert_allclose(one.stiffness, np.linalg.inv(J @ np.linalg.inv(K_j) @ J.T))
    assert one.definite
    # errors to first order, parameter by parameter
    slopes = []
    for name, h in (("change", 1e-4), ("stiffness", 1e-2), ("passive", 1e-5)):
        value = getattr(form, name)
        count = 4 if name == "change" else value.size
        for k in range(count):
            if name == "change":
                lengths = form.lengths.copy()
                lengths[form.muscle[k]] += h * form.change[k]
                other = replace(form, lengths=lengths)
            else:
                moved = value.ravel().copy()
                moved[k] += h
                other = replace(form, **{name: moved.reshape(value.shape)})
            more = Live(other, arm).update(alpha, q=q, force=[1.0, -2.0])
            slopes.append((more.stiffness - one.stiffness)[np.triu_indices(2)] / h)
    expected = np.array(slopes).T @ form.covariance @ np.array(slopes)
    np.testing.assert_allclose(one.covariance, expected, rtol=1e-2, atol=1e-4 * expected.max())


def test_an_indefinite_joint_stiffness_is_flagged_and_the_hands_stays_definite(model):
    live = Live(model, SUBJECT)
    for force in np.random.default_rng(1).normal(0, 500, (200, 2)):
        one = live.update(np.zeros(6), q=SQUARE, force=force)
        J = live.arm.jacobian(SQUARE)
        gamma = np.tensordot(force, live.arm.jacobian_derivative(SQUARE), 1)
        K_j = model.predict(SQUARE, np.zeros(6)).stiffness_matrices[0] + gamma
        least = np.linalg.eigvalsh(K_j)[0]
        assert one.definite == (least >= 1e-3 * np.linalg.eigvalsh(K_j)[1])
        assert np.linalg.eigvalsh(one.stiffness)[0] > 0
        assert np.linalg.eigvalsh(J.T @ one.stiffness @ J)[0] > 0


def test_a_lost_channel_is_held_and_doubted(model):
    live = Live(model, SUBJECT)
    alpha = np.full(6, 0.2)
    good = live.update(alpha, q=SQUARE, time_s=0.0)
    gone = alpha.copy()
    gone[2] = np.nan
    widths = []
    for k in range(1, 400):
        one = live.update(gone, q=SQUARE, time_s=k * 1e-3)
        assert one.flags == (f"lost: {live.muscles[2]}",)
        np.testing.assert_array_equal(one.activation, alpha)
        widths.append(one.half_width())
    assert (np.diff(widths, axis=0) >= -1e-9).all()
    assert (widths[-1] > good.half_width()).all()
    back = live.update(alpha, q=SQUARE, time_s=0.4)
    np.testing.assert_array_equal(back.half_width(), good.half_width())


@pytest.mark.parametrize(
    "sample",
    [
        {"signal": [0.1] * 5, "q": SQUARE},
        {"signal": "abc", "q": SQUARE},
        {"signal": [0.1] * 6},
        {"signal": [0.1] * 6, "q": [1.0, np.nan]},
        {"signal": [0.1] * 6, "q": [57.0, 90.0]},
        {"signal": [0.1] * 6, "q": [1.0, 0.0]},
        {"signal": [0.1] * 6, "hand": [5.0, 5.0]},
        {"signal": [0.1] * 6, "q": SQUARE, "force": [np.inf, 0]},
        {"signal": [0.1] * 6, "q": SQUARE, "signal_sd": [np.nan] * 6},
        {"signal": [0.1] * 6, "q": SQUARE, "displacement": [1, 2, 3]},
        {"signal": [0.1] * 6, "q": SQUARE, "time_s": np.nan},
    ],
)
def test_what_cannot_be_taken_is_refused_and_leaves_no_trace(model, sample):
    live, untouched = Live(model, SUBJECT), Live(model, SUBJECT)
    with pytest.raises(InputError):
        live.update(**sample)
    after, alone = (one.update([0.1] * 6, q=SQUARE, time_s=3.0) for one in (live, untouched))
    assert after.to_dict() == alone.to_dict()


@pytest.mark.parametrize(
    "wrong",
    [
        *({"rate_hz": bad} for bad in (0.0, np.nan, np.inf)),
        *({"limit_N_m_s": bad} for bad in (0.0, -1.0, np.nan)),
        *({"posture_step_rad": bad} for bad in (-1.0, np.nan, np.inf)),
    ],
)
def test_options_that_cannot_be_are_refused(model, wrong):
    with pytest.raises(InputError):
        Live(model, SUBJECT, **wrong)


def test_a_posture_is_kept_while_no_joint_moves_by_more_than_told(model):
    live, always = Live(model, SUBJECT, posture_step_rad=0.01), Live(model, SUBJECT)
    for step, same in ((0.0, True), (0.009, False), (0.011, True)):
        one, other = (form.update([0.1] * 6, q=SQUARE + step) for form in (live, always))
        assert np.array_equal(one.stiffness, other.stiffness) is same


def test_the_hands_place_says_the_posture(model):
    live = Live(model, SUBJECT)
    assert isinstance(live.arm, TwoLinkArm)
    by_hand = live.update([0.1] * 6, hand=live.arm.hand_position(SQUARE))
    by_angles = live.update([0.1] * 6, q=SQUARE)
    np.testing.assert_allclose(by_hand.stiffness, by_angles.stiffness, rtol=1e-9)


def refusals(clock: StreamClock, stamps: list[float]) -> list[float]:
    refused = []
    for stamp in stamps:
        try:
            clock.next(stamp)
        except InputError:
            refused.append(stamp)
    return refused


def test_late_and_repeated_stamps_are_refused_and_nothing_else():
    assert refusals(StreamClock(1000), [0.0, 0.001, 0.001, 0.003, 0.002, 0.004]) == [0.001, 0.002]


def test_one_stamp_far_ahead_does_not_make_the_others_late():
    clock = StreamClock(1000)
    stamps = [0.001 * k for k in range(50)]
    assert refusals(clock, stamps[:20] + [1e9] + stamps[20:]) == [1e9]


def test_a_sender_that_begins_anew_is_followed():
    clock = StreamClock(1000)
    refusals(clock, [100.0, 100.001])
    refused = refusals(clock, [0.001 * k for k in range(100)])
    assert len(refused) == AGREEING - 1


def test_a_sender_that_begins_anew_does_not_make_the_commanded_stiffness_jump(model):
    limit = 1000.0
    live = Live(model, SUBJECT, limit_N_m_s=limit)
    commanded = [live.update([0.0] * 6, q=SQUARE, time_s=100.0).commanded]
    for k in range(AGREEING + 5):
        with contextlib.suppress(InputError):
            commanded.append(live.update([0.3] * 6, q=SQUARE, time_s=k / 1000).commanded)
    assert len(commanded) == 7
    assert np.abs(np.linalg.eigvalsh(np.diff(commanded, axis=0))).max() <= limit / 1000 + 1e-9


def test_stamps_that_nearly_coincide_make_no_number_infinite(model):
    live = Live(model, SUBJECT)
    stamps = [0.0, 5e-324, 1e-300, 1e-12, 0.001]
    for k, stamp in enumerate(stamps):
        one = live.update([0.3 * (k % 2)] * 6, q=SQUARE, time_s=stamp)
        assert np.isfinite(one.growth_W_m2)


def test_gaps_are_flagged(model):
    live = Live(model, SUBJECT)
    flags = [live.update([0.1] * 6, q=SQUARE, time_s=t).flags for t in (0.0, 0.001, 0.006, 0.007)]
    assert flags == [(), (), ("gap",), ()]


def test_the_spring_keeps_its_limit_stays_definite_and_arrives():
    spring = VaryingSpring(1000.0, 0.001)
    soft, stiff = np.diag([100.0, 50.0]), np.array([[400.0, 150.0], [150.0, 200.0]])
    spring.follow(soft, 0.001, None)
    course = [soft] + [spring.follow(stiff, 0.001, None) for _ in range(600)]
    steps = np.diff(course, axis=0)
    assert np.abs(np.linalg.eigvalsh(steps)).max() <= 1.0 + 1e-9
    assert np.linalg.eigvalsh(course).min() > 0
    np.testing.assert_array_equal(course[-1], stiff)


def test_stretching_soft_and_releasing_stiff_gains_the_energy_that_is_counted():
    """A cycle of displacement and stiffness: the work taken out is what the changes added."""
    spring, K0, K1 = VaryingSpring(None, 1.0), 100 * np.eye(2), 300 * np.eye(2)
    rng = np.random.default_rng(2)
    e, K = np.zeros(2), K0
    spring.follow(K0, 0.001, e)
    work = 0.0  # by the hand on the spring
    for k in range(400):
        there = rng.normal(0, 0.02, 2) if k < 399 else np.zeros(2)
        work += (there @ K @ there - e @ K @ e) / 2
        e, K = there, K0 + (K1 - K0) * rng.random() if k < 398 else K0
        spring.follow(K, 0.001, e)
    assert spring.added_J == pytest.approx(-work)
