"""Inertial parameters of segments: names, order, and the pseudo-inertia that bounds them.

Ten per segment, in the frame in which its joint starts: mass, first moments ``m c``, inertia about
that frame's origin, in the order of Pinocchio's regressor. A fixed root has none: it never moves.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import Segment, Skeleton

PARAMETERS: Final = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
UNITS: Final = ("kg", *("kg m",) * 3, *("kg m^2",) * 6)
_PLACES: Final = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))


def moving_segments(skeleton: Skeleton) -> tuple[Segment, ...]:
    """The segments that have parameters: all, or all but a fixed root."""
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
        s segments move: all, or all but a fixed root.

    Returns
    -------
    (10 s,)
        Ten per segment, kg, kg m and kg m^2.
    """
    return np.concatenate([_of(s) for s in moving_segments(skeleton)] or [np.empty(0)])


def segment_parameters(skeleton: Skeleton, phi: FloatArray) -> dict[str, dict[str, float]]:
    """Parameters (10 s, or more) by segment and symbol."""
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
    """The skeleton with masses, centres and inertias from parameters (10 s, or more).

    Raises
    ------
    InputError
        A mass that is not positive, or fewer parameters.
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
    if not m > 0:
        raise InputError(f"mass of {segment.name} is {m:g} kg", expected="more than 0")
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
