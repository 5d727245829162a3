"""Rows of the identification model, ``w = Y phi + terms``, and the wrench of force plates.

All signals pass the same zero-phase filter once: the coordinates before they are differentiated,
the wrenches in the world's frame (where a weight at rest is constant) before they are moved to
the root, the torques, and the nonlinear joint terms.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
import pinocchio as pin

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError, check_number
from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body.regressor import (
    ROOT_ROWS,
    JointTerm,
    TermKind,
    parameter_names,
    parameter_units,
    passive_terms,
    regressor,
    robot_terms,
    root_rotation,
    root_wrench,
    term_columns,
)
from armimpedance.limb.arm import skeleton_model
from armimpedance.numerics.signals import lowpass, smoothed_derivatives

# Forces of force plates on a skeleton: a wrench on its root, and torques at its joints.
#
# Wrenches are by each plate on the body, in the world's frame, about the plate's origin. Moved to
# the root they add up, for any assignment of segments to plates: ``sum_k K_k^T F_k``. Only the
# plates beyond a joint act on it, so its row depends on the segment that stands on each plate.

#: Load below which a plate is empty, N.
LEAST_LOAD_N: Final = 20.0
#: The second nearest segment must be farther from the centre of pressure by this factor.
_CLEARLY: Final = 1.5


def about_world_origin(wrenches: FloatArray, plate_origins_m: FloatArray) -> FloatArray:
    """Wrenches (S, K, 6) with the moments about the world's origin instead of the plates'
    origins."""
    moved = np.array(wrenches)
    moved[..., 3:] += np.cross(plate_origins_m, wrenches[..., :3])
    return moved


def wrench_on_root(world: FloatArray, q: FloatArray) -> FloatArray:
    """Wrench (S, 6) about the root's origin in the root's frame, from wrenches (S, K, 6).

    ``sum_k K_k^T F_k``: wrenches transform by the transpose of the motion's transformation.
    """
    total = world.sum(axis=1)
    moment = total[:, 3:] - np.cross(q[:, :3], total[:, :3])
    pair = np.stack([total[:, :3], moment], axis=1)
    # [f; n] (2, 3) in the root's frame = [f; n] R (3, 3)
    return (pair @ root_rotation(q)).reshape(len(q), 6)


def contact_torques(
    model: Any, skeleton: Skeleton, world: FloatArray, q: FloatArray, standing: Sequence[str]
) -> FloatArray:
    """Generalised forces ``sum_k J_k^T F_k`` (S, n) of wrenches (S, K, 6) about the world's origin.

    `standing`: name of the segment on each plate.
    """
    data, result = model.createData(), np.zeros(q.shape)
    felt = np.array([_carriers(skeleton, name) for name in standing], dtype=float)
    for i in range(len(q)):
        # tau (n,) = J^T (n, 6) F (6,), both about the world's origin
        J = pin.computeJointJacobians(model, data, q[i])
        result[i] = ((world[i] @ J) * felt).sum(axis=0)
    return result


def _carriers(skeleton: Skeleton, segment: str) -> list[bool]:
    """Mask of the coordinates (n,) that move this segment."""
    above: set[str] = set()
    name: str | None = segment
    while name is not None:
        above.add(name)
        name = skeleton.segments[skeleton.index(name)].parent
    hinges = [s.name in above for s in skeleton.segments for _ in s.hinges]
    return [True] * len(skeleton.root_coordinates) + hinges


def standing_segments(
    recording: MotionRecording, model: Any, samples: slice, world: FloatArray
) -> tuple[str, ...]:
    """For each plate, the limb's end segment nearest to its centre of pressure.

    Only samples of a trial with a load on the plate are used.

    Raises InputError: two segments are about equally near, so the segments must be stated.
    """
    skeleton = recording.skeleton
    parents = {s.parent for s in skeleton.segments}
    ends = [s.name for s in skeleton.segments if s.name not in parents]
    q = recording.coordinates[samples]
    places = _segment_origins(model, q, np.array([model.getJointId(n) for n in ends]))
    standing = []
    for k in range(world.shape[1]):
        loaded = world[:, k, 2] > LEAST_LOAD_N
        if not loaded.any():
            standing.append(ends[0])
            continue
        f = world[loaded, k]
        cop = np.stack([-f[:, 4] / f[:, 2], f[:, 3] / f[:, 2]], axis=1)
        away = np.linalg.norm(places[loaded, :, :2] - cop[:, None], axis=2)
        lowest = np.abs(places[loaded, :, 2])
        total = np.hypot(away, lowest).mean(axis=0)
        first, *others = np.argsort(total)
        if others and total[others[0]] < _CLEARLY * total[first]:
            raise InputError(
                f"plate {k + 1}: {ends[first]} and {ends[others[0]]} are about equally near",
                expected="to be told which segment stands on each plate",
            )
        standing.append(ends[first])
    return tuple(standing)


def _segment_origins(model: Any, q: FloatArray, joints: IntArray) -> FloatArray:
    """World positions (S, J, 3) of joints."""
    data, places = model.createData(), np.empty((len(q), len(joints), 3))
    for i in range(len(q)):
        pin.forwardKinematics(model, data, q[i])
        for at, joint in enumerate(joints):
            places[i, at] = data.oMi[int(joint)].translation
    return places


#: Largest rest angle of a joint, rad; angles in degrees exceed it.
_LARGEST_REST: Final = 6.3


@dataclass(frozen=True)
class RowChoice:
    """Choice of rows and columns, and the filter of the signals.

    Attributes
    ----------
    rows : {"base", "all"}
        The root's wrench, or every coordinate (requires measured torque; the only choice for a
        fixed root).
    cutoff_hz : float or None
        Cut-off of the zero-phase low-pass; None for exact data.
    trim_s : float or None
        Length left out at both ends of a trial, where filter and spline are one-sided. None: one
        period of the cut-off, nothing without a filter.
    terms : tuple of JointTerm
    passive_joints : tuple of str
        Hinges without motor or active muscle; their rows, of zero torque, are added to the root's.
    standing : tuple of str or None
        Segment on each plate, for rows of joints; None: from the centre of pressure.
    """

    rows: Literal["base", "all"] = "base"
    cutoff_hz: float | None = None
    trim_s: float | None = None
    terms: tuple[JointTerm, ...] = ()
    passive_joints: tuple[str, ...] = ()
    standing: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        if self.rows not in ("base", "all"):
            raise InputError(f"no rows {self.rows!r}", expected="'base' or 'all'")
        if self.trim_s is not None:
            check_number(self.trim_s, f"{self.trim_s} s left out at the ends", low=0)

    @classmethod
    def of(
        cls,
        skeleton: Skeleton,
        *,
        rows: Literal["base", "all"] | None = None,
        cutoff_hz: float | None = 6.0,
        terms: Sequence[TermKind] = (),
        passive_joints: Mapping[str, float] | None = None,
    ) -> RowChoice:
        """Choose rows and columns for a skeleton, by default those of a body or of a robot.

        Parameters
        ----------
        skeleton : Skeleton
        rows : {"base", "all"}, optional
            Default: the root's wrench for a floating root, all rows for a fixed one.
        cutoff_hz : float or None
        terms : sequence of {"viscosity", "friction", "inertia", "offset"}
            Terms of every hinge of a robot.
        passive_joints : mapping of names to rad, optional
            Relaxed hinges and their rest angles; k, h and f of each are columns.

        Returns
        -------
        RowChoice

        Raises
        ------
        InputError
            An unknown joint or term, a rest angle in degrees, or terms whose rows are not used.
        """
        joints = dict(passive_joints or {})
        hinges = skeleton.coordinates[len(skeleton.root_coordinates) :]
        for name, rest in joints.items():
            if name not in hinges:
                raise InputError(f"no joint {name!r}", expected=f"one of {', '.join(hinges)}")
            if not abs(rest) <= _LARGEST_REST:
                raise InputError(
                    f"a rest angle of {rest:g} of {name} looks like degrees", expected="radians"
                )
        if terms and joints:
            raise InputError("a robot's terms beside passive joints", expected="one of the two")
        chosen = rows or ("base" if skeleton.floating else "all")
        if terms and chosen == "base":
            raise InputError(
                "terms of joints with the rows of the root, which no joint's torque enters",
                expected="rows 'all', of a recording with measured torque",
            )
        columns = passive_terms(tuple(joints), tuple(joints.values())) + robot_terms(
            skeleton, terms
        )
        return cls(chosen, cutoff_hz, terms=columns, passive_joints=tuple(joints))

    def indices(self, skeleton: Skeleton) -> IntArray:
        """Indices of the coordinates whose rows are used.

        Raises
        ------
        InputError
            A term on a row that is not used, or rows of a fixed root.
        """
        everything = np.arange(len(skeleton.coordinates))
        joints = [skeleton.coordinate(name) for name in self.passive_joints]
        if self.rows == "base":
            if not skeleton.floating:
                raise InputError("rows of the root, which is fixed", expected="rows 'all'")
            everything = np.array([*range(6), *sorted(set(joints) - set(range(6)))])
        for term in self.terms:
            if skeleton.coordinate(term.coordinate) not in everything:
                raise InputError(
                    f"{term.name}: the row of {term.coordinate} is not used",
                    expected="a passive joint, or rows 'all'",
                )
        return everything

    def kept(self, samples: int, rate_hz: float) -> slice:
        """Samples of a trial that are not left out at its ends.

        Raises
        ------
        InputError
            No samples remain.
        """
        trim_s = self.trim_s
        if trim_s is None:
            trim_s = 0.0 if self.cutoff_hz is None else 1 / self.cutoff_hz
        cut = round(trim_s * rate_hz)
        if samples <= 2 * cut:
            raise InputError(
                f"{samples} samples", expected=f"more than {2 * cut}, left out at the ends"
            )
        return slice(cut, samples - cut)

    def row_names(self, skeleton: Skeleton) -> tuple[str, ...]:
        """Names of the rows: ``fx ... mz`` for the root's wrench, then the coordinates' names."""
        names = [skeleton.coordinates[j] for j in self.indices(skeleton)]
        return tuple(ROOT_ROWS + tuple(names[6:]) if skeleton.floating else names)

    def row_units(self, skeleton: Skeleton) -> tuple[str, ...]:
        """Units of the rows, N or N m."""
        return tuple("N" if n in ROOT_ROWS[:3] else "N m" for n in self.row_names(skeleton))

    def column_names(self, skeleton: Skeleton) -> tuple[str, ...]:
        """Names of the columns: inertial parameters, then the joint terms."""
        return parameter_names(skeleton) + tuple(t.name for t in self.terms)

    def column_units(self, skeleton: Skeleton) -> tuple[str, ...]:
        """SI units of the columns."""
        return parameter_units(skeleton) + tuple(t.unit for t in self.terms)


@dataclass(frozen=True)
class TrialRows:
    """Rows of one trial: S samples, R rows each, p columns.

    `W` (S, R, p), `w` (S, R).
    """

    condition: str
    W: FloatArray
    w: FloatArray


def each_trial(recording: MotionRecording, choice: RowChoice) -> Iterator[TrialRows]:
    """Yield the rows of one trial after another; only one trial is in memory at a time.

    Parameters
    ----------
    recording : MotionRecording
    choice : RowChoice

    Yields
    ------
    TrialRows

    Raises
    ------
    InputError
        Plates or torque are missing, a trial is too short, the cut-off is out of range, or the
        segment on a plate is not clear.
    """
    check_measured(recording, choice)
    model = skeleton_model(recording.skeleton)
    for row, condition in enumerate(recording.trials["condition"]):
        try:
            yield _trial(recording, choice, model, row, str(condition))
        except InputError as error:
            number = int(recording.trials["trial"].iloc[row])
            raise InputError(f"trial {number} ({condition}): {error}") from error


def check_measured(recording: MotionRecording, choice: RowChoice) -> None:
    """Refuse a recording without the measurements that the rows need."""
    skeleton = recording.skeleton
    if skeleton.floating and recording.wrenches is None and recording.torque is None:
        raise InputError(
            "no force plates in the recording", expected="the wrenches of all contacts"
        )
    if choice.rows == "all" and recording.torque is None:
        raise InputError("no torque in the recording", expected="measured torque for rows 'all'")
    plates = 0 if recording.wrenches is None else recording.wrenches.shape[1]
    if choice.standing is not None and len(choice.standing) != plates:
        raise InputError(f"{len(choice.standing)} segments for {plates} plates")


def _trial(
    recording: MotionRecording, choice: RowChoice, model: Any, row: int, condition: str
) -> TrialRows:
    skeleton, rate = recording.skeleton, recording.sample_rate_hz
    samples = recording.samples_of(row)
    raw = recording.coordinates[samples]
    motion = smoothed_derivatives(raw, rate, choice.cutoff_hz)
    keep = choice.kept(len(raw), rate)
    rows = choice.indices(skeleton)
    q, qd, qdd = (m[keep] for m in motion)
    Y = regressor(model, q, qd, qdd, rows)
    W = np.zeros((*Y.shape[:2], Y.shape[2] + len(choice.terms)))
    W[:, :, : Y.shape[2]] = Y
    columns = term_columns(choice.terms, skeleton, raw, motion, rate, choice.cutoff_hz)[keep]
    for i, term in enumerate(choice.terms):
        at = int(np.flatnonzero(rows == skeleton.coordinate(term.coordinate))[0])
        W[:, at, Y.shape[2] + i] = columns[:, i]
    return TrialRows(condition, W, _left_side(recording, choice, model, samples, motion[0])[keep])


def _left_side(
    recording: MotionRecording, choice: RowChoice, model: Any, samples: slice, q: FloatArray
) -> FloatArray:
    """Left side w (S, R): torques of motors and muscles, and the plates' forces on root and
    joints."""
    skeleton, rows = recording.skeleton, choice.indices(recording.skeleton)
    rate, torque = recording.sample_rate_hz, np.zeros(q.shape)
    if recording.torque is not None:
        torque += lowpass(recording.torque[samples], choice.cutoff_hz, rate, axis=0)
        torque[:, [skeleton.coordinate(name) for name in choice.passive_joints]] = 0.0
        if skeleton.floating:
            torque[:, :6] = root_wrench(torque[:, :6], q)
    if recording.wrenches is not None and recording.plate_origins_m is not None:
        world = about_world_origin(recording.wrenches[samples], recording.plate_origins_m)
        smooth = lowpass(world, choice.cutoff_hz, rate, axis=0)
        if skeleton.floating:
            torque[:, :6] += wrench_on_root(smooth, q)
        joints = rows[rows >= len(skeleton.root_coordinates)]
        if len(joints):
            standing = choice.standing or standing_segments(recording, model, samples, world)
            felt = contact_torques(model, skeleton, smooth, q, standing)
            torque[:, joints] += felt[:, joints]
    return torque[:, rows]
