"""Certified answers: NIST StRD, linear regression (tests/reference_data/nist_strd_linear.md)."""

import json
from pathlib import Path

import numpy as np
import pytest
from refine import refine

from armimpedance.numerics.regression.factors import trial_factors
from armimpedance.numerics.regression.solve import fit

FILE = Path(__file__).resolve().parents[3] / "reference_data" / "nist_strd_linear.json"
DATA = json.loads(FILE.read_text())

#: Asked for: 9 digits; less where data in double precision do not hold more.
DIGITS = dict.fromkeys(DATA, 9) | {"filip": 7, "wampler4": 7, "wampler5": 5}
extended = pytest.mark.skipif(
    np.finfo(np.longdouble).eps > 1e-18, reason="this platform has no extended precision"
)
EXACT_FIT = ("wampler1", "wampler2")


def correct_digits(found, certified):
    """Log relative error of the worst value, at most 16."""
    found, certified = np.atleast_1d(found), np.atleast_1d(certified)
    relative = np.abs(found - certified) / np.abs(certified)
    return float(-np.log10(np.maximum(relative, 1e-16)).min())


def regressors_of(case, dtype=np.float64):
    """Plain powers as the datasets ask for, the constant first."""
    x = np.asarray(case["x"], dtype=dtype)
    if case["degree"] is not None:
        x = np.stack([x**k for k in range(1, case["degree"] + 1)], axis=1)
    elif x.shape[0] != len(case["y"]):
        x = x.T
    return np.column_stack([np.ones(len(x), dtype), x]) if case["intercept"] else x


def fitted(case):
    W, y = regressors_of(case), np.asarray(case["y"])
    names = [f"b{j}" for j in range(W.shape[1])]
    factors = trial_factors(W[None], y[None, :, None], regressors=names, outputs=["y"])
    return fit(factors, covariance="classical")


def test_all_eleven_are_here():
    assert len(DATA) == 11


@pytest.mark.parametrize("name", DATA)
def test_coefficients(name):
    assert correct_digits(fitted(DATA[name]).parameters, DATA[name]["beta"]) >= DIGITS[name]


@pytest.mark.parametrize("name", [n for n in DATA if n not in EXACT_FIT])
def test_standard_deviations(name):
    case, result = DATA[name], fitted(DATA[name])
    assert correct_digits(result.sd, case["sd"]) >= DIGITS[name]
    assert correct_digits(result.residual_sd, case["residual_sd"]) >= DIGITS[name]


@pytest.mark.parametrize("name", EXACT_FIT)
def test_exact_fits_have_no_spread(name):
    result = fitted(DATA[name])
    assert (result.sd / np.abs(result.parameters)).max() < 1e-6
    assert result.r2 == pytest.approx(1, abs=1e-14)


@pytest.mark.parametrize("name", DATA)
def test_r2_is_about_the_mean_only_with_a_constant(name):
    case, result = DATA[name], fitted(DATA[name])
    assert result.centred is case["intercept"]
    assert correct_digits(result.r2, case["r2"]) >= 9


@extended
@pytest.mark.parametrize("name", [n for n in DATA if n != "filip"])
def test_refinement_restores_digits(name):
    case = DATA[name]
    y = np.asarray(case["y"])[:, None]
    better = refine(fitted(case), regressors_of(case), y)
    assert correct_digits(better.parameters, case["beta"]) >= 9.5


@extended
def test_filip_needs_its_powers_in_extended_precision():
    case = DATA["filip"]
    y = np.asarray(case["y"])[:, None]
    better = refine(fitted(case), regressors_of(case, np.longdouble), y)
    assert correct_digits(better.parameters, case["beta"]) >= 9.5


def test_filip_is_warned_about_but_not_refused():
    result = fitted(DATA["filip"])
    assert result.rank == 11
    assert result.cond_scaled > 1e9
    assert any("nearly dependent" in w for w in result.warnings)
