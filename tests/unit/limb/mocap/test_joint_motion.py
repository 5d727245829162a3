"""Joint motion from markers of known motions: exact without noise, efficient with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import EstimationError, InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.core.skeleton import Hinge, MarkerSite, Segment, Skeleton
from armimpedance.limb.arm.skeletons import body_skeleton, elbow_skeleton
from armimpedance.limb.mocap.joint_motion import joint_motion
from armimpedance.limb.mocap.kinematics import marker_jacobian, marker_tree
from manipulandum_sim.tree_dynamics import marker_positions

ELBOW = elbow_skeleton(70.0, 1.75)
NOISE_M = 0.5e-3


def swing(skeleton, frames, rate, seed, amplitude=0.6, heading=0.0):
    """Random smooth coordinates (frames, n); three sines below 1.2 Hz each."""
    rng = np.random.default_rng(seed)
    t = np.arange(frames) / rate
    n = len(skeleton.coordinates)
    f, phase = rng.uniform(0.1, 1.2, (2, 3, n))
    size = amplitude / 3 * rng.normal(size=(3, n))
    q = (size * np.sin(2 * np.pi * (f * t[:, None, None] + phase))).sum(axis=1)
    if skeleton.floating:
        q[:, 3] += heading
    return q


def record(skeleton, q, rate, noise_m=0.0, seed=0, lengths=None):
    lengths = [len(q)] if lengths is None else lengths
    places = marker_positions(skeleton, q)
    places = places + noise_m * np.random.default_rng(seed).normal(size=places.shape)
    trials = pd.DataFrame(
        {"trial": np.arange(1, len(lengths) + 1), "condition": ["swing"] * len(lengths)}
    )
    return MarkerRecording(
        sample_rate_hz=rate,
        trials=trials,
        offsets=np.concatenate([[0], np.cumsum(lengths)]),
        time_s=np.concatenate([np.arange(n) / rate for n in lengths]),
        positions=places,
        names=skeleton.marker_names,
        skeleton=skeleton,
    )


def error(fit, q, lengths=None):
    """Error of the coordinates, whole turns of a trial's root taken away."""
    away = fit.motion.coordinates - q
    first = 0
    for n in [len(q)] if lengths is None else lengths:
        rows = slice(first, first + n)
        away[rows, 3:] -= 2 * np.pi * np.round(away[first, 3:] / (2 * np.pi))
        first += n
    return away


@pytest.mark.parametrize("heading", [0.0, 1.6, 3.1, -2.5])
def test_exact_from_any_heading(heading):
    q = swing(ELBOW, 90, 30.0, seed=3, heading=heading)
    fit = joint_motion(record(ELBOW, q, 30.0))
    assert np.abs(error(fit, q)).max() < 1e-9
    assert fit.residual_rms_m.max() < 1e-9
    assert fit.warnings == ()


def test_exact_with_36_coordinates():
    skeleton = body_skeleton(73.0, 1.741)
    q = swing(skeleton, 60, 100.0, seed=2, amplitude=0.5)
    fit = joint_motion(record(skeleton, q, 100.0))
    assert np.abs(error(fit, q)).max() < 1e-9


def test_several_trials_of_unequal_length():
    lengths = [40, 7, 65]
    q = np.concatenate([swing(ELBOW, n, 30.0, seed=n, heading=n) for n in lengths])
    fit = joint_motion(record(ELBOW, q, 30.0, lengths=lengths))
    assert np.abs(error(fit, q, lengths)).max() < 1e-9


def test_two_turns_of_the_trunk_without_a_jump():
    q = swing(ELBOW, 120, 30.0, seed=5)
    q[:, 3] += np.linspace(0.0, 4 * np.pi, 120)
    fit = joint_motion(record(ELBOW, q, 30.0))
    assert np.abs(error(fit, q)).max() < 1e-9


def test_single_postures_of_a_far_reaching_arm():
    rng = np.random.default_rng(8)
    low = [-1.0, -0.5, -1.2, 0.1]
    high = [2.8, 1.4, 1.2, 2.5]
    q = np.zeros((40, 10))
    q[:, 3] = rng.uniform(-3.1, 3.1, 40)
    q[:, 4:6] = rng.uniform(-1.2, 1.2, (40, 2))
    q[:, 6:] = rng.uniform(low, high, (40, 4))
    fit = joint_motion(record(ELBOW, q, 30.0, lengths=[1] * 40))
    assert np.abs(error(fit, q, [1] * 40)).max() < 1e-9


@pytest.mark.study
def test_sd_is_the_cramer_rao_bound():
    q = swing(ELBOW, 800, 30.0, seed=4)
    # bent elbow: the shoulder's rotation is well determined and the bound holds without curvature
    q[:, 9] += 1.4
    fit = joint_motion(record(ELBOW, q, 30.0, NOISE_M, seed=11))
    _, J = marker_jacobian(marker_tree(ELBOW), q)
    J = J.reshape(len(q), -1, q.shape[1])
    bound = NOISE_M * np.sqrt(np.einsum("fii->fi", np.linalg.inv(np.swapaxes(J, 1, 2) @ J)))
    ratio = (error(fit, q) / bound).std(axis=0)
    # standard error of a sd from N normal deviates: 1 / sqrt(2 N); ten of them, four errors
    assert np.abs(ratio - 1).max() < 4 / np.sqrt(2 * len(q))


def test_residual_tells_the_noise():
    q = swing(ELBOW, 300, 30.0, seed=4)
    fit = joint_motion(record(ELBOW, q, 30.0, NOISE_M, seed=12))
    # 24 numbers a frame less 10 coordinates
    expected = NOISE_M * np.sqrt(24 - 10)
    total = np.sqrt((fit.residual_rms_m**2).sum())
    assert abs(total / expected - 1) < 4 / np.sqrt(2 * 300 * 14)


def lever(length_m):
    """One hinge, one marker so far from its axis."""
    arm = Segment("arm", "base", np.zeros(3), (Hinge("turn", np.array([0.0, 0.0, 1.0])),))
    sites = (MarkerSite("tip", "arm", np.array([length_m, 0.0, 0.0])),)
    return Skeleton((Segment("base", None, np.zeros(3)), arm), sites, floating=False)


@pytest.mark.parametrize(("length_m", "largest"), [(0.007, 1e-4), (0.02, 1e-9)])
def test_natural_posture_does_not_bias_what_markers_determine(length_m, largest):
    skeleton = lever(length_m)
    q = np.full((3, 1), 1.5)
    fit = joint_motion(record(skeleton, q, 30.0))
    assert np.abs(fit.motion.coordinates - q).max() < largest


def test_natural_posture_holds_what_markers_leave_free():
    skeleton = lever(1e-5)
    markers = record(skeleton, np.full((4, 1), 1.0), 30.0)
    fit = joint_motion(markers, natural={"turn": 0.4})
    np.testing.assert_allclose(fit.motion.coordinates, 0.4, atol=1e-3)
    assert "do not determine turn" in fit.warnings[0]


def test_too_few_markers_still_give_a_posture():
    few = replace(ELBOW, markers=tuple(m for m in ELBOW.markers if m.name != "hand")[:6])
    q = swing(few, 40, 30.0, seed=6)
    fit = joint_motion(record(few, q, 30.0))
    places = marker_positions(few, fit.motion.coordinates)
    np.testing.assert_allclose(places, marker_positions(few, q), atol=1e-4)


def test_markers_without_a_site_and_sites_without_a_marker_are_told():
    q = swing(ELBOW, 30, 30.0, seed=7)
    markers = record(ELBOW, q, 30.0)
    kept = replace(ELBOW, markers=ELBOW.markers[1:])
    renamed = replace(markers, names=("wand", *markers.names[1:]), skeleton=ELBOW)
    told = " ".join(joint_motion(renamed).motion.provenance)
    assert "wand" in told
    assert "acromion_right" in told
    assert np.abs(error(joint_motion(markers, kept), q)).max() < 1e-9


def test_what_was_measured_beside_comes_along():
    q = swing(ELBOW, 30, 30.0, seed=7)
    wrenches = np.random.default_rng(0).normal(size=(30, 2, 6))
    markers = replace(
        record(ELBOW, q, 30.0), wrenches=wrenches, plate_origins_m=np.zeros((2, 3)),
        provenance=("Filmed.",),
    )  # fmt: skip
    motion = joint_motion(markers).motion
    np.testing.assert_array_equal(motion.wrenches, wrenches)
    assert motion.provenance[0] == "Filmed."


def spoilt(positions, how):
    if how == "swapped":
        return positions[:, [0, 1, 3, 2, 5, 4, 6, 7]]
    return positions * (1000.0 if how == "mm" else 1.25)


@pytest.mark.parametrize("how", ["swapped", "mm", "another body"])
def test_markers_that_the_skeleton_cannot_follow(how):
    markers = record(ELBOW, swing(ELBOW, 30, 30.0, seed=7), 30.0)
    with pytest.raises(EstimationError, match=r"mm \(rms\) from the skeleton's"):
        joint_motion(replace(markers, positions=spoilt(np.array(markers.positions), how)))


def test_one_swapped_trial_of_many_is_found():
    lengths = [20] * 6
    q = np.concatenate([swing(ELBOW, 20, 30.0, seed=n) for n in range(6)])
    markers = record(ELBOW, q, 30.0, lengths=lengths)
    positions = np.array(markers.positions)
    positions[60:80] = spoilt(positions[60:80], "swapped")
    with pytest.raises(EstimationError, match="trial 4: marker"):
        joint_motion(replace(markers, positions=positions))


def test_no_skeleton_no_site_no_angle():
    markers = record(ELBOW, swing(ELBOW, 5, 30.0, seed=7), 30.0)
    with pytest.raises(InputError, match="no skeleton"):
        joint_motion(replace(markers, skeleton=None))
    with pytest.raises(InputError, match="no marker that the skeleton has a site for"):
        joint_motion(replace(markers, names=tuple("abcdefgh")))
    with pytest.raises(InputError, match="no coordinate 'elbow'"):
        joint_motion(markers, natural={"elbow": 1.0})


def test_the_same_bits_again():
    markers = record(ELBOW, swing(ELBOW, 60, 30.0, seed=9), 30.0, NOISE_M)
    first, again = (joint_motion(markers).motion.coordinates for _ in range(2))
    np.testing.assert_array_equal(first, again)
