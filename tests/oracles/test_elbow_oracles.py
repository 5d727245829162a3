"""The elbow's discrete models, whiteness and smoothing against other packages."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from armimpedance.joint.elbow.stationary.diagnosis import ljung_box
from armimpedance.joint.elbow.stationary.discrete import to_continuous, to_discrete

#: I, B, K: swinging, nearly undamped, the source's range, critically damped.
JOINTS = [(0.07, 0.6, 20.0), (0.1, 0.05, 150.0), (0.06, 3.5, 9.0), (0.05, 2.0, 20.0)]


@pytest.mark.parametrize("rate", [50.0, 200.0, 1000.0])
@pytest.mark.parametrize(("structure", "method"), [("zoh", "zoh"), ("tustin", "bilinear")])
@pytest.mark.parametrize("joint", JOINTS, ids=str)
def test_the_discrete_model_is_scipys(joint, structure, method, rate):
    numerator, denominator, _ = signal.cont2discrete(([1.0], joint), 1 / rate, method)
    model = to_discrete(*joint, rate, structure)
    # scipy forms the transfer function from matrices, at 1 kHz with a few digits lost
    np.testing.assert_allclose(model.denominator, denominator, rtol=1e-10)
    np.testing.assert_allclose(model.numerator, np.ravel(numerator), rtol=1e-5, atol=1e-18)
    np.testing.assert_allclose(to_continuous(model), joint, rtol=1e-7)


@pytest.mark.parametrize("memory", [0.0, 0.3])
def test_whiteness_is_that_of_statsmodels(memory):
    from statsmodels.stats.diagnostic import acorr_ljungbox

    white = np.random.default_rng(4).standard_normal(800)
    residual = signal.lfilter([1.0], [1.0, -memory], white)
    residual -= residual.mean()
    found = ljung_box([residual], 15)
    oracle = acorr_ljungbox(residual, lags=[15])
    assert found.statistic == pytest.approx(float(oracle["lb_stat"].iloc[0]), rel=1e-9)
    assert found.p == pytest.approx(float(oracle["lb_pvalue"].iloc[0]), rel=1e-6, abs=1e-12)
