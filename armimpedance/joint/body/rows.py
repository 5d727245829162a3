"""Rows of the identification model, one trial at a time: ``w = Y phi + terms``.

Everything goes through one zero-phase filter once: the coordinates before they are differentiated,
the wrenches in the world's frame (where a weight at rest is a constant) before they are moved to
the root, the torques, and the joint terms that are not linear.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body.contacts import (
    about_world_origin,
    contact_torques,
    standing_segments,
    wrench_on_root,
)
from armimpedance.joint.body.joint_terms import (
    JointTerm,
    TermKind,
    passive_terms,
    robot_terms,
    term_columns,
)
from armimpedance.joint.body.parameters import parameter_names, parameter_units
from armimpedance.joint.body.regressor import ROOT_ROWS, regressor, root_wrench
from armimpedance.limb.arm import skeleton_model
from armimpedance.numerics.signals import lowpass, smoothed_derivatives

#: No joint rests further from zero, rad; degrees do.
_LARGEST_REST: Final = 6.3


@dataclass(frozen=True)
class RowChoice:
    """Which rows and columns, and how the signals are smoothed.

    Attributes
    ----------
    rows : {"base", "all"}
        The root's wrench, or every coordinate (needs measured torque, and a fixed root has no
        other rows).
    cutoff_hz : float or None
        Cut-off of the zero-phase low-pass; None for exact data.
    trim_s : float or None
        Left out at both ends of a trial, where the filter and the spline see one side only. None:
        one period of the cut-off, nothing without a filter.
    terms : tuple of JointTerm
    passive_joints : tuple of str
        Hinges without motor or muscle, whose rows join the root's: their torque is zero.
    standing : tuple of str or None
        The segment on each plate, for rows of joints; None: from the centre of pressure.
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
        if self.trim_s is not None and not self.trim_s >= 0:
            raise InputError(f"{self.trim_s} s left out at the ends", expected="0 or more")

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
        """Rows and columns for a skeleton, by default those of a body or of a robot.

        Parameters
        ----------
        skeleton : Skeleton
        rows : {"base", "all"}, optional
            Default: the root's wrench of a floating root, all rows of a fixed one.
        cutoff_hz : float or None
        terms : sequence of {"viscosity", "friction", "inertia", "offset"}
            What every hinge of a robot adds.
        passive_joints : mapping of names to rad, optional
            Relaxed hinges and their rest angles; k, h and f of each are columns.

        Returns
        -------
        RowChoice

        Raises
        ------
        InputError
            No such joint or term, a rest angle in degrees, or terms whose rows are not used.
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
        """The coordinates whose rows are used.

        Raises
        ------
        InputError
            A term on a row that is not used, or rows of a root that is fixed.
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
        """The samples of a trial that are not left out at its ends.

        Raises
        ------
        InputError
            None are left.
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
        """``fx ... mz`` for the root's wrench, then the coordinates' names."""
        names = [skeleton.coordinates[j] for j in self.indices(skeleton)]
        return tuple(ROOT_ROWS + tuple(names[6:]) if skeleton.floating else names)

    def row_units(self, skeleton: Skeleton) -> tuple[str, ...]:
        """N or N m."""
        return tuple("N" if n in ROOT_ROWS[:3] else "N m" for n in self.row_names(skeleton))

    def column_names(self, skeleton: Skeleton) -> tuple[str, ...]:
        """Inertial parameters, then the joint terms."""
        return parameter_names(skeleton) + tuple(t.name for t in self.terms)

    def column_units(self, skeleton: Skeleton) -> tuple[str, ...]:
        """SI."""
        return parameter_units(skeleton) + tuple(t.unit for t in self.terms)


@dataclass(frozen=True)
class TrialRows:
    """Rows of one trial: S samples, R rows each, p columns.

    Attributes
    ----------
    condition : str
    W : (S, R, p)
    w : (S, R)
    """

    condition: str
    W: FloatArray
    w: FloatArray


def each_trial(recording: MotionRecording, choice: RowChoice) -> Iterator[TrialRows]:
    """The rows of trial after trial; only one is held at a time.

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
        Plates or torque are missing, a trial is too short, the cut-off is out of range, or it is
        not clear which segment stands on a plate.
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
    """Raise InputError if what the rows need was not measured."""
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
    """w (S, R): torques of motors and muscles, and what the plates do to root and joints."""
    skeleton, rows = recording.skeleton, choice.indices(recording.skeleton)
    rate, left = recording.sample_rate_hz, np.zeros(q.shape)
    if recording.torque is not None:
        left += lowpass(recording.torque[samples], choice.cutoff_hz, rate, axis=0)
        left[:, [skeleton.coordinate(name) for name in choice.passive_joints]] = 0.0
        if skeleton.floating:
            left[:, :6] = root_wrench(left[:, :6], q)
    if recording.wrenches is not None and recording.plate_origins_m is not None:
        world = about_world_origin(recording.wrenches[samples], recording.plate_origins_m)
        smooth = lowpass(world, choice.cutoff_hz, rate, axis=0)
        if skeleton.floating:
            left[:, :6] += wrench_on_root(smooth, q)
        joints = rows[rows >= len(skeleton.root_coordinates)]
        if len(joints):
            standing = choice.standing or standing_segments(recording, model, samples, world)
            felt = contact_torques(model, skeleton, smooth, q, standing)
            left[:, joints] += felt[:, joints]
    return left[:, rows]
