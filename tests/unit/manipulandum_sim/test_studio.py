"""What the simulated studio does to a motion, each disturbance by its own statistics."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import Hinge, MarkerSite, Segment, Skeleton
from manipulandum_sim.passive.segments import arm_skeleton
from manipulandum_sim.studio import Studio, film
from manipulandum_sim.studio_emg import relaxed_emg
from manipulandum_sim.tree_dynamics import marker_positions, move

ELBOW = "right_elbow_flexion"


def body_of_35_markers() -> Skeleton:
    """A trunk and five limbs, seven markers on each of five bodies."""
    rng = np.random.default_rng(1)
    hinges = [
        (Hinge(f"limb{i}_flexion", [0, -1, 0]), Hinge(f"limb{i}_turn", [0, 0, 1])) for i in range(4)
    ]
    limbs = [
        Segment(f"limb{i}", "trunk", [0, 0.2 * i - 0.3, 0.4], hinges[i], 2.0, [0, 0, -0.1])
        for i in range(4)
    ]
    segments = (Segment("trunk", None, np.zeros(3), (), 30.0), *limbs)
    sites = [
        MarkerSite(f"{s.name}_{m}", s.name, 0.1 * rng.normal(size=3))
        for s in segments
        for m in range(7)
    ]
    return Skeleton(segments, tuple(sites))


def motion_of(skeleton: Skeleton, seconds=8.0, trials=2, rate=30.0) -> MotionRecording:
    """Every coordinate a sine of its own."""
    time = np.arange(round(seconds * rate)) / rate
    n = len(skeleton.coordinates)
    hertz, size = 0.3 + 0.1 * np.arange(n), np.full(n, 0.3)
    q = size * np.sin(2 * np.pi * hertz * time[:, None] + np.arange(n))
    return MotionRecording(
        sample_rate_hz=rate,
        trials=pd.DataFrame({"trial": range(1, trials + 1), "condition": "c"}),
        offsets=len(time) * np.arange(trials + 1),
        time_s=np.tile(time, trials),
        coordinates=np.tile(q, (trials, 1)),
        skeleton=skeleton,
    )


@pytest.fixture(scope="module", params=["arm", "body"])
def motion(request):
    return motion_of(arm_skeleton(70.0, 1.74) if request.param == "arm" else body_of_35_markers())


CLEAR = Studio(marker_noise_m=0.0)


def exact(motion):
    return marker_positions(motion.skeleton, motion.coordinates)


def test_a_perfect_studio_sees_the_markers_where_they_are(motion):
    filmed = film(motion, CLEAR)
    assert np.array_equal(filmed.positions, exact(motion))
    assert filmed.names == motion.skeleton.marker_names


def test_marker_noise_is_white_and_as_large_as_asked(motion):
    noise = film(motion, Studio(marker_noise_m=2e-3)).positions - exact(motion)
    assert noise.std() == pytest.approx(2e-3, abs=4 * 2e-3 / np.sqrt(2 * noise.size))
    half = noise[motion.samples_of(0)]
    neighbours = (half[1:] * half[:-1]).mean() / noise.var()
    assert abs(neighbours) < 4 / np.sqrt(half[1:].size)


def test_trials_are_disturbed_apart_and_a_seed_gives_the_same_bits(motion):
    studio = Studio(2e-3, 5e-3, 0.1)
    first = film(motion, studio, seed=3).positions
    assert np.array_equal(first, film(motion, studio, seed=3).positions, equal_nan=True)
    other = film(motion, studio, seed=4).positions
    assert not np.array_equal(first, other, equal_nan=True)
    one, two = (first[motion.samples_of(row)] for row in (0, 1))
    assert not np.array_equal(one, two, equal_nan=True)


@pytest.mark.parametrize("share", [0.02, 0.2])
def test_markers_are_lost_for_the_share_asked_in_bursts_that_end(share):
    motion = motion_of(arm_skeleton(70.0, 1.74), seconds=200.0, trials=1)
    studio = Studio(0.0, 0.0, share, burst_s=0.15, longest_burst_s=0.4)
    positions = film(motion, studio, seed=1).positions
    lost = np.isnan(positions[..., 0])
    assert np.array_equal(np.isnan(positions).all(axis=2), np.isnan(positions).any(axis=2))
    edges = np.diff(lost.astype(int), axis=0, prepend=0, append=0)
    starts, ends = (np.argwhere(side == edges.T)[:, 1] for side in (1, -1))
    lengths = ends - starts
    assert lengths.max() <= 12
    # shares of independent bursts: sd = share sqrt((1 + cv^2) / bursts), cv < 1
    assert lost.mean() == pytest.approx(share, abs=4 * share * np.sqrt(2 / len(lengths)))
    assert 2 < lengths.mean() < 4.5


def test_the_skin_slides_as_far_as_asked_and_stays_with_its_bone(motion):
    size = 5e-3
    slide = film(motion, Studio(0.0, size)).positions - exact(motion)
    skeleton, at = motion.skeleton, motion.samples_of(0)
    turn = move(skeleton, motion.coordinates[at]).rotation
    for m, site in enumerate(skeleton.markers):
        bone = turn[skeleton.index(site.segment)]
        own = (np.swapaxes(bone, 1, 2) @ slide[at, m, :, None])[..., 0]
        assert np.sqrt((own**2).sum(axis=1).mean()) == pytest.approx(size, rel=1e-9)
        # along one line of the bone, and no faster than the joints (2 pi f, some 1.8 Hz at most)
        assert np.linalg.matrix_rank(own, tol=1e-9) == 1
        fastest = 2 * np.pi * (0.3 + 0.1 * len(skeleton.coordinates)) / motion.sample_rate_hz
        assert np.abs(np.diff(own, axis=0)).max() < fastest * np.abs(own).max()


def test_relaxed_emg_has_the_level_and_the_band_asked():
    motion = motion_of(arm_skeleton(70.0, 1.74), seconds=20.0)
    emg = relaxed_emg(motion, percent=2.0, seed=1)
    assert emg.sample_rate_hz == 1000
    assert len(emg.offsets) == 3
    level = np.abs(emg.signals).mean(axis=0)
    # rectified Gaussian noise: cv .76; 430 Hz of band leave some 0.86 of the samples independent
    error = 4 * 0.76 * 0.02 / np.sqrt(0.8 * len(emg.signals))
    np.testing.assert_allclose(level, 0.02, atol=error)
    power = np.abs(np.fft.rfft(emg.signals[: emg.offsets[1]], axis=0)) ** 2
    hertz = np.fft.rfftfreq(int(emg.offsets[1]), 1e-3)
    assert power[hertz < 10].mean() < 0.1 * power[(hertz > 50) & (hertz < 400)].mean()


def test_a_burst_is_where_it_was_asked_for_and_nowhere_else():
    motion = motion_of(arm_skeleton(70.0, 1.74), seconds=10.0)
    emg = relaxed_emg(motion, percent=2.0, bursts=[(1, "triceps", 3.0, 5.0, 10.0)], seed=2)
    calm = relaxed_emg(motion, percent=2.0, seed=2)
    changed = np.argwhere(emg.signals != calm.signals)
    start = int(emg.offsets[1])
    assert set(changed[:, 1]) == {1}
    assert changed[:, 0].min() >= start + 3000
    assert changed[:, 0].max() <= start + 5000
    inside = np.abs(emg.signals[start + 3100 : start + 4900, 1]).mean()
    assert inside == pytest.approx(0.10, abs=4 * 0.76 * 0.10 / np.sqrt(0.8 * 1800))


def test_impossible_studios_are_refused():
    motion = motion_of(arm_skeleton(70.0, 1.74))
    for wrong, message in (
        ({"marker_noise_m": np.nan}, "marker_noise_m is nan"),
        ({"soft_tissue_m": -1e-3}, "soft_tissue_m"),
        ({"dropout": -0.1}, "dropout is -0.1"),
        ({"burst_s": 0.5}, "bursts of 0.5 s"),
    ):
        with pytest.raises(InputError, match=message):
            Studio(**wrong)
    bare = Skeleton(motion.skeleton.segments)
    with pytest.raises(InputError, match="without markers"):
        film(motion_of(bare))
    with pytest.raises(InputError, match="no muscle 'deltoid'"):
        relaxed_emg(motion, bursts=[(0, "deltoid", 0.0, 1.0, 10.0)])
    with pytest.raises(InputError, match="a trial that there is not"):
        relaxed_emg(motion, bursts=[(7, "biceps", 0.0, 1.0, 10.0)])
