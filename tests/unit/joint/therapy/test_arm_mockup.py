"""Pipes of known weight: the robot measures what they weigh, whatever its friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arm_bench import UPPER_ARM_M, Session, bench, heavier, repeated

from armimpedance.core.errors import InputError, RecordError
from armimpedance.joint.therapy.arm.mockup import check_mockup, pipes

BOTH_WAYS = ("elevation", "lowering", "horizontal")
#: A mock-up has no stiffness.
LIMP = {"k": (0.0, 0.0), "rest": (0.0, 0.0)}


def session(robot=None, segments=None, movements=BOTH_WAYS, times=3, **given):
    tubes = pipes() if segments is None else segments
    return repeated(Session(robot, tubes, **given), movements, times, **LIMP)


def test_a_thin_tube():
    tube = pipes(lower=(2.0, 0.4, 0.1))[1]
    assert tube.link == "forearm"
    around = 2 * np.pi * (np.arange(400) + 0.5) / 400
    along = 0.4 * (np.arange(400) + 0.5) / 400 - 0.2
    # points on its surface: about x, and about its axis
    assert tube.inertia_kgm2 == pytest.approx(
        2 * ((0.05 * np.sin(around)) ** 2).mean() + 2 * (along**2).mean(), rel=1e-4
    )
    assert tube.inertia_long_kgm2 == pytest.approx(2 * 0.05**2)
    assert tube.com_m == pytest.approx(0.2)
    with pytest.raises(RecordError, match="negative"):
        pipes(lower=(2.0, -0.4, 0.1))


def test_the_sources_numbers():
    found = check_mockup(session().recording(), bench(), pipes())
    assert found.gravity_model_Nm == pytest.approx(10.66, rel=0.01)
    assert found.inertia_model_kgm2 == pytest.approx(0.450, rel=0.01)
    assert found.gravity.value == pytest.approx(found.gravity_model_Nm, rel=2e-3)
    assert found.inertia.value == pytest.approx(found.inertia_model_kgm2, rel=5e-3)


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_another_weight_is_seen(factor):
    heavy = session(segments=heavier(pipes(), factor)).recording()
    found = check_mockup(heavy, bench(), pipes())
    assert found.gravity.value == pytest.approx(factor * found.gravity_model_Nm, rel=2e-3)
    assert found.inertia.value == pytest.approx(factor * found.inertia_model_kgm2, rel=5e-3)


def test_friction_and_cables_that_the_model_misses_do_not_matter():
    loads = bench().identified
    theta = loads.theta.copy()
    theta[[0, 4]] *= 1.1
    theta[[6, 7]] *= 1.2
    worn = bench(loads=replace(loads, theta=theta))
    found = check_mockup(session(worn).recording(), bench(), pipes())
    assert found.gravity.value == pytest.approx(found.gravity_model_Nm, rel=2e-3)
    assert found.inertia.value == pytest.approx(found.inertia_model_kgm2, rel=5e-3)


@pytest.mark.study
def test_intervals_hold_noise_and_the_robots_own_error():
    believed, rng, inside = bench(relative_sd=0.01), np.random.default_rng(8), []
    loads = believed.identified
    for seed in range(15):
        drawn = loads.theta + np.sqrt(np.diag(loads.covariance)) * rng.standard_normal(15)
        true = bench(loads=replace(loads, theta=drawn))
        recording = session(true, seed=seed, noise=0.05).recording()
        found = check_mockup(recording, believed, pipes())
        for one, model in (
            (found.gravity, found.gravity_model_Nm), (found.inertia, found.inertia_model_kgm2)
        ):  # fmt: skip
            inside.append(one.ci95[0] <= model <= one.ci95[1])
    # 30 intervals: 3 standard errors
    assert np.mean(inside) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 30)


@pytest.mark.parametrize(
    ("movements", "times", "said"),
    [
        (("elevation", "horizontal"), 3, "in one direction"),
        (("elevation", "lowering"), 3, "0 movements of the mock-up about horizontal"),
        (("horizontal",), 3, "0 movements of the mock-up about elevation"),
        (("elevation", "lowering", "horizontal"), 1, "1 movements"),
    ],
)
def test_too_few_movements_are_refused(movements, times, said):
    recording = session(movements=movements, times=times).recording()
    with pytest.raises(InputError, match=said) as refused:
        check_mockup(recording, bench(), pipes())
    assert "\n" not in str(refused.value)


def test_a_length_is_needed():
    recording = session().recording()
    nameless = recording.with_step("cut", subject=replace(recording.subject, upper_arm_m=None))
    with pytest.raises(InputError, match="length is not known"):
        check_mockup(nameless, bench(), pipes())
    given = check_mockup(nameless, bench(), pipes(), upper_arm_m=UPPER_ARM_M)
    assert given == check_mockup(recording, bench(), pipes())
