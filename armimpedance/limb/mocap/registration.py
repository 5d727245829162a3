"""A rigid body's place from its markers: the start of every posture."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray

#: Points nearer to one line than this (second singular value, m) leave a body free to turn.
LINE_M: Final = 0.02


def rigid_motion(sites: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Rotation (3, 3) and place (3,) that carry points of a body (P, 3) onto where they were seen.

    Least squares over proper rotations (Kabsch 1976; Umeyama 1991 for the sign). None where fewer
    than three points were given or all lie on one line.
    """
    if len(sites) < 3:
        return None
    middle_site, middle_place = sites.mean(axis=0), places.mean(axis=0)
    spread = np.linalg.svd(sites - middle_site, compute_uv=False)
    if spread[1] < LINE_M:
        return None
    # C (3, 3) = sum (place - mean)(site - mean)^T = U S V^T; R = U diag(1, 1, det(U V^T)) V^T
    U, _, Vt = np.linalg.svd((places - middle_place).T @ (sites - middle_site))
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    return R, middle_place - R @ middle_site


def root_coordinates(R: FloatArray, place: FloatArray) -> FloatArray:
    """A floating root's six coordinates, place then turns about z, y, x, of ``R = Rz Ry Rx``."""
    ry = np.arcsin(np.clip(-R[2, 0], -1.0, 1.0))
    rz, rx = np.arctan2(R[1, 0], R[0, 0]), np.arctan2(R[2, 1], R[2, 2])
    return np.array([*place, rz, ry, rx])
