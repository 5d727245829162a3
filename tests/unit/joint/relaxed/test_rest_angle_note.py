"""A stated rest angle beside the one that the data show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import EstimationError
from armimpedance.joint.relaxed.equations import Equations, Terms
from armimpedance.joint.relaxed.identify import identify_passive
from armimpedance.joint.relaxed.linear import free_rest_angle, rest_angle_note
from armimpedance.joint.relaxed.methods import METHODS
from armimpedance.joint.relaxed.samples import PassiveSamples

RATE, TRUE = 100.0, 0.8


def equations(stated, stiffness=2.0, noise=0.02, quadratic=0.0, seed=0):
    """Rows about a stated rest angle of a joint that rests at `TRUE`."""
    t = np.arange(2000) / RATE
    q = 0.5 + 0.4 * np.sin(3 * t) + 0.2 * np.sin(7 * t)
    qd = 1.2 * np.cos(3 * t) + 1.4 * np.cos(7 * t)
    about = q - TRUE
    torque = stiffness * about + quadratic * about**2 + 0.1 * qd + 0.05 * np.sign(qd)
    torque += noise * np.random.default_rng(seed).standard_normal(len(t))
    terms = Terms(stated, quadratic != 0)
    W = terms.matrix(q, qd, np.sign(qd))
    return Equations(terms.columns, terms.column_units, (W,), (torque[:, None],)), terms


@pytest.mark.parametrize("quadratic", [0.0, 0.5])
@pytest.mark.parametrize("stated", [-0.5, 0.35, TRUE])
def test_the_fitted_angle_is_the_true_one_whatever_is_stated(stated, quadratic):
    found = free_rest_angle(*equations(stated, quadratic=quadratic), RATE)
    # a 99 % interval of some 20 degrees of freedom reaches 2.8 standard errors; five are allowed
    assert abs(found.value - TRUE) < 5 / 2.8 * (found.high - found.low) / 2
    assert found.low < found.value < found.high
    assert found.contradicts(stated) == (stated != TRUE)


def test_what_is_said_and_when():
    said = rest_angle_note(*equations(0.35), RATE)
    assert said.startswith("the data put the rest angle at 0.8")
    assert "not at 0.35" in said
    # nearer than 0.05 rad to the interval: k moves by a few per cent, nobody is told
    assert rest_angle_note(*equations(TRUE + 0.03), RATE) is None
    # without a stiffness there is no rest angle
    assert rest_angle_note(*equations(0.35, stiffness=0.0), RATE) is None
    rows, _ = equations(0.35)
    assert rest_angle_note(rows, Terms("free"), RATE) is None


def test_a_search_that_ends_nowhere_says_where_the_data_rest(monkeypatch):
    def nowhere(samples, terms):
        raise EstimationError("did not settle")

    rows, _ = equations(0.0)
    about, qd, _ = rows.W[0].T
    one = {"q": about, "qd": qd, "torque": rows.Y[0][:, 0], "measured_q": about}
    samples = PassiveSamples(
        RATE, np.array([0, len(about)]), ("elbow",), **{n: v[:, None] for n, v in one.items()}
    )
    method = replace(METHODS["parallel"], solve=nowhere)
    monkeypatch.setitem(METHODS._loaded, "parallel", method)
    with pytest.raises(
        EstimationError, match=r"did not settle; the data put the rest angle at 0\.8"
    ):
        identify_passive(samples, rest_angle=0.2)
    with pytest.raises(EstimationError, match=r"^did not settle$"):
        identify_passive(samples, rest_angle=TRUE)
