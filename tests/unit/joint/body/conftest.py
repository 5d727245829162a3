"""Small trees and the body's structure, moved by splines, with wrenches of the own dynamics."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.interpolate import make_interp_spline

from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import Hinge, Segment, Skeleton
from armimpedance.joint.body.regressor import moving_segments, pseudo_inertias
from manipulandum_sim.tree_dynamics import contact_wrench, inverse_dynamics

RATE = 100.0


def segment(name, parent, hinges, rng):
    """A segment whose mass lies at four or more random points: any such is possible."""
    points = rng.normal(0, 0.1, (8, 3)) + rng.normal(0, 0.1, 3)
    masses = rng.uniform(0.1, 0.6, 8)
    m, c = masses.sum(), masses @ points / masses.sum()
    arms = points - c
    inertia = np.einsum("n,nij->ij", masses, (arms**2).sum(1)[:, None, None] * np.eye(3))
    inertia -= np.einsum("n,ni,nj->ij", masses, arms, arms)
    place = np.zeros(3) if parent is None else rng.normal(0, 0.25, 3)
    return Segment(name, parent, place, hinges, m, c, inertia)


def hinges(name, count, rng):
    """As many turns about axes at right angles to one another, or one about any axis."""
    if count == 1:
        axis = rng.normal(size=3)
        return (Hinge(f"{name}_flexion", axis / np.sqrt(axis @ axis)),)
    return tuple(Hinge(f"{name}_{i}", np.eye(3)[i]) for i in (2, 1, 0)[:count])


def tree(branches, seed, floating=True):
    """A skeleton from (name, parent, hinges)."""
    rng = np.random.default_rng(seed)
    return Skeleton(
        tuple(segment(n, p, hinges(n, k, rng) if p else (), rng) for n, p, k in branches),
        floating=floating,
    )


def splined(n, seconds, rng, size=0.5, hz=1.2):
    """Exact coordinates (S, n) and derivatives of quintic splines through samples."""
    t = np.arange(round(seconds * RATE)) / RATE
    f = rng.uniform(0.2, hz, (5, n))
    angle = 2 * np.pi * f[:, None] * t[:, None] + rng.uniform(0, 6, (5, 1, n))
    q = size * (rng.normal(size=(5, 1, n)) * np.sin(angle)).sum(axis=0) / 2
    spline = make_interp_spline(t, q, k=5)
    return t, q, spline(t, nu=1), spline(t, nu=2)


def record(skeleton, parts, forces, torque=None, names=None):
    """A recording of several trials, one plate at the world's origin."""
    names = names or [f"motion{i}" for i in range(len(parts))]
    return MotionRecording(
        sample_rate_hz=RATE,
        trials=pd.DataFrame({"trial": np.arange(1, len(parts) + 1), "condition": names}),
        offsets=np.cumsum([0, *(len(p[0]) for p in parts)]),
        time_s=np.concatenate([p[0] for p in parts]),
        coordinates=np.concatenate([p[1] for p in parts]),
        skeleton=skeleton,
        wrenches=None if forces is None else np.concatenate(forces)[:, None],
        plate_origins_m=None if forces is None else np.zeros((1, 3)),
        torque=torque,
    )


def moving(skeleton, seed, trials=3, seconds=4.0, **how):
    """Several exact trials of a floating tree, and what moved it."""
    rng = np.random.default_rng(seed)
    n = len(skeleton.coordinates)
    parts = [splined(n, seconds, rng, **how) for _ in range(trials)]
    forces = [contact_wrench(skeleton, *p[1:]) for p in parts]
    return record(skeleton, parts, forces), parts


def impossible_segments(skeleton, phi):
    """Names of the segments that no distribution of mass could give these parameters (10 s,)."""
    smallest = np.linalg.eigvalsh(pseudo_inertias(phi))[:, 0]
    names = [s.name for s in moving_segments(skeleton)]
    return tuple(n for n, value in zip(names, smallest, strict=True) if value < 0)


SMALL = [("trunk", None, 0), ("arm", "trunk", 3), ("forearm", "arm", 1)]
ROBOT = [("stand", None, 0)] + [
    (f"link{i}", f"link{i - 1}" if i > 1 else "stand", 1) for i in range(1, 8)
]
BODY = [("pelvis", None, 0), ("thorax", "pelvis", 3), ("head", "thorax", 3)]
for _side in ("right", "left"):
    BODY += [
        (f"{_side}_{name}", parent if name in ("upper_arm", "thigh") else f"{_side}_{parent}", k)
        for name, parent, k in (
            ("upper_arm", "thorax", 3),
            ("forearm", "upper_arm", 1),
            ("hand", "forearm", 2),
            ("thigh", "pelvis", 3),
            ("shank", "thigh", 1),
            ("foot", "shank", 2),
        )
    ]


@pytest.fixture(scope="session")
def rigs():
    """What the tests build their bodies with."""
    return SimpleNamespace(
        tree=tree,
        splined=splined,
        record=record,
        moving=moving,
        contact_wrench=contact_wrench,
        impossible_segments=impossible_segments,
        inverse_dynamics=inverse_dynamics,
        SMALL=SMALL,
        ROBOT=ROBOT,
        BODY=BODY,
        RATE=RATE,
    )


@pytest.fixture(scope="session")
def small(rigs):
    """Three segments: 10 + 9 + 7 base parameters."""
    return tree(SMALL, 3)


@pytest.fixture(scope="session")
def body(rigs):
    """The body's structure with random bones and masses."""
    return tree(BODY, 1)
