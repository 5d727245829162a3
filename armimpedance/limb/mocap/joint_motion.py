"""Joint angles from markers: `joint_motion`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import EstimationError, InputError, check_number
from armimpedance.core.motion import MarkerRecording, MotionRecording
from armimpedance.core.progress import Progress
from armimpedance.core.skeleton import Skeleton
from armimpedance.limb.mocap.kinematics import MarkerTree, marker_places, marker_tree
from armimpedance.limb.mocap.posture import BRIDGE_M, Postures, bridge, fit_postures, short_frames
from armimpedance.limb.mocap.track import track_postures

#: Largest lean of the root; beyond it the heading is not defined (its turns are about z, y, x).
_STEEPEST_RAD: Final = np.deg2rad(80.0)

_BLOCK_FRAMES: Final = 4096


@dataclass(frozen=True, repr=False, eq=False)
class MarkerFit(FrozenRecord):
    """Joint motion, and the fit of the skeleton to the markers.

    `names`: the markers that were used.
    `residual_rms_m` (P,): rms distance of each marker from the skeleton's, over the frames in which
    it was seen.
    `bridged` (N,) bool: frames in which the remaining markers do not determine the posture; the
    undetermined coordinates are interpolated by a spline.
    `free` (n,): share of each coordinate that the natural posture determines, mean of all frames.
    `steps` (N,) int: number of iterations of each frame.
    """

    motion: MotionRecording
    names: Annotated[tuple[str, ...], "P"]
    residual_rms_m: Annotated[FloatArray, "P"]
    bridged: Annotated[BoolArray, "N"]
    free: Annotated[FloatArray, "n"]
    steps: Annotated[IntArray, "N"]
    warnings: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on the fit of the skeleton to the markers, and the warnings."""
        worst = int(self.residual_rms_m.argmax())
        fit = (
            f"skeleton follows {len(self.names)} markers; {self.names[worst]} worst, "
            f"{1e3 * self.residual_rms_m[worst]:.1f} mm rms"
        )
        return (fit, *self.warnings)

    def __repr__(self) -> str:
        return "\n".join(self.notes[:12])


def joint_motion(
    markers: MarkerRecording,
    skeleton: Skeleton | None = None,
    *,
    longest_gap_s: float = 0.2,
    largest_residual_m: float = 0.03,
    natural: Mapping[str, float] | None = None,
    progress: Progress | None = None,
) -> MarkerFit:
    """Fit the joint motion of the skeleton to the markers of each frame, by least squares.

    A lost marker is not filled in: the other markers of the frame determine the posture.
    Coordinates that they do not determine are interpolated by a spline through the trial's other
    frames, for at most `longest_gap_s`. At a trial's ends the nearest posture is repeated, for half
    as long.

    Parameters
    ----------
    markers : MarkerRecording
    skeleton : Skeleton, optional
        Skeleton with the markers' sites; default: the recording's own. Markers without a site
        and sites without a marker are not used; the provenance names them.
    longest_gap_s : float
    largest_residual_m : float
        A trial with a marker further (rms) from the skeleton's is refused.
    natural : mapping str -> float, optional
        Angles (rad) of the posture for coordinates that the markers do not determine; default: 0.
    progress : function, optional
        Called with the number of frames done and their total.

    Returns
    -------
    MarkerFit

    Raises
    ------
    InputError
        No skeleton, no marker of it, an unknown angle, or a gap that is too long.
    EstimationError
        The skeleton cannot follow the markers.
    """
    skeleton = skeleton or markers.skeleton
    if skeleton is None:
        raise InputError("no skeleton with the markers", expected="skeleton.json, or a skeleton")
    names = _known(markers, skeleton)
    tree = marker_tree(skeleton, names)
    targets = markers.positions[:, [markers.names.index(n) for n in names]]
    rest = _natural_posture(skeleton, natural or {})
    rate = markers.sample_rate_hz
    tracked = track_postures(tree, targets, markers.offsets, rate, rest, progress)
    short = short_frames(tree, tracked.q, targets)
    postures = _bridged(tree, targets, tracked, short, markers, longest_gap_s)
    q = _without_jumps(tree, postures.q, markers.offsets)
    distance = _distances(tree, q, targets)
    _check_fit(postures, distance, names, markers, largest_residual_m)
    motion = MotionRecording(
        sample_rate_hz=markers.sample_rate_hz,
        trials=markers.trials,
        offsets=markers.offsets,
        time_s=markers.time_s,
        coordinates=q,
        skeleton=skeleton,
        wrenches=markers.wrenches,
        plate_origins_m=markers.plate_origins_m,
        emg=markers.emg,
        subject=markers.subject,
        provenance=(*markers.provenance, *_remarks(markers, skeleton, names, short)),
    )
    warnings = _warnings(skeleton, q, postures, short)
    free = postures.free.mean(axis=0)
    return MarkerFit(motion, names, _rms(distance), short, free, postures.steps, warnings)


def _known(markers: MarkerRecording, skeleton: Skeleton) -> tuple[str, ...]:
    """Markers for which the skeleton has a site."""
    names = tuple(n for n in markers.names if n in skeleton.marker_names)
    if not names:
        known = ", ".join(skeleton.marker_names) or "none"
        expected = f"some of {known}"
        raise InputError("no marker that the skeleton has a site for", expected=expected)
    return names


def _natural_posture(skeleton: Skeleton, angles: Mapping[str, float]) -> FloatArray:
    rest = np.zeros(len(skeleton.coordinates))
    for name, angle in angles.items():
        rest[skeleton.coordinate(name)] = angle
    return rest


def _bridged(
    tree: MarkerTree,
    targets: FloatArray,
    tracked: Postures,
    short: BoolArray,
    markers: MarkerRecording,
    longest_gap_s: float,
) -> Postures:
    """Fit underdetermined frames again, with the spline that bridges them as natural posture."""
    if not short.any():
        return tracked
    names = tuple(site.name for site in tree.sites)
    near = bridge(tracked.q, short, markers, names, targets, longest_gap_s)[short]
    refitted = fit_postures(tree, targets[short], near, near, pull_m=BRIDGE_M)
    merged = {}
    for name in ("q", "cost", "free", "steps", "settled", "converged"):
        values = getattr(tracked, name).copy()
        values[short] = getattr(refitted, name)
        merged[name] = values
    return Postures(**merged)


def _without_jumps(tree: MarkerTree, q: FloatArray, offsets: IntArray) -> FloatArray:
    first = 3 if tree.skeleton.floating else 0
    smooth = q.copy()
    for a, b in zip(offsets[:-1], offsets[1:], strict=True):
        smooth[a:b, first:] = np.unwrap(q[a:b, first:], axis=0)
    return smooth


def _distances(tree: MarkerTree, q: FloatArray, targets: FloatArray) -> FloatArray:
    """Distance (N, P) of each marker from the skeleton's marker, m; NaN where it was not seen."""
    distance = np.empty(targets.shape[:2])
    for i in range(0, len(q), _BLOCK_FRAMES):
        rows = slice(i, i + _BLOCK_FRAMES)
        away = targets[rows] - marker_places(tree, q[rows])
        distance[rows] = np.sqrt((away * away).sum(axis=2))
    return distance


def _rms(distance: FloatArray) -> FloatArray:
    """Rms (P,) over the frames that show a marker; 0 for a marker that is never seen."""
    seen = np.isfinite(distance).sum(axis=0)
    return np.asarray(np.sqrt(np.nansum(distance**2, axis=0) / np.maximum(seen, 1)))


def _check_fit(
    postures: Postures,
    distance: FloatArray,
    names: tuple[str, ...],
    markers: MarkerRecording,
    largest_residual_m: float,
) -> None:
    numbers = markers.trials["trial"].tolist()
    rms = np.array([_rms(distance[markers.samples_of(t)]) for t in range(len(numbers))])
    if rms.max() > largest_residual_m:
        t, worst = (int(i) for i in np.unravel_index(int(np.argmax(rms)), rms.shape))
        raise EstimationError(
            f"trial {numbers[t]}: marker {names[worst]} lies {1e3 * rms[t, worst]:.0f} mm (rms) "
            f"from the skeleton's, at most {1e3 * largest_residual_m:g} mm allowed: swapped "
            "labels, another body's skeleton, or lengths that are not m"
        )
    failed = np.flatnonzero(~postures.converged)
    if len(failed):
        t = int(np.searchsorted(markers.offsets, failed[0], side="right")) - 1
        raise EstimationError(
            f"trial {numbers[t]}: no posture found at {markers.time_s[failed[0]]:.3f} s and in "
            f"{len(failed) - 1} further frames"
        )


def _remarks(
    markers: MarkerRecording, skeleton: Skeleton, names: tuple[str, ...], short: BoolArray
) -> list[str]:
    remarks = [f"Joint angles by least squares from {len(names)} markers."]
    unused = [n for n in markers.names if n not in names]
    absent = [n for n in skeleton.marker_names if n not in names]
    if unused:
        remarks.append(f"Markers without a site on the skeleton: {', '.join(unused)}.")
    if absent:
        remarks.append(f"Sites without a marker in the recording: {', '.join(absent)}.")
    if short.any():
        remarks.append(f"Lost markers bridged in {int(short.sum())} of {len(short)} frames.")
    return remarks


def _warnings(
    skeleton: Skeleton, q: FloatArray, postures: Postures, short: BoolArray
) -> tuple[str, ...]:
    warnings = []
    share = (postures.free[~short] > 0.5).mean(axis=0)
    for name, part in zip(skeleton.coordinates, share, strict=True):
        if part > 0.01:
            percent = f"{100 * part:.0f} %"
            warnings.append(f"the markers do not determine {name} in {percent} of the frames")
    if skeleton.floating and (np.abs(q[:, 4]) > _STEEPEST_RAD).any():
        root = skeleton.segments[0].name
        warnings.append(f"{root} leans by more than 80 degrees: its turns cannot be told apart")
    unsettled = int((~postures.settled).sum())
    if unsettled:
        warnings.append(f"{unsettled} frames are pulled a little towards the natural posture")
    return tuple(warnings)


# Joint motion of a recording of a moving body, or from its markers.

#: Default of the longest loss of a marker that is bridged, s.
_USUAL_GAP_S = 0.2


def motion_of(
    recording: MarkerRecording | MotionRecording,
    *,
    longest_gap_s: float | None = None,
    forces: bool = False,
    progress: Progress | None = None,
) -> tuple[MotionRecording, tuple[str, ...]]:
    """Return the joint motion of a recording, and notes on how it was estimated.

    Parameters
    ----------
    recording : MarkerRecording or MotionRecording
    longest_gap_s : float, optional
        Longest loss of markers to bridge, s (default: 0.2).
    forces : bool
        Refuse a recording without force plates, before its markers are fitted.
    progress : function, optional
        Called with the number of frames done and their total.

    Returns
    -------
    MotionRecording, tuple of str

    Raises
    ------
    InputError
        A gap that is not positive or has nothing to bridge, no force plates, or markers that do not
        determine the motion.
    EstimationError
        The skeleton cannot follow the markers.
    """
    gap = _USUAL_GAP_S if longest_gap_s is None else longest_gap_s
    check_number(gap, f"gaps of {gap:g} s to bridge", above=0, high=np.inf, unit="s")
    if isinstance(recording, MotionRecording):
        if longest_gap_s is not None:
            raise InputError("gaps to bridge in joint motion", expected="a recording of markers")
        return recording, ()
    if forces and recording.wrenches is None:
        raise InputError("markers without force plates", expected="the forces of all contacts")
    fit = joint_motion(recording, longest_gap_s=gap, progress=progress)
    return fit.motion, fit.notes
