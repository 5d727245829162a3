"""Regressor of a tree of segments, ``tau = Y(q, qd, qdd) phi``, and columns for joint terms.

The six rows of a floating root are expressed as a wrench: force (N) and moment (N m) about the
root's origin, in the root's own frame. The generalised forces are an invertible transformation of
these. As a wrench each row has a single unit, so weights per row are meaningful.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np
import pinocchio as pin

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.described import Meaning
from armimpedance.core.errors import InputError, check_number
from armimpedance.core.motion import WRENCH
from armimpedance.core.skeleton import Segment, Skeleton
from armimpedance.numerics.signals import filtered_sign, lowpass

#: Rows of the root's wrench.
ROOT_ROWS: Final = WRENCH
#: Least cosine of the root's second rotation; below it the three rotations lose a direction.
_LEAST_COSINE: Final = 1e-3


def root_rotation(q: FloatArray) -> FloatArray:
    """Rotation (S, 3, 3) of a floating root, columns its axes, from coordinates (S, n)."""
    (cz, cy, cx), (sz, sy, sx) = np.cos(q[:, 3:6]).T, np.sin(q[:, 3:6]).T
    R = [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
    return np.moveaxis(np.array(R), 2, 0)


def _turn_rates(q: FloatArray) -> FloatArray:
    """Matrix G (S, 3, 3): the root's angular velocity in its own frame from the rates of its
    angles.
    """
    (_, cy, cx), (_, sy, sx) = np.cos(q[:, 3:6]).T, np.sin(q[:, 3:6]).T
    zero, one = np.zeros(len(q)), np.ones(len(q))
    G = [[-sy, zero, one], [cy * sx, cx, zero], [cy * cx, -sx, zero]]
    return np.moveaxis(np.array(G), 2, 0)


def root_wrench(generalised: FloatArray, q: FloatArray) -> FloatArray:
    """Convert the root's six generalised forces (S, 6, ...) to a wrench in its own frame.

    Raises InputError: the root is pitched by 90 degrees, where its angles lose a direction.
    """
    if (np.abs(np.cos(q[:, 4])) < _LEAST_COSINE).any():
        sample = int(np.abs(np.cos(q[:, 4])).argmin())
        raise InputError(
            f"the root is pitched by 90 degrees in sample {sample} (counted from 0)",
            expected="a root frame that stays clear of it",
        )
    columns = generalised.reshape(len(q), 6, -1)
    wrench = np.empty_like(columns)
    # f (3,) in the root's frame = R^T f in the world's
    wrench[:, :3] = np.swapaxes(root_rotation(q), 1, 2) @ columns[:, :3]
    # tau (3,) = G^T (3, 3) n (3,)
    wrench[:, 3:] = np.linalg.solve(np.swapaxes(_turn_rates(q), 1, 2), columns[:, 3:])
    return wrench.reshape(generalised.shape)


def regressor(
    model: Any, q: FloatArray, qd: FloatArray, qdd: FloatArray, rows: IntArray | None = None
) -> FloatArray:
    """Regressor Y (S, R, 10 s) of a model from `limb.arm.skeleton_model`, root floating or fixed.

    `q`, `qd`, `qdd` (S, n).
    `rows` (R,) int: indices of rows; all by default. All six of a floating root, or none.
    Raises InputError: only a part of the root's rows, or a root that is pitched by 90 degrees.
    """
    n, floating = model.nv, is_floating(model)
    chosen = np.arange(n) if rows is None else np.asarray(rows, dtype=np.int64)
    roots = np.flatnonzero(chosen < 6) if floating else np.empty(0, np.int64)
    if len(roots) and not np.array_equal(chosen[:6], np.arange(6)):
        raise InputError("a part of the root's rows", expected="all six of them first, or none")
    data = model.createData()
    Y = np.empty((len(q), len(chosen), 10 * (model.njoints - 1)))
    for i in range(len(q)):
        Y[i] = pin.computeJointTorqueRegressor(model, data, q[i], qd[i], qdd[i])[chosen]
    if len(roots):
        Y[:, :6] = root_wrench(Y[:, :6], q)
    return Y


def is_floating(model: Any) -> bool:
    """True if the first joint has six coordinates: a floating root."""
    return bool(model.joints[1].nv == 6)


# Inertial parameters of segments: names, order, and the pseudo-inertia that bounds them.
#
# Ten per segment, in the frame of its joint: mass, first moments ``m c``, inertia about that
# frame's origin, in the order of Pinocchio's regressor. A fixed root has none: it does not move.

INERTIAL: Final = {
    "m": Meaning("mass", "kg"),
    **{f"m{axis}": Meaning(f"first moment along {axis}", "kg m") for axis in "xyz"},
    **{
        f"I{a}{b}": Meaning(f"{'moment' if a == b else 'product'} of inertia {a}{b}", "kg m^2")
        for a, b in ("xx", "xy", "yy", "xz", "yz", "zz")
    },
}
PARAMETERS: Final = tuple(INERTIAL)
UNITS: Final = tuple(means.unit for means in INERTIAL.values())
_PLACES: Final = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))


def moving_segments(skeleton: Skeleton) -> tuple[Segment, ...]:
    """Segments that have parameters: all, or all but a fixed root."""
    return skeleton.segments if skeleton.floating else skeleton.segments[1:]


def parameter_names(skeleton: Skeleton) -> tuple[str, ...]:
    """Names of the 10 s parameters: ``m_pelvis, mx_pelvis, ...``."""
    return tuple(f"{p}_{s.name}" for s in moving_segments(skeleton) for p in PARAMETERS)


def parameter_units(skeleton: Skeleton) -> tuple[str, ...]:
    """Units of the 10 s parameters."""
    return UNITS * len(moving_segments(skeleton))


def inertial_parameters(skeleton: Skeleton) -> FloatArray:
    """Parameters of a skeleton's masses, centres and inertias.

    Parameters
    ----------
    skeleton : Skeleton
        Skeleton with s moving segments: all, or all but a fixed root.

    Returns
    -------
    (10 s,)
        Ten per segment, kg, kg m and kg m^2.
    """
    return np.concatenate([_of(s) for s in moving_segments(skeleton)] or [np.empty(0)])


def segment_parameters(skeleton: Skeleton, phi: FloatArray) -> dict[str, dict[str, float]]:
    """Parameters (10 s, or more) as a mapping by segment and symbol."""
    segments = moving_segments(skeleton)
    rows = np.asarray(phi)[: 10 * len(segments)].reshape(len(segments), 10)
    return {
        s.name: dict(zip(PARAMETERS, row.tolist(), strict=True))
        for s, row in zip(segments, rows, strict=True)
    }


def _of(segment: Segment) -> FloatArray:
    m, c = segment.mass_kg, segment.com_m
    # I (3, 3) about the origin = I_c + m (c.c 1 - c c^T)
    inertia = segment.inertia_kgm2 + m * (c @ c * np.eye(3) - np.outer(c, c))
    return np.array([m, *(m * c), *(inertia[i, j] for i, j in _PLACES)])


def with_inertial_parameters(skeleton: Skeleton, phi: FloatArray) -> Skeleton:
    """Return the skeleton with masses, centres and inertias from parameters (10 s, or more).

    Raises InputError: a mass that is not positive, or fewer parameters.
    """
    moving = moving_segments(skeleton)
    if np.size(phi) < 10 * len(moving):
        raise InputError(f"{np.size(phi)} parameters", expected=f"10 for each of {len(moving)}")
    own = np.reshape(phi[: 10 * len(moving)], (-1, 10))
    changed = [_segment(s, p) for s, p in zip(moving, own, strict=True)]
    fixed = () if skeleton.floating else skeleton.segments[:1]
    return replace(skeleton, segments=(*fixed, *changed))


def _segment(segment: Segment, phi: FloatArray) -> Segment:
    m = float(phi[0])
    check_number(m, f"mass of {segment.name} is {m:g} kg", above=0)
    c, inertia = phi[1:4] / m, np.zeros((3, 3))
    for (i, j), value in zip(_PLACES, phi[4:], strict=True):
        inertia[i, j] = inertia[j, i] = value
    central = inertia - m * (c @ c * np.eye(3) - np.outer(c, c))
    return replace(segment, mass_kg=m, com_m=c, inertia_kgm2=central)


def pseudo_inertia_basis() -> FloatArray:
    """Symmetric matrices (10, 4, 4): a segment's pseudo-inertia is ``P = sum_i phi_i basis_i``.

    ``P = [[tr(I)/2 1 - I, m c], [m c^T, m]]`` is the second moment of the segment's mass over
    (x, y, z, 1): positive semidefinite for every distribution of mass, and only then.
    """
    basis = np.zeros((10, 4, 4))
    basis[0, 3, 3] = 1
    for k in range(3):
        basis[1 + k, k, 3] = basis[1 + k, 3, k] = 1
    for k, (i, j) in enumerate(_PLACES):
        if i == j:
            basis[4 + k, :3, :3] = np.eye(3) / 2
        basis[4 + k, i, j] -= 1
        basis[4 + k, j, i] = basis[4 + k, i, j]
    return basis


def pseudo_inertias(phi: FloatArray) -> FloatArray:
    """Pseudo-inertias (s, 4, 4) of parameters (10 s,)."""
    return np.tensordot(np.reshape(phi, (-1, 10)), pseudo_inertia_basis(), axes=1)


# Columns for joint terms: springs, dampers, friction, offsets, motors.
#
# ``tau = Y phi + sum k (q - q_r) + K (q - q_r)^2 + h qd + f sign(qd) + I qdd + c`` on the joint's
# own row; tau is the torque of motors or muscles, zero for a passive joint. The quadratic
# term is about q_r (the source prints ``K q^2``, which is even about zero).

TermKind = Literal["stiffness", "quadratic", "viscosity", "friction", "inertia", "offset"]
#: Kind of a term -> its symbol and meaning.
TERMS: Final = {
    "stiffness": ("k", Meaning("stiffness", "N m/rad")),
    "quadratic": ("K", Meaning("quadratic stiffness", "N m/rad^2")),
    "viscosity": ("h", Meaning("viscosity", "N m s/rad")),
    "friction": ("f", Meaning("dry friction", "N m")),
    "inertia": ("I", Meaning("inertia of the drive", "kg m^2")),
    "offset": ("c", Meaning("constant torque", "N m")),
}


@dataclass(frozen=True)
class JointTerm:
    """One further column of the regressor.

    `coordinate`: hinge to whose row it belongs.
    `rest_rad`: q_r, for stiffness and the quadratic term. With an additional offset it is fitted.
    """

    kind: TermKind
    coordinate: str
    rest_rad: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in TERMS:
            raise InputError(f"no joint term {self.kind!r}", expected=f"one of {', '.join(TERMS)}")

    @property
    def name(self) -> str:
        """Name such as ``k_right_elbow_flexion``."""
        return f"{TERMS[self.kind][0]}_{self.coordinate}"

    @property
    def unit(self) -> str:
        """SI unit of its parameter."""
        return TERMS[self.kind][1].unit


def passive_terms(
    coordinates: Sequence[str], rest_rad: Sequence[float], *, quadratic: bool = False
) -> tuple[JointTerm, ...]:
    """Terms ``k, h, f`` and, if requested, K of passive joints with known rest angles.

    Raises InputError: the numbers of rest angles and joints differ.
    """
    if len(coordinates) != len(rest_rad):
        raise InputError(f"{len(rest_rad)} rest angles for {len(coordinates)} joints")
    kinds: tuple[TermKind, ...] = ("stiffness", "viscosity", "friction")
    kinds += ("quadratic",) if quadratic else ()
    pairs = zip(coordinates, rest_rad, strict=True)
    return tuple(JointTerm(kind, c, rest) for c, rest in pairs for kind in kinds)


def robot_terms(
    skeleton: Skeleton,
    kinds: Sequence[TermKind] = ("viscosity", "friction", "inertia", "offset"),
) -> tuple[JointTerm, ...]:
    """Terms of the same kinds on every hinge of a robot: viscous, Coulomb, motor's inertia,
    offset."""
    hinges = [c for c in skeleton.coordinates if c not in skeleton.root_coordinates]
    return tuple(JointTerm(kind, c) for c in hinges for kind in kinds)


def term_columns(
    terms: Sequence[JointTerm],
    skeleton: Skeleton,
    raw: FloatArray,
    motion: tuple[FloatArray, FloatArray, FloatArray],
    sample_rate_hz: float,
    cutoff_hz: float | None,
) -> FloatArray:
    """Values (S, t) of the columns, each passed once through the same zero-phase filter.

    `raw` (S, n): coordinates as recorded; nonlinear functions of them are filtered afterwards.
    `motion` three (S, n): coordinates after the filter, and their derivatives.
    """
    q, qd, qdd = motion
    columns = np.empty((len(q), len(terms)))
    for i, term in enumerate(terms):
        j = skeleton.coordinate(term.coordinate)
        if term.kind == "stiffness":
            columns[:, i] = q[:, j] - term.rest_rad
        elif term.kind == "viscosity":
            columns[:, i] = qd[:, j]
        elif term.kind == "inertia":
            columns[:, i] = qdd[:, j]
        elif term.kind == "offset":
            columns[:, i] = 1.0
        elif term.kind == "friction":
            columns[:, i] = filtered_sign(qd[:, j], cutoff_hz, sample_rate_hz)
        else:
            bent = (raw[:, j] - term.rest_rad) ** 2
            columns[:, i] = lowpass(bent, cutoff_hz, sample_rate_hz, axis=0)
    return columns
