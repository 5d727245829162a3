"""Standard errors of the contribution: against finite differences, limits, and coverage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from metric_bench import (
    AXES,
    MOVEMENTS,
    P,
    bench_arm,
    bench_elastic,
    bench_robot,
    counted,
    drawn_errors,
    exact_robot,
    helping,
    known_exactly,
    motion,
    samples,
    torques,
    true_arm,
)

from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.robot.steady import kernels_for
from armimpedance.joint.therapy.robot.therapy_robot import Loads
from armimpedance.joint.therapy.share.error_law import PARTS
from armimpedance.joint.therapy.share.of_movement import (
    contribution_of,
    running_contribution,
    sample_contribution,
)


def plain_metrics(seen, theta, mass, line, own, arm):
    """(4), projection and share with other parameters than the stated ones, written out."""
    e = arm.elastic_of(seen.axis_name)
    k, offset = line + own + e.mass_gradient * mass + e.robot_gradient @ theta
    needs = (1 + mass) * seen.rigid_arm + seen.elastic + k * seen.q + offset
    user = seen.robot + seen.robot_gradient @ theta + needs - seen.motor
    both = np.stack([needs, seen.robot_inertia], axis=1)
    share = np.linalg.lstsq(both, user, rcond=None)[0][0]
    whole = user.sum() / needs.sum()
    return 100 * np.array([whole, (user @ needs) / (needs @ needs), share])


def slow_parts(seen, robot, arm, step=1e-5):
    """Variances (5, 3) by finite differences, parameter by parameter."""
    e, zero = arm.elastic_of(seen.axis_name), [np.zeros(P), 0.0, np.zeros(2), np.zeros(2)]

    def slopes(place, size):
        found = []
        for unit in np.eye(size):
            values = []
            for sign in (1, -1):
                moved = list(zero)
                moved[place] = sign * step * (unit if size > 1 else 1.0)
                values.append(plain_metrics(seen, *moved, arm))
            found.append((values[0] - values[1]) / (2 * step))
        return np.array(found)

    def spread(place, C):
        g = slopes(place, len(C))
        return np.einsum("im,ij,jm->m", g, C, g)

    needs, dt = seen.arm, 1 / seen.sample_rate_hz
    # user = ... - motor: noise of density S moves an integral over w by S int w^2 dt
    own = seen.robot_inertia
    # one sample alone, given twice, leaves nothing beside the robot's inertia
    alone = np.ptp(needs) == 0
    left = needs if alone else needs - (needs @ own) / (own @ own) * own
    integrals = needs.sum() * dt, (needs @ needs) * dt, (left @ left) * dt
    squares = len(needs) * dt, *integrals[1:]
    noise = [1e4 * e.noise_density * s / i**2 for s, i in zip(squares, integrals, strict=True)]
    return np.array(
        [
            spread(0, robot.identified.covariance),
            spread(1, np.array([[arm.mass_sd**2]])),
            spread(2, e.covariance),
            spread(3, e.between),
            noise,
        ]
    )


@pytest.mark.parametrize("name", MOVEMENTS)
@pytest.mark.parametrize("share", [-0.5, 0.0, 0.4, 1.0])
def test_standard_errors_are_those_of_the_slow_delta_method(name, share):
    # a rest angle away from the middle: finite differences need a denominator
    lines = (bench_elastic("elevation"), bench_elastic("horizontal", offset=-0.2))
    robot, arm, m = bench_robot(), bench_arm(elastic=lines), motion(name, every=5)
    user = share * true_arm(m, arm, drawn_errors(robot, arm, AXES[m.axis], len(m.q), rng(1)))
    seen = torques(m, arm, user, drawn_errors(robot, arm, AXES[m.axis], len(m.q), rng(2)))
    found, slow = contribution_of(seen, robot, arm), slow_parts(counted(seen), robot, arm)
    variances = slow.sum(axis=0)
    for variance, metric in zip(variances, ("ratio", "projection", "share"), strict=True):
        assert getattr(found, metric).sd == pytest.approx(np.sqrt(variance), rel=1e-5)
    parts = [getattr(found.share_variance, part) for part in PARTS]
    assert parts == pytest.approx(slow[:, 2] / variances[2], abs=1e-5)
    assert sum(parts) == pytest.approx(1)


def rng(seed):
    return np.random.default_rng(seed)


def test_a_samples_standard_error_is_that_of_a_movement_of_one_sample_after_the_kernel():
    robot, arm, m = bench_robot(), bench_arm(), motion("elevation", every=50)
    seen = helping(m, arm, 0.3)
    each = sample_contribution(seen, robot, arm)
    smooth = kernels_for(seen.sample_rate_hz).smooth
    for i in (0, 20, 60):
        # twice the same sample: sums double, the noise of a sum does not apply
        one = samples(seen, [i, i])
        slow = slow_parts(one, robot, arm)[:, 0]
        level = arm.elastic_of("elevation").noise_density * seen.sample_rate_hz
        slow[-1] = 1e4 * level * (smooth**2).sum() / seen.arm[i] ** 2
        assert each.sd[i] == pytest.approx(np.sqrt(slow.sum()), rel=1e-5)


def test_the_running_view_is_the_projection_of_every_window():
    robot, arm, m = bench_robot(), bench_arm(), motion("horizontal", every=10)
    errors = drawn_errors(robot, arm, "horizontal", len(m.q), rng(3))
    seen = torques(m, arm, 0.3 * true_arm(m, arm, errors), errors)
    running = running_contribution(seen, robot, arm, 0.07)
    for i in (40, 68, 69, 70, 139, 140, 141, 300, len(m.q) - 30):
        window = slice(max(i - 69, 0), i + 1)
        whole = contribution_of(samples(seen, window), robot, arm)
        assert running.percent[i] == pytest.approx(whole.projection.percent, rel=1e-9)
        assert running.sd[i] == pytest.approx(whole.projection.sd, rel=1e-9)
        assert running.valid[i] == whole.projection.valid
    # nothing has moved yet
    assert np.isnan(running.percent[1])
    assert not running.valid[1]


@pytest.mark.parametrize("window_s", [0.0, -1.0, 0.0015, np.nan, np.inf, 61.0])
def test_windows_that_cannot_be_are_refused(window_s):
    arm = bench_arm()
    with pytest.raises(InputError, match="window"):
        running_contribution(helping(motion("elevation"), arm, 1), bench_robot(), arm, window_s)


def test_masses_do_not_matter_to_who_carries_the_arm_alone():
    """The same factor above and below the line: at 100 % nothing of it is left."""
    arm = known_exactly(bench_arm(), mass_sd=0.03)
    robot, sds = exact_robot(), []
    rigid = counted(helping(motion("elevation"), arm, 0.0)).rigid_arm
    for share in (0.0, 0.5, 1.0):
        found = contribution_of(helping(motion("elevation"), arm, share), robot, arm)
        sds.append(found.ratio.sd)
        assert found.ratio.sd == pytest.approx(
            3 * (1 - share) * rigid.mean() / found.mean_arm_Nm, abs=1e-9
        )
    assert sds[0] > sds[1] > sds[2] == pytest.approx(0, abs=1e-9)


def test_what_is_known_exactly_has_no_error():
    arm = known_exactly(bench_arm())
    found = contribution_of(helping(motion("elevation"), arm, 0.5), exact_robot(), arm)
    assert found.ratio.sd == found.projection.sd == 0
    assert found.ratio.ci95 == pytest.approx([50, 50])
    assert sum(getattr(found.share_variance, part) for part in PARTS) == 0


@pytest.mark.parametrize(
    ("change", "factor"),
    [({"dof": 2.0}, 4.302653), ({"dof": 6.0}, 2.446912), ({"dof": np.inf}, 1.959964)],
)
def test_an_interval_takes_its_degrees_of_freedom_from_what_dominates(change, factor):
    arm = known_exactly(bench_arm())
    elastic = replace(arm.elastic_of("elevation"), between=0.01 * np.eye(2), **change)
    arm = replace(arm, elastic=(elastic,))
    found = contribution_of(helping(motion("elevation"), arm, 0.0), exact_robot(), arm)
    half = np.diff(found.projection.ci95)[0] / 2
    assert half == pytest.approx(factor * found.projection.sd, rel=1e-5)


def test_degrees_of_freedom_of_a_mixture_lie_between():
    arm = replace(known_exactly(bench_arm()), mass_sd=0.03)
    elastic = replace(arm.elastic_of("elevation"), between=1e-2 * np.eye(2), dof=2.0)
    arm = replace(arm, elastic=(elastic,))
    found = contribution_of(helping(motion("elevation"), arm, 0.0), exact_robot(), arm)
    factor = np.diff(found.projection.ci95)[0] / 2 / found.projection.sd
    assert 1.96 < factor < 4.30
    loads = bench_robot().identified
    robot = bench_robot(loads=Loads(loads.theta, 1e-12 * np.eye(P), loads.rise_rad_s, dof=3.0))
    same = contribution_of(helping(motion("elevation"), arm, 0.0), robot, arm)
    assert np.diff(same.projection.ci95)[0] / 2 / same.projection.sd == pytest.approx(factor)


def test_more_noise_is_less_certain():
    sds = []
    for density in (0.0, 1e-3, 1e-2):
        arm = bench_arm(elastic=(bench_elastic("elevation", noise_density=density),))
        found = contribution_of(helping(motion("elevation"), arm, 0.3), bench_robot(), arm)
        sds.append((found.ratio.sd, found.projection.sd))
    assert (np.diff(sds, axis=0) > 0).all()


@pytest.mark.parametrize(("name", "share"), [("elevation", 0.0), ("horizontal", 0.5)])
def test_intervals_hold_the_truth_as_often_as_they_say(name, share):
    """Covariances are drawn as well: those of the arm from 6 degrees of freedom."""
    draws, source = 400, rng(7)
    robot, stated, m = bench_robot(), bench_arm(), motion(name, every=20)
    axis_name = AXES[m.axis]
    elastic, inside = stated.elastic_of(axis_name), np.zeros((draws, 3))
    for i in range(draws):
        # noise of the thinned movement: twenty times the density at a twentieth of the samples
        errors = drawn_errors(robot, stated, axis_name, len(m.q), source)
        needs = true_arm(m, stated, errors)
        # and a part of the robot's own inertia, as of somebody who moves freely
        user = share * needs + 0.3 * np.sin(3 * m.q) + 0.6 * m.inertia
        scale = source.chisquare(elastic.dof) / elastic.dof
        seen_elastic = replace(
            elastic, covariance=scale * elastic.covariance, between=scale * elastic.between
        )
        arm = replace(stated, elastic=(seen_elastic,))
        found = contribution_of(torques(m, stated, user, errors), robot, arm)
        u, h, r = (x[np.abs(m.qd) >= 0.05] for x in (user, needs, m.inertia))
        beside = np.linalg.lstsq(np.stack([h, r], axis=1), u, rcond=None)[0][0]
        truth = 100 * u.sum() / h.sum(), 100 * (u @ h) / (h @ h), 100 * beside
        for j, ci in enumerate((found.ratio.ci95, found.projection.ci95, found.share.ci95)):
            inside[i, j] = ci[0] <= truth[j] <= ci[1]
    coverage, error = inside.mean(axis=0), np.sqrt(0.95 * 0.05 / draws)
    assert coverage[1:] == pytest.approx(0.95, abs=3 * error)
    if name == "elevation":
        assert coverage[0] == pytest.approx(0.95, abs=3 * error)
