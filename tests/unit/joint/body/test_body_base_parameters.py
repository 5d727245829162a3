"""What a motion can show: the ranks of the structure, and texts that say what the map does."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import Hinge
from armimpedance.joint.body.base_parameters import base_parameters, essential_base_parameters
from armimpedance.joint.body.regressor import (
    inertial_parameters,
    parameter_names,
    parameter_units,
    regressor,
    robot_terms,
)
from armimpedance.joint.body.rows import RowChoice
from armimpedance.limb.arm.skeleton_model import skeleton_model


def triangle(skeleton, *, still_root=False, static=False, rows=None, samples=130, seed=0):
    rng = np.random.default_rng(seed)
    n = len(skeleton.coordinates)
    q, qd, qdd = rng.uniform(-1, 1, (3, samples, n)) * np.array([1, 3, 20])[:, None, None]
    if still_root:
        q[:, :6], qd[:, :6], qdd[:, :6] = q[0, :6], 0, 0
    if static:
        qd[:], qdd[:] = 0, 0
    Y = regressor(skeleton_model(skeleton), q, qd, qdd, rows)
    return np.linalg.qr(Y.reshape(-1, Y.shape[2]), mode="r")


def of(skeleton, R):
    return base_parameters(R, parameter_names(skeleton), parameter_units(skeleton))


def test_a_body_has_128_from_its_root_as_from_all_rows(body):
    root = essential_base_parameters(body)
    everything = essential_base_parameters(body, RowChoice(rows="all"), seed=5)
    assert root.rank == everything.rank == 128
    # the same null space: each one's map sends the other's to nothing
    assert np.abs(root.mapping @ everything.null_space).max() < 1e-10
    assert np.abs(everything.mapping @ root.null_space).max() < 1e-10


def test_a_still_root_shows_121_and_still_postures_42(body):
    assert of(body, triangle(body, still_root=True, rows=np.arange(6))).rank == 121
    assert of(body, triangle(body, static=True, rows=np.arange(6))).rank == 42


@pytest.mark.parametrize("seed", range(3))
def test_rank_follows_from_the_joints(rigs, seed):
    rng = np.random.default_rng(seed)
    counts = rng.integers(1, 4, 5)
    names = ["a", "b", "c", "d", "e"]
    branches = [("root", None, 0)]
    for i, (name, count) in enumerate(zip(names, counts, strict=True)):
        parent = (["root"] + names)[rng.integers(0, i + 1)]
        branches.append((name, parent, int(count)))
    skeleton = rigs.tree(branches, seed)
    # a hinge hides three parameters of its segment, two or three hinges one
    hidden = sum(3 if count == 1 else 1 for count in counts)
    assert essential_base_parameters(skeleton).rank == 60 - hidden


def test_what_cannot_be_shown_changes_no_row(small):
    base = essential_base_parameters(small)
    R = triangle(small, seed=9)
    assert np.abs(R @ base.null_space).max() < 1e-10 * np.abs(R).max()
    phi = inertial_parameters(small)
    np.testing.assert_allclose(R @ base.lift(base.of(phi)), R @ phi, atol=1e-10 * np.abs(R).max())


def test_the_text_says_what_the_map_does(small):
    base = essential_base_parameters(small)
    names = list(parameter_names(small))
    for text, row, lead in zip(base.expressions, base.mapping, base.names, strict=True):
        assert text.split()[0] == lead
        said = np.zeros(len(names))
        for sign, size, name in re.findall(r"([+-])? ?([\d.e-]+ )?([mI]\w+)", text):
            said[names.index(name)] = float(size or 1) * (-1 if sign == "-" else 1)
        np.testing.assert_allclose(said, row, rtol=1e-3)


def test_units_of_measurement_do_not_change_what_is_found(small):
    R = triangle(small)
    scale = np.tile([1e3, *[1e-2] * 3, *[1e5] * 6], 3)
    assert of(small, R).names == of(small, R / scale).names


def with_first_axis(robot, axis):
    """The same robot whose first hinge turns about this axis."""
    first = replace(robot.segments[1], hinges=(Hinge("link1_flexion", np.array(axis)),))
    return replace(robot, segments=(robot.segments[0], first, *robot.segments[2:]))


@pytest.mark.parametrize(("axis", "first"), [((0.0, 0.0, 1.0), 1), ((0.6, 0.0, 0.8), 3)])
def test_a_motors_inertia_joins_the_first_links_own(rigs, axis, first):
    robot = with_first_axis(rigs.tree(rigs.ROBOT, 2, floating=False), axis)
    plain = essential_base_parameters(robot)
    # the first link shows its inertia about the axis, and two moments if gravity bends the axis
    assert plain.rank == first + 6 * 7
    terms = robot_terms(robot)
    full = essential_base_parameters(robot, RowChoice(rows="all", terms=terms))
    assert full.rank == plain.rank + len(terms) - 1
    assert any("I_link1_flexion" in text for text in full.expressions[:first])


def test_a_regressor_of_zeros_is_refused(small):
    with pytest.raises(InputError, match="nothing moves"):
        of(small, np.zeros((30, 30)))
