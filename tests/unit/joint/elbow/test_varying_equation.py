"""The weighted equation, its chain of blocks, and the differences that both stand on."""

import numpy as np
import pytest

from armimpedance.core.errors import EstimationError, InputError
from armimpedance.joint.elbow.samples import from_recording
from armimpedance.joint.elbow.varying.data import decimated, varying_data
from armimpedance.joint.elbow.varying.equation import (
    FIRST,
    HALF,
    SECOND,
    linearise,
    solve_weighted,
    start,
)
from armimpedance.joint.elbow.varying.smoother_model import smooth_chain
from manipulandum_sim.elbow.bench import simulate_bench


def _samples(**options):
    return from_recording(simulate_bench(0.07, 0.6, 20.0, duration_s=4.0, **options)[0])


def test_differences_are_exact_for_polynomials_of_degree_eight():
    x = np.arange(-HALF, HALF + 1.0)
    for degree in range(9):
        assert FIRST @ x**degree == pytest.approx(float(degree == 1), abs=1e-9)
        assert SECOND @ x**degree == pytest.approx(2.0 * (degree == 2), abs=1e-9)


def test_the_chain_equals_the_dense_solution():
    rng = np.random.default_rng(0)
    n, width = 50, 7
    dense = np.zeros((n, n))
    for k in range(width):
        values = rng.standard_normal(n - k)
        dense += np.diag(values, -k) + (np.diag(values, k) if k else 0)
    dense += 30 * np.eye(n)
    banded = np.zeros((width, n))
    for k in range(width):
        banded[k, : n - k] = np.diag(dense, -k)
    right = rng.standard_normal((n, 2))
    for size in (6, 8, 25, 50):
        made = smooth_chain(banded, right, size)
        assert made.mean == pytest.approx(np.linalg.solve(dense, right), rel=1e-9)
        assert made.variance == pytest.approx(np.diag(np.linalg.inv(dense)), rel=1e-9)


def test_the_chain_refuses_what_is_not_positive():
    with pytest.raises(EstimationError):
        smooth_chain(np.stack([-np.ones(6), np.zeros(6)]), np.ones((6, 1)), 2)


@pytest.mark.study
def test_sigma_is_that_of_the_difference_operator():
    data = varying_data(_samples(snr_db=30.0))
    eq = linearise(data, start(data))
    dense = np.zeros((len(eq.centre), len(data.angle)))
    for row, (centre, L) in enumerate(zip(eq.centre, eq.L, strict=True)):
        dense[row, centre - HALF : centre + HALF + 1] = L
    sigma = np.diag(eq.sd_torque**2) + dense @ np.diag(eq.sd_angle**2) @ dense.T
    for k, diagonal in enumerate(eq.sigma):
        assert diagonal[: len(sigma) - k] == pytest.approx(np.diag(sigma, -k), rel=1e-9)
    white = eq.whitened(np.eye(len(sigma)))
    assert white @ sigma @ white.T == pytest.approx(np.eye(len(sigma)), abs=1e-6)
    part = slice(40, 90)
    assert eq.whitened(np.eye(50), part) @ sigma[part, part] @ eq.whitened(
        np.eye(50), part
    ).T == pytest.approx(np.eye(50), abs=1e-6)


def test_constant_joint_comes_back_within_its_own_errors():
    z = []
    for seed in range(6):
        data = varying_data(_samples(snr_db=20.0, seed=seed))
        eq = linearise(data, start(data))
        p, covariance = solve_weighted(eq, np.column_stack([eq.x2, eq.x1, eq.x0, eq.nuisance]))
        z.append((p[:3] - [0.07, 0.6, 20.0]) / np.sqrt(np.diag(covariance)[:3]))
    # 18 squares of a standard normal: mean 1, its sd 1/3
    assert np.mean(np.square(z)) < 1 + 3 / 3


def test_operating_point_does_not_matter():
    from dataclasses import replace

    samples = _samples(snr_db=40.0)
    moved = replace(samples, torque=samples.torque + 3.0, angle=samples.angle - 1.2)
    a, b = (start(varying_data(s)) for s in (samples, moved))
    assert b.inertia == pytest.approx(a.inertia, rel=1e-6)
    assert b.K[0] == pytest.approx(a.K[0], rel=1e-6)


def test_decimation_keeps_a_slow_sine_in_place():
    t = np.arange(4000) / 1000
    made = decimated(np.sin(2 * np.pi * 5 * t), 8)
    assert made[10:-10] == pytest.approx(np.sin(2 * np.pi * 5 * t[::8])[10:-10], abs=2e-3)
    assert len(made) == 500


def test_noise_is_read_off_the_channels():
    snr = varying_data(_samples(snr_db=(30.0, 20.0))).snr
    assert snr.torque_db == pytest.approx(30, abs=0.5)
    assert snr.angle_db == pytest.approx(20, abs=0.5)


@pytest.mark.parametrize("cutoff", [0.0, 500.0, 800.0])
def test_band_edge_beyond_nyquist_is_refused(cutoff):
    with pytest.raises(InputError, match="band edge"):
        varying_data(_samples(), cutoff)


def test_short_and_constant_trials_are_refused():
    from dataclasses import replace

    samples = _samples()
    with pytest.raises(InputError, match="lasts"):
        varying_data(
            replace(
                samples,
                offsets=np.array([0, 900]),
                torque=samples.torque[:900],
                angle=samples.angle[:900],
                perturbation=None,
            )
        )
    with pytest.raises(InputError, match="angle"):
        varying_data(replace(samples, angle=np.zeros(4000)))


def test_too_much_noise_is_refused_before_anything_is_fitted():
    with pytest.raises(InputError, match="noise of the angle is"):
        varying_data(_samples(snr_db=(30.0, 5.0)))


def test_the_band_ends_where_a_limb_in_a_device_is_no_longer_one_inertia():
    samples = from_recording(simulate_bench(0.02, 1.2, 110.0, cutoff_hz=100.0, snr_db=60)[0])
    data = varying_data(samples)
    assert data.rate_hz <= 1000 / 6
    assert "left out" in data.notes[1]
    assert varying_data(samples, 100.0).rate_hz > data.rate_hz
    (note,) = varying_data(_samples(snr_db=40)).notes
    assert "20 Hz" not in note
