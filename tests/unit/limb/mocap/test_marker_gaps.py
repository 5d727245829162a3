"""Lost markers: the others go on; what they leave open is bridged, but not for long."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.limb.arm.skeletons import elbow_skeleton
from armimpedance.limb.mocap.joint_motion import joint_motion
from manipulandum_sim.tree_dynamics import marker_positions

ELBOW = elbow_skeleton(70.0, 1.75)
RATE = 30.0
FRAMES = 60
ARM = ("upper_arm", "epicondyle", "forearm", "hand")


def filmed():
    """A swing, elbow bent, 1 Hz."""
    t = np.arange(FRAMES) / RATE
    q = np.zeros((FRAMES, 10))
    q[:, 2], q[:, 3] = 1.0, 0.3 * np.sin(2 * np.pi * 0.8 * t)
    q[:, 6] = 0.4 * np.sin(2 * np.pi * t)
    q[:, 8] = 0.2 * np.cos(2 * np.pi * t)
    q[:, 9] = 0.9 + 0.4 * np.sin(2 * np.pi * t + 1)
    markers = MarkerRecording(
        sample_rate_hz=RATE,
        trials=pd.DataFrame({"trial": [7], "condition": ["swing"]}),
        offsets=np.array([0, FRAMES]),
        time_s=t,
        positions=marker_positions(ELBOW, q),
        names=ELBOW.marker_names,
        skeleton=ELBOW,
    )
    return q, markers


def without(markers, names, first, last):
    """The recording with these markers lost in frames first to last - 1."""
    positions = np.array(markers.positions)
    positions[first:last, [markers.names.index(n) for n in names]] = np.nan
    return replace(markers, positions=positions)


@pytest.mark.parametrize("name", ELBOW.marker_names)
def test_one_marker_lost_for_good_costs_nothing(name):
    q, markers = filmed()
    fit = joint_motion(without(markers, (name,), 0, FRAMES))
    np.testing.assert_allclose(fit.motion.coordinates, q, atol=1e-9)
    assert not fit.bridged.any()


def test_a_short_loss_of_the_arm_is_bridged_and_the_trunk_still_exact():
    q, markers = filmed()
    fit = joint_motion(without(markers, ARM, 40, 46))
    away = np.abs(fit.motion.coordinates - q)
    assert np.flatnonzero(fit.bridged).tolist() == list(range(40, 46))
    assert away[:, :6].max() < 1e-9
    assert np.delete(away, range(40, 46), axis=0).max() < 1e-9
    # a cubic spline over h = 7/30 s errs by (5/384) h^4 max|q''''|, (2 pi)^4 * .4 = 620 rad/s^4
    assert away.max() < 5 / 384 * (7 / RATE) ** 4 * (2 * np.pi) ** 4 * 0.4 * 2
    assert "6 of 60" in fit.motion.provenance[-1]


def test_a_long_loss_is_refused_in_one_line():
    _, markers = filmed()
    with pytest.raises(InputError) as told:
        joint_motion(without(markers, ARM, 40, 47))
    message = str(told.value)
    assert "\n" not in message
    for part in ("trial 7", "upper_arm", "1.333 to 1.533 s", "0.233 s", "0.2 s"):
        assert part in message
    joint_motion(without(markers, ARM, 40, 47), longest_gap_s=0.25)


@pytest.mark.parametrize(("first", "last"), [(0, 3), (FRAMES - 3, FRAMES)])
def test_at_the_ends_the_nearest_posture_is_held_for_half_as_long(first, last):
    _, markers = filmed()
    q = joint_motion(without(markers, ARM, first, last)).motion.coordinates
    nearest = last if first == 0 else first - 1
    np.testing.assert_allclose(q[first:last, 6:], np.tile(q[nearest, 6:], (3, 1)), atol=1e-6)
    longer = (first, last + 1) if first == 0 else (first - 1, last)
    with pytest.raises(InputError, match="at the trial's end"):
        joint_motion(without(markers, ARM, *longer))


def test_all_markers_lost_throughout():
    _, markers = filmed()
    with pytest.raises(InputError, match="do not determine the posture"):
        joint_motion(without(markers, markers.names, 0, FRAMES))


def test_random_losses_leave_the_determined_frames_exact():
    q, markers = filmed()
    rng = np.random.default_rng(3)
    positions = np.array(markers.positions)
    for m in range(len(markers.names)):
        for first in rng.integers(1, FRAMES - 4, 5):
            positions[first : first + rng.integers(1, 4), m] = np.nan
    fit = joint_motion(replace(markers, positions=positions))
    away = np.abs(fit.motion.coordinates - q)
    assert np.isnan(positions).any()
    assert away[~fit.bridged].max() < 1e-9
    assert away.max() < 0.05
