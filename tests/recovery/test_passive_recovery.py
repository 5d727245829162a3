"""Markers of a simulated relaxed arm -> joint angles -> the elbow's truth, within its interval."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.joint.relaxed.identify import identify_passive
from armimpedance.joint.relaxed.samples import from_motion
from armimpedance.limb.mocap.joint_motion import joint_motion
from armimpedance.numerics.signals.emg.silence import emg_gate
from manipulandum_sim.passive.swing import simulate_passive

ELBOW = "right_elbow_flexion"


@pytest.fixture(scope="module")
def release():
    """Two releases of 90 frames: markers with 0.5 mm of noise, the motion found, the truth."""
    markers, truth = simulate_passive("release", seed=3, trials=2, duration_s=3.0)
    return markers, joint_motion(markers).motion, truth


def elbow_of(truth):
    i = truth.joints.index(ELBOW)
    return float(truth.q_r[i]), {name: getattr(truth, name)[i] for name in ("k", "h", "f")}


@pytest.mark.parametrize("method", ["parallel", "output-error"])
def test_the_elbow_is_recovered_from_markers(release, method):
    _, motion, truth = release
    rest, expected = elbow_of(truth)
    samples = from_motion(motion, [ELBOW])
    (fit,) = identify_passive(samples, rest_angle=rest, method=method, cross_validate=False)
    for name, value in expected.items():
        found = fit.parameters[name]
        low, high = found.ci95
        # twice the 95 % interval: a seed in thousands falls out
        assert abs(found.value - value) < high - low, name
    assert fit.parameters["k"].value == pytest.approx(expected["k"], rel=0.02)
    assert fit.direct.r2 > 0.9


def test_exact_motion_gives_the_truth(release):
    _, motion, truth = release
    rest, expected = elbow_of(truth)
    j = truth.coordinates.index(ELBOW)
    samples = from_motion(motion, [ELBOW])
    # the simulator's own motion and torque in place of the measured ones
    i = truth.joints.index(ELBOW)
    moving = ~truth.held[:, i] & (np.abs(truth.qd[:, j]) > 1e-6)
    assert moving.mean() > 0.9
    law, x = truth.torque[:, i], expected
    exact = x["k"] * (truth.q[:, j] - rest) + x["h"] * truth.qd[:, j]
    exact = exact + x["f"] * np.sign(truth.qd[:, j])
    # the simulator's law is the analysis's, up to the sign of the joint's own torque
    np.testing.assert_allclose(-law[moving], exact[moving], atol=1e-9)
    given = replace(
        samples,
        q=truth.q[:, [j]],
        qd=truth.qd[:, [j]],
        torque=exact[:, None],
        cutoff_hz=None,
        hinges=None,
    )
    for method in ("ls", "parallel"):
        (fit,) = identify_passive(given, rest_angle=rest, method=method, cross_validate=False)
        for name, value in expected.items():
            assert fit.parameters[name].value == pytest.approx(value, rel=1e-6), (method, name)


def test_the_simulated_relaxed_muscle_passes_the_gate(release):
    markers, *_ = release
    level = emg_gate(markers.emg, markers.trials)
    assert level.mean_percent.max() < 3.0
