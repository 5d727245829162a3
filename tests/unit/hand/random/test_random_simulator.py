"""The simulated person under random perturbations against independent differences of her plant."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.random import identify_random
from armimpedance.hand.random.equations import RandomEquations, _sized
from armimpedance.hand.random.show import random
from manipulandum_sim.hand import Reflex, find_subject
from manipulandum_sim.random_hand import RandomRig, simulate_random
from manipulandum_sim.random_hand.limbs import SpaceLimb
from manipulandum_sim.space import SpaceCondition, SpaceRig


@pytest.mark.study
def test_the_linear_limb_of_a_noise_free_session_is_the_truth():
    recording, truth = simulate_random(
        seed=1, trials=2, duration_s=5.0, noise="none", amplitude_m=2e-4
    )
    one = identify_random(recording)[0].estimate
    for found, true in ((one.inertia, truth.M_e), (one.stiffness, truth.K_e)):
        assert np.linalg.norm(found - true) < 0.02 * np.linalg.norm(true)


def test_the_reflex_at_the_hand_is_what_a_delayed_stretch_pulls():
    plant = SpaceCondition().plant(find_subject("A"), SpaceRig())
    limb = SpaceLimb(plant, 0.25)
    q, still = limb.start[None], np.zeros((1, 3))
    rest = limb.at(q, still, np.zeros((1, 12)))
    R = np.empty((3, 3))
    for axis in range(3):
        dx = np.zeros(3)
        dx[axis] = 1e-5
        moved = limb.at(q + np.linalg.solve(rest.J[0], dx), still, None)
        pull = limb.at(q, still, moved.stretch).pull[0] - rest.pull[0]
        R[:, axis] = -np.linalg.solve(rest.J[0].T, pull) / 1e-5
    assert np.allclose(R, limb.reflex_at_hand(), rtol=1e-3, atol=0.1)


@pytest.mark.parametrize(
    "wrong",
    [
        {"axes": 4},
        {"imposed": "both"},
        {"band_hz": (5.0, 2.0)},
        {"elbow": "free"},
        {"axes": 3, "elbow": "free", "reflex": Reflex()},
        {"wrist": "free"},
        {"axes": 3, "wrist": "free", "reflex": Reflex()},
        {"force_n": 0.0},
    ],
)
def test_a_rig_that_cannot_be_is_refused(wrong):
    with pytest.raises(InputError):
        RandomRig(**wrong)


@pytest.mark.study
def test_a_free_wrist_is_refused_by_name():
    # 16 lines for each of nine elements between .5 and 20 Hz: 7.4 s at the least
    recording, _ = simulate_random(seed=4, axes=3, wrist="free", trials=1, duration_s=8.0)
    with pytest.raises(InputError, match="wrist"):
        random(recording)
    assert random(recording, despite="wrist")[0].warnings[0].startswith("despite wrist")


def test_the_size_of_an_inner_mode_is_that_of_its_own_column():
    """All directions at once against the equations written out for one."""
    rng = np.random.default_rng(6)
    d, p = 3, 37
    A, root = rng.standard_normal((p, p)) + 8 * np.eye(p), rng.standard_normal((p, p))
    equations = RandomEquations(A, rng.standard_normal(p), root @ root.T)
    pairs = rng.standard_normal((4, 9))
    size, error, shift = _sized(equations, pairs, d)
    rows = np.arange(36).reshape(d, 4, d)
    order = rows[:, :3].transpose(1, 0, 2).ravel()  # M, B, K row by row
    for c, pair in enumerate(pairs):
        D = np.zeros((36, 28))
        D[order, np.arange(27)], D[rows[:, 3].ravel(), 27] = 1.0, pair
        small, meat = D.T @ A[:-1, :-1] @ D, D.T @ equations.meat[:-1, :-1] @ D
        inverse = np.linalg.inv(small)
        theta = inverse @ D.T @ equations.b[:-1]
        assert size[c] == pytest.approx(theta[-1])
        assert error[c] == pytest.approx(np.sqrt((inverse @ meat @ inverse.T)[-1, -1]))
        alone = np.linalg.solve(small[:-1, :-1], (D.T @ equations.b[:-1])[:-1])
        assert shift[c] == pytest.approx((alone - theta[:-1]) / theta[-1])


@pytest.mark.study
@pytest.mark.parametrize("wrist", ["locked", "free"])
def test_a_free_wrist_is_named_and_a_locked_one_is_not(wrist):
    recording, _ = simulate_random(seed=4, axes=3, wrist=wrist, trials=1, duration_s=10.0)
    one = identify_random(recording)[0].estimate
    assert any("wrist" in text for text in one.warnings) == (wrist == "free")
    # a stiffness that no limb has at rest is said to be none
    definite = np.linalg.eigvalsh(one.stiffness + one.stiffness.T)[0] > 0
    assert any("stiffness is not positive definite" in text for text in one.warnings) != definite
