"""Postures along a trial on one branch: no jump of a full turn, no other reading of three turns.

The first posture is sought from many starts. From it, postures a tenth of a second apart follow
each other forward and backward, each started from the one before; all frames between start from
the line between their neighbours, all at once.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.progress import Progress
from armimpedance.limb.mocap.kinematics import MarkerTree, marker_places
from armimpedance.limb.mocap.posture import Postures, fit_postures

# A rigid body's place from its markers: the start of every posture.

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


#: Time between two postures of the chain: a fast arm turns by less than 1.5 rad in it.
ANCHOR_S: Final = 0.1

#: Starts of a trial's first posture: the natural one and random ones about it.
_STARTS: Final = 32
_START_SPREAD_RAD: Final = 1.2
_HEADINGS: Final = 8

#: Two postures are as good as each other if their markers fit equally to this.
_SAME_FIT_M: Final = 1e-5


def track_postures(
    tree: MarkerTree,
    targets: FloatArray,
    offsets: IntArray,
    sample_rate_hz: float,
    natural: FloatArray,
    progress: Progress | None = None,
) -> Postures:
    """Postures (N, n) of all trials.

    `offsets` (T + 1,) int.
    `targets` (N, P, 3): NaN where a marker was not seen.
    `natural` (n,): the posture that holds where the markers leave freedom; of a floating root
    nothing is used.
    `progress`: called with how many frames are done, of how many.
    """
    step = max(1, round(ANCHOR_S * sample_rate_hz))
    start = np.empty((len(targets), len(natural)))
    for rows, postures in _chains(tree, targets, offsets, step, natural):
        for k in range(postures.shape[1]):
            start[rows[0] : rows[-1] + 1, k] = np.interp(
                np.arange(rows[0], rows[-1] + 1), rows, postures[:, k]
            )
    lost = _lost(targets)
    centre = _centre(tree, natural, start, lost)
    return fit_postures(tree, targets, start, centre, progress=progress)


def _lost(targets: FloatArray) -> BoolArray:
    """Frames (N,) in which a marker is lost."""
    return np.asarray(np.isnan(targets[..., 0]).any(axis=1))


def _centre(tree: MarkerTree, natural: FloatArray, near: FloatArray, lost: BoolArray) -> FloatArray:
    """What holds where the markers leave freedom: for angles the natural posture.

    For a root's coordinates, and wherever a marker is lost, it is a posture nearby.
    """
    keep = lost[:, None] | ~tree.angles
    return np.where(keep, near, natural)


def _chains(
    tree: MarkerTree, targets: FloatArray, offsets: IntArray, step: int, natural: FloatArray
) -> list[tuple[IntArray, FloatArray]]:
    """The frames of each trial's chain and their postures, for all trials at once."""
    anchors = [
        np.unique(np.append(np.arange(a, b, step), b - 1))
        for a, b in zip(offsets[:-1], offsets[1:], strict=True)
    ]
    seen = (~np.isnan(targets[..., 0])).sum(axis=1)
    first = [int(np.argmax(seen[rows])) for rows in anchors]
    frames = np.array([rows[i] for rows, i in zip(anchors, first, strict=True)])
    begin = _first_postures(tree, targets[frames], natural)
    chain = [np.empty((len(rows), len(natural))) for rows in anchors]
    for t, i in enumerate(first):
        chain[t][i] = begin[t]
    longest = max(len(rows) for rows in anchors)
    for away in range(1, longest):
        steps = [
            (t, i + s * away, i + s * (away - 1)) for t, i in enumerate(first) for s in (1, -1)
        ]
        here = [(t, i, before) for t, i, before in steps if 0 <= i < len(anchors[t])]
        if not here:
            break
        rows = np.array([anchors[t][i] for t, i, _ in here])
        start = np.array([chain[t][before] for t, _, before in here])
        lost = _lost(targets[rows])
        fitted = fit_postures(tree, targets[rows], start, _centre(tree, natural, start, lost))
        for (t, i, _), q in zip(here, fitted.q, strict=True):
            chain[t][i] = q
    return list(zip(anchors, chain, strict=True))


def _first_postures(tree: MarkerTree, targets: FloatArray, natural: FloatArray) -> FloatArray:
    """The best posture (F, n) of single frames, sought from many starts.

    Where several postures fit equally well, the one nearest to the natural posture is taken:
    three hinges have two readings of every turn.
    """
    starts = [_starts(tree, target, natural) for target in targets]
    count = len(starts[0])
    start = np.concatenate(starts)
    lost = np.zeros(len(start), bool)
    repeated = np.repeat(targets, count, axis=0)
    fitted = fit_postures(tree, repeated, start, _centre(tree, natural, start, lost))
    best = []
    for f, target in enumerate(targets):
        rows = slice(f * count, (f + 1) * count)
        q, cost = _wrapped(tree, fitted.q[rows]), fitted.cost[rows]
        slack = _SAME_FIT_M**2 * max(1, len(target))
        good = np.flatnonzero(cost <= cost.min() * 1.01 + slack)
        turned = q[good] - natural
        if tree.skeleton.floating:
            turned[:, :4] = 0.0
        best.append(q[good[np.argmin((turned**2).sum(axis=1))]])
    return np.array(best)


def _starts(tree: MarkerTree, target: FloatArray, natural: FloatArray) -> FloatArray:
    """Starts (count, n) of one frame's search; the same number for any frame."""
    rng = np.random.default_rng(0)
    spread = rng.uniform(-_START_SPREAD_RAD, _START_SPREAD_RAD, (_STARTS, len(natural)))
    spread[0] = 0.0
    starts = natural + spread * tree.angles
    if tree.skeleton.floating:
        starts[:, :6] = _root_starts(tree, target, natural)
    return starts


def _root_starts(tree: MarkerTree, target: FloatArray, natural: FloatArray) -> FloatArray:
    """Root coordinates (`_STARTS`, 6) of one frame: registered, or turned into all headings."""
    seen = ~np.isnan(target[:, 0])
    on_root = seen & (tree.segment == 0)
    sites = np.array([site.position_m for site in tree.sites])
    placed = rigid_motion(sites[on_root], target[on_root])
    if placed is not None:
        return np.tile(root_coordinates(*placed), (_STARTS, 1))
    # No three markers on the root: all markers as they lie at zero coordinates, in any heading.
    zero = natural.copy()
    zero[:6] = 0.0
    sites = marker_places(tree, zero[None])[0]
    middle = sites[seen].mean(axis=0) if seen.any() else np.zeros(3)
    place = target[seen].mean(axis=0) if seen.any() else np.zeros(3)
    roots = np.zeros((_STARTS, 6))
    for i in range(_STARTS):
        heading = 2.0 * np.pi * (i % _HEADINGS) / _HEADINGS
        c, s = np.cos(heading), np.sin(heading)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        roots[i] = root_coordinates(R, place - R @ middle)
    return roots


def _wrapped(tree: MarkerTree, q: FloatArray) -> FloatArray:
    """The same postures with every angle within half a turn of zero."""
    first = 3 if tree.skeleton.floating else 0
    wrapped = q.copy()
    wrapped[:, first:] = (q[:, first:] + np.pi) % (2.0 * np.pi) - np.pi
    return wrapped
