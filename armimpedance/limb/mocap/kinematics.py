"""Places of a skeleton's markers and their Jacobian, all frames at once.

N frames, P markers, n coordinates, S segments. Frames, signs and the order of the coordinates:
see `armimpedance.core.skeleton`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import count
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.core.skeleton import MarkerSite, Skeleton

_UNIT: Final = np.eye(3)
#: Axes of a floating root's turns: z, then y, then x, each carried by the turns before.
_ROOT_AXES: Final = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))


@dataclass(frozen=True)
class Turn:
    """One angle: index of its coordinate, axis e (3,), ``[e]x`` and ``[e]x^2`` (3, 3)."""

    coordinate: int
    axis: FloatArray
    cross: FloatArray
    cross2: FloatArray


@dataclass(frozen=True)
class MarkerTree(FrozenRecord):
    """A skeleton prepared for the places of its markers.

    `sites`: the markers in the requested order.
    `parents`: -1 for the root.
    `turns`: angles of each segment, from its parent outwards.
    `segment` (P,) int: index of the segment of each marker.
    `moves` (n, P) bool: True if the coordinate moves the marker.
    """

    skeleton: Skeleton
    sites: Annotated[tuple[MarkerSite, ...], "P"]
    parents: Annotated[tuple[int, ...], "S"]
    turns: Annotated[tuple[tuple[Turn, ...], ...], "S"]
    segment: Annotated[IntArray, "P"]
    moves: Annotated[BoolArray, "n P"]

    @property
    def angles(self) -> BoolArray:
        """True for coordinates (n,) that are hinges, False for those of a floating root."""
        hinges = np.ones(len(self.skeleton.coordinates), bool)
        hinges[: len(self.skeleton.root_coordinates)] = False
        return hinges


def marker_tree(skeleton: Skeleton, names: tuple[str, ...] | None = None) -> MarkerTree:
    """Prepare a skeleton with the named markers (all if None), in this order.

    Raises KeyError: the skeleton has no such marker.
    """
    by_name = {site.name: site for site in skeleton.markers}
    sites = tuple(by_name[name] for name in names or skeleton.marker_names)
    segment = np.array([skeleton.index(site.segment) for site in sites], dtype=np.int64)
    parents = tuple(-1 if s.parent is None else skeleton.index(s.parent) for s in skeleton.segments)
    turns = _turns(skeleton)
    moves = _movers(skeleton, parents, turns)[:, segment]
    return MarkerTree(skeleton, sites, parents, turns, segment, moves)


def _turns(skeleton: Skeleton) -> tuple[tuple[Turn, ...], ...]:
    """Angles of each segment, from its parent outwards."""
    axes = [[hinge.axis for hinge in segment.hinges] for segment in skeleton.segments]
    number = count(0)
    if skeleton.floating:
        axes[0] = [np.array(axis) for axis in _ROOT_AXES]
        number = count(3)
    return tuple(tuple(_turn(next(number), axis) for axis in hinge_axes) for hinge_axes in axes)


def _movers(
    skeleton: Skeleton, parents: tuple[int, ...], turns: tuple[tuple[Turn, ...], ...]
) -> BoolArray:
    """True where a coordinate moves a segment, (n, S)."""
    moves = np.zeros((len(skeleton.coordinates), len(turns)), bool)
    moves[: 3 if skeleton.floating else 0] = True
    for i, (parent, own_turns) in enumerate(zip(parents, turns, strict=True)):
        if parent >= 0:
            moves[:, i] = moves[:, parent]
        moves[[turn.coordinate for turn in own_turns], i] = True
    return moves


def marker_places(tree: MarkerTree, q: FloatArray) -> FloatArray:
    """Places of the markers, (N, P, 3), m, at coordinates (N, n)."""
    return _move(tree, q)[0]


def marker_jacobian(tree: MarkerTree, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Places of the markers and their derivatives by the coordinates.

    Returns: `places` (N, P, 3).
    `jacobian` (N, 3, P, n): ``d place / d q``; a hinge's column is ``e x (p - c)``, e its axis, c
    its centre.
    """
    places, axes, centres = _move(tree, q)
    floating = tree.skeleton.floating
    first = 3 if floating else 0
    jacobian = np.zeros((len(q), 3, len(tree.sites), q.shape[1]))
    if floating:
        for k in range(3):
            jacobian[:, k, :, k] = 1.0
    a = axes[:, None, first:]  # (N, 1, n', 3)
    arm = places[:, :, None] - centres[:, None, first:]  # (N, P, n', 3)
    turning = jacobian[..., first:]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        turning[:, k] = a[..., i] * arm[..., j] - a[..., j] * arm[..., i]
    turning *= tree.moves[first:].T
    return places, jacobian


def _turn(coordinate: int, axis: FloatArray) -> Turn:
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return Turn(coordinate, axis, cross, cross @ cross)


def _move(tree: MarkerTree, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places of the markers (N, P, 3); axes and centres of the turning coordinates (N, n, 3)."""
    skeleton, frames = tree.skeleton, len(q)
    sine, versine = np.sin(q)[..., None, None], (1.0 - np.cos(q))[..., None, None]
    rotations: list[FloatArray] = []
    origins: list[FloatArray] = []
    axes, centres = np.zeros((2, frames, q.shape[1], 3))
    for body, up, turns in zip(skeleton.segments, tree.parents, tree.turns, strict=True):
        if up < 0:
            rotation = np.broadcast_to(np.eye(3), (frames, 3, 3))
            origin = q[:, :3] if skeleton.floating else np.zeros((frames, 3))
        else:
            rotation, origin = rotations[up], origins[up] + rotations[up] @ body.origin_m
        for turn in turns:
            j = turn.coordinate
            axes[:, j], centres[:, j] = rotation @ turn.axis, origin
            # R = 1 + sin [e]x + (1 - cos) [e]x^2 (Rodrigues)
            rotation = rotation @ (_UNIT + sine[:, j] * turn.cross + versine[:, j] * turn.cross2)
        rotations.append(rotation)
        origins.append(origin)
    places = np.empty((frames, len(tree.sites), 3))
    for m, site in enumerate(tree.sites):
        i = tree.segment[m]
        places[:, m] = origins[i] + rotations[i] @ site.position_m
    return places, axes, centres


# Sites of the markers on a subject, from a trial in which the subject stands.

#: Largest rms motion of a marker in standing, where a person sways by a few mm.
LARGEST_SWAY_M: Final = 0.02


def calibrate_sites(
    skeleton: Skeleton,
    standing: MarkerRecording,
    *,
    segments: Mapping[str, str] | None = None,
) -> Skeleton:
    """Calibrate the sites of the markers on the skeleton for this subject.

    The subject stands upright at zero coordinates (arms hanging, palms to the thighs), in any place
    and heading; both are estimated from the skeleton's present sites by least squares. Only the
    sites of markers in their segments are taken from the trial; lengths do not change.

    Parameters
    ----------
    skeleton : Skeleton
        Skeleton with a first guess of two or more sites, for example from a model.
    standing : MarkerRecording
        Recording of a second or more; places are averaged over the frames that show a marker.
    segments : mapping str -> str, optional
        Segments of markers that are not on the skeleton.

    Returns
    -------
    Skeleton

    Raises
    ------
    InputError
        A marker moves, is never seen or is on an unknown segment; fewer than two have a first
        guess, or those are vertically above each other.
    """
    place = _mean_places(standing)
    stated = dict(segments or {})
    for name in stated:
        skeleton.index(stated[name])
        if name not in place:
            raise InputError(f"no marker {name} in the trial", expected=", ".join(place))
    guessed = [n for n in skeleton.marker_names if n in place]
    c, s, root = _upright_place(skeleton, guessed, place)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    segment_of = {
        site.name: site.segment for site in skeleton.markers if site.name in place
    } | stated
    origins = _origins(skeleton)
    # R^T (p - p_root) is the marker in the root's frame; all frames are parallel at zero
    sites = tuple(
        MarkerSite(name, segment, turn.T @ (place[name] - root) - origins[segment])
        for name, segment in segment_of.items()
    )
    return replace(skeleton, markers=sites)


def _mean_places(standing: MarkerRecording) -> dict[str, FloatArray]:
    """Mean place of every marker that is seen in the trial, by its name."""
    places = {}
    for m, name in enumerate(standing.names):
        path = standing.positions[:, m]
        path = path[~np.isnan(path[:, 0])]
        if not len(path):
            continue
        places[name] = path.mean(axis=0)
        sway = float(np.sqrt(((path - places[name]) ** 2).sum(axis=1).mean()))
        if sway > LARGEST_SWAY_M:
            raise InputError(
                f"marker {name} moves by {1e3 * sway:.0f} mm (rms) in the standing trial",
                expected=f"at most {1e3 * LARGEST_SWAY_M:g} mm",
            )
    return places


def _upright_place(
    skeleton: Skeleton, known: list[str], place: dict[str, FloatArray]
) -> tuple[float, float, FloatArray]:
    """Cosine and sine of the heading, and the root's place (3,), by least squares."""
    if len(known) < 2:
        expected = "two or more of " + (", ".join(skeleton.marker_names) or "the skeleton's sites")
        raise InputError(f"{len(known)} markers with a first guess", expected=expected)
    tree = marker_tree(skeleton, tuple(known))
    model = marker_places(tree, np.zeros((1, len(skeleton.coordinates))))[0]
    measured = np.array([place[name] for name in known])
    if not skeleton.floating:
        return 1.0, 0.0, np.zeros(3)
    a, b = (model - model.mean(axis=0))[:, :2], (measured - measured.mean(axis=0))[:, :2]
    # the turn about z that carries a onto b: tan = sum (a x b) / sum (a . b)
    sine, cosine = float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a * b).sum())
    size = np.hypot(sine, cosine)
    if size < 1e-4:
        raise InputError("the markers do not show a heading", expected="some beside each other")
    c, s = cosine / size, sine / size
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return c, s, measured.mean(axis=0) - turn @ model.mean(axis=0)


def _origins(skeleton: Skeleton) -> dict[str, FloatArray]:
    """Joint centres in the root's frame at zero coordinates."""
    origins: dict[str, FloatArray] = {}
    for segment in skeleton.segments:
        above = np.zeros(3) if segment.parent is None else origins[segment.parent]
        origins[segment.name] = above + segment.origin_m
    return origins
