"""Free polynomials over posture: they recover polynomials, and say what they cannot know."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.muscles.joint_rows import JointRows, triple
from armimpedance.muscles.posture_fit import fit_posture_model
from armimpedance.muscles.posture_terms import exponents, monomials

BOX = np.array([[0.3, 1.6], [0.8, 2.2]])


def postures(count, seed=0):
    return np.random.default_rng(seed).uniform(*BOX.T, (count, 2))


def arms_truth(order, seed=1):
    """K and B = G^T K_m G at joint angles (P, 2), moment arms polynomials of an order."""
    rng = np.random.default_rng(seed)
    powers = exponents(order)
    arm = rng.normal(0, 0.4, (4, 2, len(powers)))
    arm[:, :, 0] += 2.0

    def at(q):
        G = np.einsum("mjt,pt->pmj", arm, monomials(np.asarray(q) - BOX.mean(axis=1), powers))
        return np.einsum("pmi,pmj->pij", G, G)

    return at


@pytest.mark.parametrize("order", [0, 1, 2])
def test_noise_free_polynomial_arms_are_recovered_everywhere(order):
    truth = arms_truth(order)
    q = postures(20)
    model = fit_posture_model(
        JointRows(q, truth(q), 0.1 * truth(q)), order=order, model="polynomial"
    )
    new = postures(50, seed=2)
    found = model.predict(new)
    np.testing.assert_allclose(found.stiffness, triple(truth(new)), atol=1e-8)
    np.testing.assert_allclose(found.viscosity, triple(0.1 * truth(new)), atol=1e-9)
