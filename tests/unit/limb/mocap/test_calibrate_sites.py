"""Marker sites from a standing trial, and the model skeletons they start from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.core.skeleton import MarkerSite, Skeleton
from armimpedance.limb.arm.anthropometry import two_link_arm
from armimpedance.limb.arm.skeletons import body_skeleton, elbow_skeleton
from armimpedance.limb.mocap.joint_motion import joint_motion
from armimpedance.limb.mocap.kinematics import calibrate_sites
from manipulandum_sim.tree_dynamics import marker_positions, mass_matrix

MODEL = elbow_skeleton(70.0, 1.75)


def worn(skeleton: Skeleton, seed=0) -> Skeleton:
    """The skeleton with its markers up to some cm off the model's sites."""
    shift = 0.015 * np.random.default_rng(seed).normal(size=(len(skeleton.markers), 3))
    # what is common to all is the skeleton's place, which no standing trial shows
    shift -= shift.mean(axis=0)
    sites = [
        MarkerSite(m.name, m.segment, m.position_m + s)
        for m, s in zip(skeleton.markers, shift, strict=True)
    ]
    return replace(skeleton, markers=tuple(sites))


def film(skeleton, q, noise_m=0.0, seed=0):
    places = marker_positions(skeleton, q)
    return MarkerRecording(
        sample_rate_hz=30.0,
        trials=pd.DataFrame({"trial": [1], "condition": ["standing"]}),
        offsets=np.array([0, len(q)]),
        time_s=np.arange(len(q)) / 30.0,
        positions=places + noise_m * np.random.default_rng(seed).normal(size=places.shape),
        names=skeleton.marker_names,
    )


def standing(skeleton, heading=0.0, frames=30):
    q = np.zeros((frames, len(skeleton.coordinates)))
    q[:, :3], q[:, 3] = [0.4, -0.2, 0.95], heading
    return q


@pytest.mark.parametrize("heading", [0.0, 2.0, -3.0])
def test_sites_up_to_the_common_turn(heading):
    true = worn(MODEL)
    found = calibrate_sites(MODEL, film(true, standing(MODEL, heading)))
    # a turn about z common to all markers is a heading; the sites agree but for that
    at = np.zeros((1, 10))
    a, b = marker_positions(true, at)[0], marker_positions(found, at)[0]
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    turn = np.arctan2((b[:, 0] * a[:, 1] - b[:, 1] * a[:, 0]).sum(), (b * a)[:, :2].sum())
    c, s = np.cos(turn), np.sin(turn)
    np.testing.assert_allclose(b @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), a, atol=1e-9)
    assert abs(turn) < 0.05


def test_the_models_own_sites_come_back():
    found = calibrate_sites(MODEL, film(MODEL, standing(MODEL, 1.0), noise_m=1e-3))
    away = [
        np.abs(f.position_m - m.position_m).max()
        for f, m in zip(found.markers, MODEL.markers, strict=True)
    ]
    # the mean of 30 frames, and as much again for the heading's error
    assert max(away) < 5 * 2 * 1e-3 / np.sqrt(30)


def test_calibrated_sites_take_the_elbows_error_away():
    true = worn(MODEL, seed=4)
    q = standing(MODEL, frames=40)
    q[:, 6], q[:, 9] = 0.3 * np.sin(np.arange(40) / 5), 0.8 + 0.4 * np.cos(np.arange(40) / 5)
    swing = film(true, q)
    calibrated = calibrate_sites(MODEL, film(true, standing(MODEL)))

    def elbow_error(skeleton):
        motion = joint_motion(swing, skeleton, largest_residual_m=0.1).motion
        return np.abs(motion.coordinates[:, 9] - q[:, 9]).max()

    assert elbow_error(calibrated) < 0.25 * elbow_error(MODEL)


def test_a_marker_the_model_does_not_know():
    true = replace(
        MODEL, markers=(*MODEL.markers, MarkerSite("wrist", "right_forearm", np.full(3, 0.02)))
    )
    trial = film(true, standing(MODEL))
    found = calibrate_sites(MODEL, trial, segments={"wrist": "right_forearm"})
    np.testing.assert_allclose(found.markers[-1].position_m, 0.02, atol=1e-9)
    assert "wrist" not in calibrate_sites(MODEL, trial).marker_names
    with pytest.raises(InputError, match="no marker thumb"):
        calibrate_sites(MODEL, trial, segments={"thumb": "right_forearm"})


def test_refusals():
    moving = standing(MODEL)
    moving[:, 0] = np.linspace(0, 0.3, len(moving))
    with pytest.raises(InputError, match=r"moves by .* mm"):
        calibrate_sites(MODEL, film(MODEL, moving))
    one = replace(MODEL, markers=MODEL.markers[:1])
    with pytest.raises(InputError, match="1 markers with a first guess"):
        calibrate_sites(one, film(MODEL, standing(MODEL)))


def test_body_has_36_coordinates_and_weighs_what_it_should():
    body = body_skeleton(73.0, 1.741)
    assert (len(body.segments), len(body.coordinates), len(body.markers)) == (15, 36, 35)
    assert body.mass_kg == pytest.approx(73.0, abs=1e-9)
    inertia = mass_matrix(body, np.random.default_rng(0).uniform(-1, 1, (3, 36)))
    assert (np.linalg.eigvalsh(inertia) > 0).all()


def test_body_is_a_mirror_of_itself():
    body = body_skeleton(73.0, 1.741)
    q = np.zeros((1, 36))
    right, left = q.copy(), q.copy()
    rng = np.random.default_rng(2)
    for name in body.coordinates:
        if name.startswith("right_"):
            angle = rng.uniform(-0.8, 0.8)
            right[0, body.coordinate(name)] = angle
            left[0, body.coordinate(name.replace("right_", "left_"))] = angle
    mirror = np.array([1.0, -1.0, 1.0])
    a, b = marker_positions(body, right)[0] * mirror, marker_positions(body, left)[0]
    for m, name in enumerate(body.marker_names):
        other = name.replace("right_", "*").replace("left_", "right_").replace("*", "left_")
        np.testing.assert_allclose(a[m], b[body.marker_names.index(other)], atol=1e-12)


@pytest.mark.parametrize(
    ("coordinate", "marker", "axis", "sign"),
    [
        ("right_shoulder_flexion", "right_epicondyle", 0, 1),
        ("right_shoulder_abduction", "right_epicondyle", 1, -1),
        ("left_shoulder_abduction", "left_epicondyle", 1, 1),
        ("left_elbow_flexion", "left_knuckle_2", 0, 1),
        ("right_hip_flexion", "right_knee", 0, 1),
        ("right_knee_flexion", "right_heel", 0, -1),
        ("left_ankle_dorsiflexion", "left_toe", 2, 1),
        ("trunk_flexion", "sternum", 0, 1),
        ("trunk_bend_right", "c7", 1, -1),
        ("neck_twist_left", "forehead", 1, 1),
    ],
)
def test_a_name_means_its_direction(coordinate, marker, axis, sign):
    body = body_skeleton(73.0, 1.741)
    q = np.zeros((2, 36))
    q[1, body.coordinate(coordinate)] = 0.2
    places = marker_positions(body, q)[:, body.marker_names.index(marker), axis]
    assert sign * (places[1] - places[0]) > 0.005


def test_elbow_skeleton_is_the_two_link_arm():
    skeleton = elbow_skeleton(70.0, 1.75, upper_arm_m=0.31, forearm_hand_m=0.36)
    arm = two_link_arm(70.0, 1.75, upper_arm_m=0.31, forearm_hand_m=0.36)
    q = np.zeros((1, 10))
    # the elbow's own inertia: of forearm and hand about the elbow
    own = arm.forearm_hand_inertia_kgm2 + arm.forearm_hand_kg * arm.forearm_hand_com_m**2
    assert mass_matrix(skeleton, q)[0, 9, 9] == pytest.approx(own, rel=1e-12)
    whole = mass_matrix(skeleton, q)[0, 6, 6]
    reach = arm.upper_arm_m + arm.forearm_hand_com_m
    expected = (
        arm.upper_arm_inertia_kgm2
        + arm.upper_arm_kg * arm.upper_arm_com_m**2
        + arm.forearm_hand_inertia_kgm2
        + arm.forearm_hand_kg * reach**2
    )
    assert whole == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("mass", "height"), [(0, 1.7), (70, 175), (np.nan, 1.7), (70, -1)])
def test_people_that_are_none(mass, height):
    for build in (elbow_skeleton, body_skeleton):
        with pytest.raises(InputError, match="expected more than 0"):
            build(mass, height)
