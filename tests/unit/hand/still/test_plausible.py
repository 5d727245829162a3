"""What can be no limb is refused by name: other units, another sign, other axes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.records import Subject
from armimpedance.hand.still.checks import check_limb


@pytest.fixture(scope="module")
def sound(limb):
    return limb.record(sets=2, force_noise=0.1, seed=3, subject=Subject("A", mass_kg=70.0))


def verdicts(recording):
    return {check.name: check.verdict for check in check_limb(recording)}


def message(recording, name):
    return next(check.message for check in check_limb(recording) if check.name == name)


def turned(samples, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return samples @ np.array([[c, s], [-s, c]])


def test_a_limb_passes(sound):
    assert set(verdicts(sound).values()) == {"ok"}


@pytest.mark.parametrize("factor", [1e3, 1 / 9.81, 1 / 4.448])
def test_forces_in_other_units(sound, factor):
    """mN, kgf, lbf: the inertia is theirs, and no body of 70 kg has such a hand."""
    assert verdicts(replace(sound, force=factor * sound.force))["units"] == "unusable"


@pytest.mark.parametrize("factor", [1e3, 1e2, 39.37])
def test_positions_in_other_units(sound, factor):
    assert verdicts(replace(sound, position=factor * sound.position))["units"] == "unusable"


@pytest.mark.parametrize("factor", [1e3, 1e2])
def test_units_that_cancel_in_the_inertia_show_in_the_way(sound, factor):
    both = replace(sound, position=factor * sound.position, force=factor * sound.force)
    assert "another unit" in message(both, "units")


def test_without_a_body_mass_only_what_no_limb_has_is_refused(sound):
    unknown = replace(sound, subject=Subject("A"))
    assert verdicts(unknown)["units"] == "ok"
    assert verdicts(replace(unknown, force=unknown.force / 9.81))["units"] == "unusable"


def test_a_hand_further_away_than_the_arm_is_long(sound):
    person = Subject("A", mass_kg=70.0, upper_arm_m=0.3, forearm_hand_m=0.34)
    near = replace(sound, subject=person, shoulder_m=np.zeros(2))
    assert verdicts(near)["reach"] == "ok"
    assert verdicts(replace(near, shoulder_m=np.full(2, -0.19)))["reach"] == "warning"
    assert verdicts(replace(near, shoulder_m=np.full(2, -0.5)))["reach"] == "unusable"


def test_the_other_sign(sound):
    assert verdicts(replace(sound, force=-sound.force))["force sign"] == "unusable"


def test_a_tremor_that_moves_a_robot_of_two_kilograms_is_no_wrong_sign(sound):
    rng, w = np.random.default_rng(8), 2 * np.pi * 8.0
    position, force = sound.position.copy(), sound.force.copy()
    for row in range(sound.n_trials):
        at = sound.samples_of(row)
        t = sound.time_s[at]
        x = 1.5e-3 * np.sin(w * t[:, None] + rng.uniform(0, 2 * np.pi, 2))
        position[at] += x
        # the robot follows the person's force: f = 2 kg x''
        force[at] += -2.0 * w**2 * x
    shaken = replace(sound, position=position, force=force)
    assert verdicts(shaken)["tremor"] == "unusable"
    assert "force sign" not in verdicts(shaken)
    assert "some 8 Hz" in message(shaken, "tremor")


@pytest.mark.parametrize(
    ("damage", "named"),
    [
        (lambda f: f[:, ::-1], "axes x and y are exchanged"),
        (lambda f: f * [1, -1], "axis y is mirrored"),
        (lambda f: f * [-1, 1], "axis x is mirrored"),
        (lambda f: turned(f, 90), "axes x and y are exchanged, one of them is mirrored"),
    ],
)
def test_exchanged_and_mirrored_axes_are_named(sound, damage, named):
    assert named in message(replace(sound, force=damage(sound.force)), "axes")


@pytest.mark.parametrize(
    ("degrees", "verdict"), [(5, "warning"), (-12, "warning"), (40, "unusable")]
)
def test_the_angle_between_the_axes_is_found(sound, degrees, verdict):
    """``F = Q F_true`` makes ``Q M`` of M; its polar decomposition gives back Q."""
    found = next(
        check
        for check in check_limb(replace(sound, force=turned(sound.force, degrees)))
        if check.name == "axes"
    )
    assert found.verdict == verdict
    angle, error = (
        float(part)
        for part in found.message.split("turned by ")[1].split(" deg (sd ")[:1]
        + [found.message.split("(sd ")[1].split(")")[0]]
    )
    assert angle == pytest.approx(abs(degrees), abs=4 * max(error, 0.1))


def test_three_axes(limb):
    identity = np.eye(3)
    recording = limb.record(
        inertia=np.diag([1.0, 1.5, 2.0]),
        viscosity=10 * identity,
        stiffness=200 * identity,
        sets=3,
        directions=8,
        force_noise=0.02,
    )
    assert verdicts(recording)["axes"] == "ok"
    swapped = replace(recording, force=recording.force[:, [1, 2, 0]])
    assert "exchanged" in message(swapped, "axes")


def test_degrees_and_millinewton_metres_of_a_joint(limb):
    one = {"inertia": 0.06 * np.eye(1), "viscosity": np.eye(1), "stiffness": 10 * np.eye(1)}
    joint = limb.record(kind="joint", sets=4, directions=2, amplitude=0.03, force_noise=0.01, **one)
    assert verdicts(joint)["units"] == "ok"
    degrees = replace(joint, position=np.degrees(joint.position))
    assert "degrees" in message(degrees, "units")
    assert verdicts(replace(joint, force=1000 * joint.force))["units"] == "unusable"
    assert verdicts(replace(joint, force=-joint.force))["force sign"] == "unusable"


def test_too_noisy_to_tell(limb):
    assert verdicts(limb.record(sets=1, force_noise=100.0, seed=1))["axes"] == "cannot tell"
