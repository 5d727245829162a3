"""Postures along a trial without jumps: of a full turn, or to another solution of three hinges.

The first posture is searched from many starts. From it, postures a tenth of a second apart are
fitted forward and backward, each started from the previous one. All frames in between are then
fitted at once, started by linear interpolation.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.progress import Progress
from armimpedance.limb.mocap.kinematics import MarkerTree, marker_places
from armimpedance.limb.mocap.posture import Postures, fit_postures

# Motion of a rigid body from its markers: the start of every posture.

#: Points nearer to a line than this (second singular value, m) do not determine a rotation.
LINE_M: Final = 0.02


def rigid_motion(sites: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Rotation (3, 3) and translation (3,) from points of a body (P, 3) to their measured places.

    Least squares over proper rotations (Kabsch 1976; Umeyama 1991 for the sign). None for fewer
    than three points, or if all lie on a line.
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


def root_coordinates(R: FloatArray, position: FloatArray) -> FloatArray:
    """Six coordinates of a floating root: place, then turns about z, y, x of ``R = Rz Ry Rx``."""
    ry = np.arcsin(np.clip(-R[2, 0], -1.0, 1.0))
    rz, rx = np.arctan2(R[1, 0], R[0, 0]), np.arctan2(R[2, 1], R[2, 2])
    return np.array([*position, rz, ry, rx])


#: Time between two postures of the chain, s; a fast arm turns by less than 1.5 rad in it.
ANCHOR_S: Final = 0.1

#: Number of starts of a trial's first posture: the natural posture and random ones about it.
_STARTS: Final = 32
_START_SPREAD_RAD: Final = 1.2
_HEADINGS: Final = 8

#: Two postures fit equally well if the distances of their markers differ by less than this.
_SAME_FIT_M: Final = 1e-5


def track_postures(
    tree: MarkerTree,
    targets: FloatArray,
    offsets: IntArray,
    sample_rate_hz: float,
    natural: FloatArray,
    progress: Progress | None = None,
) -> Postures:
    """Fit the postures (N, n) of all trials.

    `offsets` (T + 1,) int.
    `targets` (N, P, 3): NaN where a marker was not seen.
    `natural` (n,): the posture for directions that the markers do not determine; its coordinates of
    a floating root are not used.
    `progress`: called with the number of frames done and their total.
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
    """True for frames (N,) in which a marker is lost."""
    return np.asarray(np.isnan(targets[..., 0]).any(axis=1))


def _centre(tree: MarkerTree, natural: FloatArray, near: FloatArray, lost: BoolArray) -> FloatArray:
    """Posture towards which undetermined directions are pulled: for angles the natural posture.

    For a root's coordinates, and in frames with lost markers, it is the nearby posture.
    """
    keep = lost[:, None] | ~tree.angles
    return np.where(keep, near, natural)


def _chains(
    tree: MarkerTree, targets: FloatArray, offsets: IntArray, step: int, natural: FloatArray
) -> list[tuple[IntArray, FloatArray]]:
    """Frames of each trial's chain and their postures; all trials are fitted together."""
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
        present = [(t, i, before) for t, i, before in steps if 0 <= i < len(anchors[t])]
        if not present:
            break
        rows = np.array([anchors[t][i] for t, i, _ in present])
        start = np.array([chain[t][before] for t, _, before in present])
        lost = _lost(targets[rows])
        fitted = fit_postures(tree, targets[rows], start, _centre(tree, natural, start, lost))
        for (t, i, _), q in zip(present, fitted.q, strict=True):
            chain[t][i] = q
    return list(zip(anchors, chain, strict=True))


def _first_postures(tree: MarkerTree, targets: FloatArray, natural: FloatArray) -> FloatArray:
    """Fit the posture (F, n) of single frames from many starts.

    Of several postures that fit equally well, the one nearest to the natural posture is chosen:
    three hinges can make every rotation in two ways.
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
        deviation = q[good] - natural
        if tree.skeleton.floating:
            deviation[:, :4] = 0.0
        best.append(q[good[np.argmin((deviation**2).sum(axis=1))]])
    return np.array(best)


def _starts(tree: MarkerTree, target: FloatArray, natural: FloatArray) -> FloatArray:
    """Starts (count, n) of the search of one frame; their number is the same for all frames."""
    rng = np.random.default_rng(0)
    spread = rng.uniform(-_START_SPREAD_RAD, _START_SPREAD_RAD, (_STARTS, len(natural)))
    spread[0] = 0.0
    starts = natural + spread * tree.angles
    if tree.skeleton.floating:
        starts[:, :6] = _root_starts(tree, target, natural)
    return starts


def _root_starts(tree: MarkerTree, target: FloatArray, natural: FloatArray) -> FloatArray:
    """Root coordinates (`_STARTS`, 6) of one frame: from its markers, or in several headings."""
    seen = ~np.isnan(target[:, 0])
    on_root = seen & (tree.segment == 0)
    sites = np.array([site.position_m for site in tree.sites])
    placed = rigid_motion(sites[on_root], target[on_root])
    if placed is not None:
        return np.tile(root_coordinates(*placed), (_STARTS, 1))
    # fewer than three markers on the root: all markers at zero coordinates, in several headings
    zero = natural.copy()
    zero[:6] = 0.0
    sites = marker_places(tree, zero[None])[0]
    middle = sites[seen].mean(axis=0) if seen.any() else np.zeros(3)
    position = target[seen].mean(axis=0) if seen.any() else np.zeros(3)
    roots = np.zeros((_STARTS, 6))
    for i in range(_STARTS):
        heading = 2.0 * np.pi * (i % _HEADINGS) / _HEADINGS
        c, s = np.cos(heading), np.sin(heading)
        R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        roots[i] = root_coordinates(R, position - R @ middle)
    return roots


def _wrapped(tree: MarkerTree, q: FloatArray) -> FloatArray:
    """Return the postures with every angle within half a turn of zero."""
    first = 3 if tree.skeleton.floating else 0
    wrapped = q.copy()
    wrapped[:, first:] = (q[:, first:] + np.pi) % (2.0 * np.pi) - np.pi
    return wrapped
