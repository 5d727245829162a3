"""The simulated body's bones, masses and markers."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from armimpedance.core.errors import InputError
from armimpedance.limb.arm.skeleton_model import skeleton_model
from manipulandum_sim.body.segments import inertial_parameters
from manipulandum_sim.body.subject import body_subject, find_body_subject
from manipulandum_sim.tree_dynamics import marker_positions, move


@pytest.fixture(scope="module")
def subject():
    return find_body_subject("A")


def pseudo_inertia(segment):
    """Mass moments (4, 4) of a segment about its frame's origin.

    ``P = [[S, m c], [m c^T, m]]``, ``S = tr(I)/2 E - I`` with I about the origin; a body is
    physically possible where P is positive definite.
    """
    m, c = segment.mass_kg, segment.com_m
    second = 0.5 * np.trace(segment.inertia_kgm2) * np.eye(3) - segment.inertia_kgm2
    P = np.empty((4, 4))
    P[:3, :3] = second + m * np.outer(c, c)
    P[:3, 3] = P[3, :3] = m * c
    P[3, 3] = m
    return P


def test_fifteen_segments_thirty_six_coordinates_thirty_five_markers(subject):
    skeleton = subject.skeleton
    assert len(skeleton.segments) == 15
    assert len(skeleton.coordinates) == 36
    assert len(skeleton.marker_names) == 35


@pytest.mark.parametrize("seed", range(5))
def test_any_subject_is_a_possible_body_of_the_given_mass(seed):
    subject = body_subject("x", 81.0, 1.85, seed=seed)
    assert subject.skeleton.mass_kg == pytest.approx(81.0, rel=1e-12)
    assert subject.table_skeleton.mass_kg == pytest.approx(81.0, rel=1e-3)
    for segment in subject.skeleton.segments:
        assert np.linalg.eigvalsh(pseudo_inertia(segment)).min() > 0
        principal = np.linalg.eigvalsh(segment.inertia_kgm2)
        assert principal[2] < principal[0] + principal[1]


def test_masses_deviate_by_the_sd_that_was_asked_for():
    sd, ratios = 0.15, []
    for seed in range(40):
        subject = body_subject(deviation_sd=sd, seed=seed)
        own, table = (
            inertial_parameters(s)[:, 0] for s in (subject.skeleton, subject.table_skeleton)
        )
        # The common factor that keeps the body's mass drops out against the segments' mean.
        logs = np.log(own / table)
        ratios.append(logs - logs.mean())
    found = np.std(ratios) * np.sqrt(15 / 14)
    # An sd estimated from 40 x 14 free normal numbers has a relative standard error of 3 %.
    assert abs(found / sd - 1) < 4 / np.sqrt(2 * 40 * 14)


def test_without_deviation_the_subject_is_the_table():
    subject = body_subject(deviation_sd=0.0)
    own, table = (inertial_parameters(s) for s in (subject.skeleton, subject.table_skeleton))
    np.testing.assert_array_equal(own, table)


def test_parameters_are_pinocchio_s(subject):
    model = skeleton_model(subject.skeleton)
    expected = [inertia.toDynamicParameters() for inertia in list(model.inertias)[1:]]
    np.testing.assert_allclose(inertial_parameters(subject.skeleton), expected, atol=1e-12)


# (coordinate, segment, point of it, direction in which it goes first)
DIRECTIONS = [
    ("trunk_flexion", "head", (0, 0, 0), (1, 0, 0)),
    ("trunk_bend_right", "head", (0, 0, 0), (0, -1, 0)),
    ("trunk_twist_left", "thorax", (1, 0, 0), (0, 1, 0)),
    ("neck_flexion", "head", (0, 0, 1), (1, 0, 0)),
    ("right_shoulder_flexion", "right_forearm", (0, 0, 0), (1, 0, 0)),
    ("right_shoulder_abduction", "right_forearm", (0, 0, 0), (0, -1, 0)),
    ("left_shoulder_abduction", "left_forearm", (0, 0, 0), (0, 1, 0)),
    ("right_shoulder_rotation", "right_upper_arm", (1, 0, 0), (0, 1, 0)),
    ("left_shoulder_rotation", "left_upper_arm", (1, 0, 0), (0, -1, 0)),
    ("left_elbow_flexion", "left_hand", (0, 0, 0), (1, 0, 0)),
    ("right_wrist_flexion", "right_hand", (0, 0, -1), (0, 1, 0)),
    ("left_wrist_flexion", "left_hand", (0, 0, -1), (0, -1, 0)),
    ("right_wrist_radial", "right_hand", (0, 0, -1), (1, 0, 0)),
    ("left_hip_flexion", "left_shank", (0, 0, 0), (1, 0, 0)),
    ("right_hip_abduction", "right_shank", (0, 0, 0), (0, -1, 0)),
    ("left_hip_rotation", "left_thigh", (1, 0, 0), (0, -1, 0)),
    ("right_knee_flexion", "right_foot", (0, 0, 0), (-1, 0, 0)),
    ("left_ankle_dorsiflexion", "left_foot", (1, 0, 0), (0, 0, 1)),
    ("right_ankle_inversion", "right_foot", (0, 0, -1), (0, 1, 0)),
]


@pytest.mark.parametrize(("coordinate", "segment", "point", "way"), DIRECTIONS)
def test_a_coordinate_turns_the_way_its_name_says(subject, coordinate, segment, point, way):
    skeleton = subject.skeleton
    q = np.zeros((2, 36))
    q[1, skeleton.coordinate(coordinate)] = 0.1
    motion, i = move(skeleton, q), skeleton.index(segment)
    place = motion.origin[i] + motion.rotation[i] @ np.array(point, float)
    moved = place[1] - place[0]
    assert moved @ np.array(way) > 0.95 * np.linalg.norm(moved) > 0


def test_the_sides_are_mirror_images(subject):
    skeleton = subject.table_skeleton
    rng = np.random.default_rng(4)
    q = np.zeros((1, 36))
    for i, name in enumerate(skeleton.coordinates):
        if name.startswith("right_"):
            left = skeleton.coordinate(name.replace("right", "left"))
            q[0, [i, left]] = rng.uniform(-0.5, 0.5)
    markers = dict(zip(skeleton.marker_names, marker_positions(skeleton, q)[0], strict=True))
    for name, place in markers.items():
        if name.startswith("right_"):
            other = markers[name.replace("right", "left")]
            np.testing.assert_allclose(place * [1, -1, 1], other, atol=1e-12)


def test_the_markers_determine_every_coordinate(subject):
    skeleton, step = subject.skeleton, 1e-6
    for posture in np.random.default_rng(2).uniform(0.05, 0.6, (4, 36)):
        unit = step * np.eye(36)
        ahead, behind = (marker_positions(skeleton, posture + s * unit) for s in (1, -1))
        J = ((ahead - behind) / (2 * step)).reshape(36, -1).T
        # Half a millimetre of noise leaves no angle uncertain by more than a degree.
        sd = 0.5e-3 * np.sqrt(np.diag(np.linalg.inv(J.T @ J)))
        assert sd.max() < np.deg2rad(1.0)


def test_hostile_numbers_and_names():
    with pytest.raises(InputError, match="mass"):
        body_subject(mass_kg=-1.0)
    with pytest.raises(InputError, match="height"):
        body_subject(height_m=174.0)
    with pytest.raises(InputError, match="deviation"):
        body_subject(deviation_sd=np.nan)
    with pytest.raises(InputError, match="no simulated body 'C'"):
        find_body_subject("C")


def test_base_rows_identify_what_all_rows_do(subject):
    """128 base parameters, with one null space for the root's six rows and for all rows."""
    model = skeleton_model(subject.skeleton)
    data = model.createData()
    states = np.random.default_rng(8).normal(size=(60, 3, 36))
    rows = [pin.computeJointTorqueRegressor(model, data, *state).copy() for state in states]
    spaces = []
    for count in (6, 36):
        Y = np.concatenate([row[:count] for row in rows])
        scale = np.linalg.norm(Y, axis=0)
        scale[scale == 0] = 1
        values, axes = np.linalg.svd(Y / scale)[1:]
        assert (values > 1e-10 * values[0]).sum() == 128
        axes = axes[:128] * scale
        spaces.append(np.linalg.qr(axes.T)[0])
    overlap = np.linalg.svd(spaces[0].T @ spaces[1], compute_uv=False)
    assert overlap.min() == pytest.approx(1.0, abs=1e-10)
