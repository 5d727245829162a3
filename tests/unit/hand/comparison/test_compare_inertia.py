"""An inertia that changes at one posture: found with its size, seldom by chance."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import stdtr

from armimpedance.hand.comparison.compare import compare
from armimpedance.hand.comparison.groups import UNLIKELY, check_inertia, groups_of_estimates
from armimpedance.hand.still.estimation import estimate
from armimpedance.numerics.regression import t_factor


def groups(limb, gain, seed=0):
    """Two sessions of one limb, the second with another gain of the force."""
    found = []
    for name, factor, shift in (("before", 1.0, 0), ("after", gain, 1000)):
        recording = limb.record(sets=2, force_noise=0.1, drift=0.001, seed=seed + shift)
        recording = replace(recording, force=factor * recording.force)
        (one,) = estimate(recording)
        found.append(replace(one, keys={"condition": name}))
    return groups_of_estimates(found, ("condition",))


def checked(limb, gain, seed=0):
    made = groups(limb, gain, seed)
    (finding,) = check_inertia(made, compare(made))
    return finding


@pytest.mark.parametrize("gain", [0.8, 1.2])
def test_a_gain_is_found_with_its_size(limb, gain):
    finding = checked(limb, gain)
    assert finding.verdict == "warning"
    change = float(finding.message.split(": ")[1].split(" %")[0])
    assert change == pytest.approx(200 * (gain - 1) / (gain + 1), abs=4.0)


@pytest.mark.study
def test_one_inertia_is_no_finding(limb):
    found = [checked(limb, 1.0, seed) for seed in range(20)]
    assert sum(one.verdict == "warning" for one in found) <= 1
    assert all(one.smallest for one in found)


def test_few_trials_raise_no_more_alarms_than_many(estimated):
    """The level holds where each covariance comes from sixteen trials, and with it its errors."""
    rng, n, dof = np.random.default_rng(0), 1000, 15
    base = replace(estimated(), position=np.zeros(2), dof=float(dof))
    base = replace(base, bound=base.covariance)
    L, alarms = np.linalg.cholesky(base.covariance), 0
    pair = SimpleNamespace(first="one", second="other")
    for _ in range(n):
        found = []
        for name in ("one", "other"):
            x = base.parameters + L @ rng.standard_normal(12)
            spread = L @ rng.standard_normal((12, dof))
            M, B, K = x.reshape(3, 2, 2)
            made = replace(
                base,
                inertia=M,
                inertia_with_handle=M,
                viscosity=B,
                stiffness=K,
                covariance=spread @ spread.T / dof,
                keys={"condition": name},
            )
            found.append(made)
        (finding,) = check_inertia(groups_of_estimates(found, ("condition",)), [pair])
        alarms += finding.verdict == "warning"
    level = 2 * stdtr(2 * dof, -UNLIKELY * t_factor(2 * dof))
    assert alarms / n <= level + 3.5 * np.sqrt(level / n)


def test_another_posture_is_not_held_against_it(limb):
    first, second = groups(limb, 1.3)
    moved = replace(second.estimate, position=second.estimate.position + np.array([0.1, 0.0]))
    made = [first, replace(second, estimate=moved)]
    assert check_inertia(made, compare(made)) == ()
