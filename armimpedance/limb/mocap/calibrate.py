"""Where the markers sit on a subject, from a trial in which the subject stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.core.skeleton import MarkerSite, Skeleton
from armimpedance.limb.mocap.kinematics import marker_places, marker_tree

#: Somebody who stands sways by a few mm; a marker that moves more (rms) shows a movement.
LARGEST_SWAY_M: Final = 0.02


def calibrate_sites(
    skeleton: Skeleton,
    standing: MarkerRecording,
    *,
    segments: Mapping[str, str] | None = None,
) -> Skeleton:
    """The skeleton with the markers where this subject wears them.

    The subject stands upright at zero coordinates (arms hanging, palms to the thighs), in any
    place and heading: both come from the sites that the skeleton has already, by least squares.
    Only how a marker lies to its own segment is taken from the trial; lengths stay.

    Parameters
    ----------
    skeleton : Skeleton
        Skeleton with a first guess of two or more sites, for example from a model.
    standing : MarkerRecording
        Recording of a second or more; the mean over the frames that show a marker counts.
    segments : mapping str -> str, optional
        On which segment a marker sits that the skeleton does not know.

    Returns
    -------
    Skeleton

    Raises
    ------
    InputError
        A marker moves, is never seen or sits on no known segment; fewer than two have a first
        guess, or those lie above each other.
    """
    place = _mean_places(standing)
    new = dict(segments or {})
    for name in new:
        skeleton.index(new[name])
        if name not in place:
            raise InputError(f"no marker {name} in the trial", expected=", ".join(place))
    known = [n for n in skeleton.marker_names if n in place]
    c, s, root = _upright_place(skeleton, known, place)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    on = {site.name: site.segment for site in skeleton.markers if site.name in place} | new
    origins = _origins(skeleton)
    # R^T (p - p_root) is the marker in the root's frame; all frames are parallel at zero
    sites = tuple(
        MarkerSite(name, segment, turn.T @ (place[name] - root) - origins[segment])
        for name, segment in on.items()
    )
    return replace(skeleton, markers=sites)


def _mean_places(standing: MarkerRecording) -> dict[str, FloatArray]:
    """Mean place of every marker that is ever seen."""
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
    seen = np.array([place[name] for name in known])
    if not skeleton.floating:
        return 1.0, 0.0, np.zeros(3)
    a, b = (model - model.mean(axis=0))[:, :2], (seen - seen.mean(axis=0))[:, :2]
    # the turn about z that carries a onto b: tan = sum (a x b) / sum (a . b)
    sine, cosine = float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a * b).sum())
    size = np.hypot(sine, cosine)
    if size < 1e-4:
        raise InputError("the markers do not show a heading", expected="some beside each other")
    c, s = cosine / size, sine / size
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return c, s, seen.mean(axis=0) - turn @ model.mean(axis=0)


def _origins(skeleton: Skeleton) -> dict[str, FloatArray]:
    """Joint centres in the root's frame at zero coordinates."""
    origins: dict[str, FloatArray] = {}
    for segment in skeleton.segments:
        above = np.zeros(3) if segment.parent is None else origins[segment.parent]
        origins[segment.name] = above + segment.origin_m
    return origins
