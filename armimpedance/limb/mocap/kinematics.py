"""Places of a skeleton's markers and their Jacobian, all frames at once.

N frames, P markers, n coordinates, S segments. Frames, signs and the order of the coordinates:
see `armimpedance.core.skeleton`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, IntArray
from armimpedance.core.skeleton import MarkerSite, Skeleton

_UNIT: Final = np.eye(3)
#: A floating root turns about z, then y, then x, each carried by those before.
_ROOT_AXES: Final = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))


@dataclass(frozen=True)
class Turn:
    """One angle: which coordinate it is, its axis e (3,), ``[e]x`` and ``[e]x^2`` (3, 3)."""

    coordinate: int
    axis: FloatArray
    cross: FloatArray
    cross2: FloatArray


@dataclass(frozen=True)
class MarkerTree(FrozenRecord):
    """A skeleton as its markers need it.

    Attributes
    ----------
    skeleton : Skeleton
    sites : tuple of P MarkerSite
        The markers in the order that is wanted.
    parents : tuple of S int
        -1 for the root.
    turns : tuple of S tuples of Turn
        Angles of each segment, from its parent outwards.
    segment : (P,) int
        On which segment each marker sits.
    moves : (n, P) bool
        Whether a coordinate moves a marker.
    """

    skeleton: Skeleton
    sites: Annotated[tuple[MarkerSite, ...], "P"]
    parents: Annotated[tuple[int, ...], "S"]
    turns: Annotated[tuple[tuple[Turn, ...], ...], "S"]
    segment: Annotated[IntArray, "P"]
    moves: Annotated[BoolArray, "n P"]

    @property
    def angles(self) -> BoolArray:
        """Which coordinates (n,) are hinges: all but a floating root's."""
        hinges = np.ones(len(self.skeleton.coordinates), bool)
        hinges[: len(self.skeleton.root_coordinates)] = False
        return hinges


def marker_tree(skeleton: Skeleton, names: tuple[str, ...] | None = None) -> MarkerTree:
    """The skeleton with these of its markers (all if None), in this order.

    Raises
    ------
    KeyError
        The skeleton has no such marker.
    """
    by_name = {site.name: site for site in skeleton.markers}
    sites = tuple(by_name[name] for name in names or skeleton.marker_names)
    segment = np.array([skeleton.index(site.segment) for site in sites], dtype=np.int64)
    parents = tuple(-1 if s.parent is None else skeleton.index(s.parent) for s in skeleton.segments)
    turns = _turns(skeleton)
    moves = _movers(skeleton, parents, turns)[:, segment]
    return MarkerTree(skeleton, sites, parents, turns, segment, moves)


def _turns(skeleton: Skeleton) -> tuple[tuple[Turn, ...], ...]:
    """The angles of each segment, from its parent outwards."""
    axes = [[hinge.axis for hinge in segment.hinges] for segment in skeleton.segments]
    number = count(0)
    if skeleton.floating:
        axes[0] = [np.array(axis) for axis in _ROOT_AXES]
        number = count(3)
    return tuple(tuple(_turn(next(number), axis) for axis in own) for own in axes)


def _movers(
    skeleton: Skeleton, parents: tuple[int, ...], turns: tuple[tuple[Turn, ...], ...]
) -> BoolArray:
    """Which of the coordinates move which segment, (n, S)."""
    moves = np.zeros((len(skeleton.coordinates), len(turns)), bool)
    moves[: 3 if skeleton.floating else 0] = True
    for i, (parent, own) in enumerate(zip(parents, turns, strict=True)):
        if parent >= 0:
            moves[:, i] = moves[:, parent]
        moves[[turn.coordinate for turn in own], i] = True
    return moves


def marker_places(tree: MarkerTree, q: FloatArray) -> FloatArray:
    """Places of the markers, (N, P, 3), m, at coordinates (N, n)."""
    return _move(tree, q)[0]


def marker_jacobian(tree: MarkerTree, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Places of the markers and how the coordinates move them.

    Returns
    -------
    places : (N, P, 3)
    jacobian : (N, 3, P, n)
        ``d place / d q``; a hinge's column is ``e x (p - c)``, e its axis, c its centre.
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
