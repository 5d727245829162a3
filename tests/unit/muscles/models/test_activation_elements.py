"""Each element by itself: what the source printed, and that its table is of this kind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.limb.arm.muscular_arms import arm_named
from armimpedance.muscles.models.activation.quality import element_fits
from armimpedance.muscles.models.packed import matrix, triple
from armimpedance.muscles.models.rows import JointRows

ARM = arm_named("planar6")

#: Tsuji 1997, Table 2, subject B: R and E for N = 1, 2, 3.
TABLE_2 = {
    "K_ss": ((0.595, 7218.09), (0.739, 5064.28), (0.841, 3261.07)),
    "K_se": ((0.645, 4194.83), (0.649, 4157.62), (0.661, 4042.04)),
    "K_ee": ((0.917, 3056.50), (0.944, 2077.05), (0.948, 1931.65)),
    "B_ss": ((0.796, 15.58), (0.855, 11.43), (0.874, 10.06)),
    "B_se": ((0.609, 7.94), (0.616, 7.83), (0.629, 7.64)),
    "B_ee": ((0.891, 5.59), (0.914, 4.47), (0.918, 4.25)),
}


def made_rows(sd: float, seed: int = 0, count: int = 30) -> JointRows:
    """Stiffness linear in activation, each element with coefficients of its own."""
    rng = np.random.default_rng(seed)
    alpha = rng.uniform(0, 0.3, (count, 6))
    acting = np.array([[1, 1, 0, 0, 1, 1], [0, 0, 0, 0, 1, 1], [0, 0, 1, 1, 1, 1]])
    C = acting * rng.uniform(20, 150, (3, 6))
    K = [15.0, 6.0, 16.0] + alpha @ C.T + sd * rng.normal(size=(count, 3))
    q = np.tile([1.04, 1.57], (count, 1))
    return JointRows(q, matrix(K), matrix(0.1 * K), activation=alpha)


@pytest.mark.parametrize("element", TABLE_2)
def test_printed_r_and_e_are_those_of_elements_fitted_by_themselves(element):
    """One E_0 within the rounding of R: the law of a least-squares fit with a constant."""
    low, high = zip(
        *[(e / (1 - (r - 0.0005) ** 2), e / (1 - (r + 0.0005) ** 2)) for r, e in TABLE_2[element]],
        strict=True,
    )
    # E of B has three digits only
    slack = 1.002 if element.startswith("B") else 1.0
    assert max(low) <= slack * min(high)


@pytest.mark.parametrize("order", [1, 2])
def test_r_and_e_obey_that_law_here_and_r_rises(order):
    rows = made_rows(5.0)
    fits = element_fits(rows, ARM, order=order)
    higher = element_fits(rows, ARM, order=order + 1)
    for k, (fit, more) in enumerate(zip(fits, higher, strict=True)):
        y = triple(rows.stiffness if k < 3 else rows.viscosity)[:, k % 3]
        e0 = ((y - y.mean()) ** 2).sum()
        assert fit.r == pytest.approx(np.sqrt(1 - fit.e / e0), abs=1e-9)
        assert more.e < fit.e
        assert more.null_r > fit.null_r
        assert fit.leave_one_out_r < fit.r


def test_noise_free_elements_are_fitted_exactly():
    assert all(fit.e < 1e-15 for fit in element_fits(made_rows(0.0), ARM, order=1))


def test_left_out_rows_are_those_of_fits_without_them():
    rows = made_rows(5.0)
    fit = element_fits(rows, ARM, order=1)[1]
    alpha, y = np.asarray(rows.activation)[:, 4:], triple(rows.stiffness)[:, 1]
    W = np.column_stack([np.ones(len(y)), alpha])
    out = []
    for i in range(len(y)):
        others = np.arange(len(y)) != i
        out.append(W[i] @ np.linalg.lstsq(W[others], y[others], rcond=None)[0])
    assert fit.leave_one_out_r == pytest.approx(np.corrcoef(y, out)[0, 1], abs=1e-9)


def test_terms_that_cannot_be_told_are_refused():
    rows = made_rows(1.0)
    with pytest.raises(NotIdentifiableError, match="K_ss: 10 conditions"):
        element_fits(rows.select(np.arange(10)), ARM, order=3)
    line = np.linspace(0, 0.3, 30)[:, None] * np.ones(6)
    with pytest.raises(NotIdentifiableError, match="K_ss"):
        element_fits(replace(rows, activation=line), ARM, order=1)
    with pytest.raises(InputError, match="order 0"):
        element_fits(rows, ARM, order=0)
