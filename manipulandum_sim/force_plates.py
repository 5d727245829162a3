"""Two force plates side by side under two feet: who carries what of the whole contact wrench."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.skeleton import Skeleton
from manipulandum_sim.tree_dynamics import SegmentMotion

#: Origins (m) of the right foot's and the left foot's plate, at their centres on the floor; they
#: meet at the x axis.
PLATE_ORIGINS_M: Final = np.array([[0.0, -0.4, 0.0], [0.0, 0.4, 0.0]])


def foot_wrenches(
    whole: FloatArray, left_share: FloatArray, supports: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Wrenches of the floor on the right and on the left foot; their sum is the whole.

    Both feet share the force in all directions alike, and the free moment about the vertical. The
    line between the feet's centres of pressure is that between their soles' centres, set off by as
    much as the whole's centre of pressure is: where the body is in balance both lie in their soles.

    Parameters
    ----------
    whole : (N, 6)
        Force and moment about the world's origin by the floor on the body.
    left_share : (N,)
        0 to 1; a foot whose share is 0 carries nothing.
    supports : (N, 2, 3)
        Centres of the right and the left sole, m.

    Returns
    -------
    wrenches : (N, 2, 6)
        About the world's origin.
    pressure : (N, 2, 2)
        The feet's centres of pressure, m; NaN where a foot carries nothing.
    """
    force = whole[:, :3]
    centre = np.zeros_like(force)
    centre[:, :2] = np.column_stack([-whole[:, 4], whole[:, 3]]) / whole[:, 2:3]
    free = whole[:, 5] - (centre[:, 0] * force[:, 1] - centre[:, 1] * force[:, 0])
    share = np.column_stack([1 - left_share, left_share])[..., None]
    apart = supports[:, 1] - supports[:, 0]
    # c_r = c - l d, c_l = c + (1 - l) d, so that (1 - l) c_r + l c_l = c
    places = centre[:, None] + (1 - share) * np.stack([-apart, apart], axis=1)
    wrenches = np.zeros((len(whole), 2, 6))
    wrenches[..., :3] = share * force[:, None]
    wrenches[..., 3:] = np.cross(places, wrenches[..., :3])
    wrenches[..., 5] += share[..., 0] * free[:, None]
    pressure = np.where(share > 0, places[..., :2], np.nan)
    return wrenches, pressure


def about(wrenches: FloatArray, origins_m: FloatArray) -> FloatArray:
    """Wrenches (N, K, 6) about the world's origin, moments taken about `origins_m` (K, 3)."""
    moved = wrenches.copy()
    # m' = m - o x f
    moved[..., 3:] -= np.cross(np.broadcast_to(origins_m, moved[..., :3].shape), moved[..., :3])
    return moved


def support_torques(skeleton: Skeleton, motion: SegmentMotion, wrenches: FloatArray) -> FloatArray:
    """Generalised forces of the feet's wrenches: ``sum_k J_k^T w_k`` (N, n).

    Parameters
    ----------
    skeleton : Skeleton
        With a floating root and the segments ``right_foot`` and ``left_foot``.
    motion : SegmentMotion
    wrenches : (N, 2, 6)
        By the floor on the right and the left foot, about the world's origin.
    """
    owners = [i for i, s in enumerate(skeleton.segments) for _ in (s.hinges or range(3))]
    torques = np.zeros((len(wrenches), 3 + len(owners)))
    for k, side in enumerate(("right", "left")):
        force, moment = wrenches[:, k, :3], wrenches[:, k, 3:]
        carriers = _ancestors(skeleton, f"{side}_foot")
        torques[:, :3] += force
        for j, (owner, axis) in enumerate(zip(owners, motion.axes, strict=True)):
            if owner in carriers:
                # e (N, 3) . (m - p x f) (N, 3), the moment about the joint's centre
                here = moment - np.cross(motion.origin[owner], force)
                torques[:, 3 + j] += (axis * here).sum(axis=1)
    return torques


def _ancestors(skeleton: Skeleton, segment: str) -> set[int]:
    ancestors: set[int] = set()
    name: str | None = segment
    while name is not None:
        i = skeleton.index(name)
        ancestors.add(i)
        name = skeleton.segments[i].parent
    return ancestors
