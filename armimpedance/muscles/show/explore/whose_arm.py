"""Whose arm the page shows: a recording's, a stated one, or the one that results betray."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Subject
from armimpedance.hand.levels import kinematic_arm
from armimpedance.limb.arm import TwoLinkArm
from armimpedance.recordings import read_subject

#: Lengths whose hand is this far from where it was measured, m, are not those of the rows.
_APART_M = 0.01
#: Angles whose two directions are nearer to each other do not tell the segments apart.
_WORST_CONDITION = 100.0


@dataclass(frozen=True)
class Owner:
    """Whose arm it is: what `to_joint` asks a recording for, without its samples.

    Attributes
    ----------
    subject : Subject
    said : str
        Where its lengths come from, in words.
    muscles : tuple of str or None
    gravity_m_s2 : tuple of float or None
    """

    subject: Subject
    said: str = ""
    muscles: tuple[str, ...] | None = None
    gravity_m_s2: tuple[float, ...] | None = None

    @property
    def arm(self) -> TwoLinkArm:
        """The two-link arm, with its gravity."""
        return kinematic_arm(self.subject, self.gravity_m_s2)


def lengths_of(rows: Sequence[ImpedanceEstimate]) -> tuple[float, float] | None:
    """Upper arm and forearm with hand, m, from measured hand positions and joint angles.

    Parameters
    ----------
    rows : sequence of ImpedanceEstimate

    Returns
    -------
    (float, float) or None
        None where too little is said, or no lengths put the hand where it was measured.
    """
    known = [
        (row.joint_angles, row.position - row.shoulder_m)
        for row in rows
        if row.joint_angles is not None
        and len(row.joint_angles) == 2
        and row.position is not None
        and row.shoulder_m is not None
        and len(row.position) == 2
    ]
    if not known:
        return None
    q, hand = (np.array(column) for column in zip(*known, strict=True))
    angles = np.stack([q[:, 0], q.sum(axis=1)], axis=-1)
    # X (P, 2) = [cos qs, cos (qs + qe); sin qs, sin (qs + qe)] (P, 2, 2) l (2,)
    A = np.stack([np.cos(angles), np.sin(angles)], axis=1).reshape(-1, 2)
    lengths, _, rank, singular = np.linalg.lstsq(A, hand.ravel(), rcond=None)
    apart = np.abs(A @ lengths - hand.ravel()).max()
    if (
        rank < 2
        or singular[0] > _WORST_CONDITION * singular[1]
        or apart > _APART_M
        or lengths.min() <= 0
    ):
        return None
    return float(lengths[0]), float(lengths[1])


def owner_of(
    rows: Sequence[ImpedanceEstimate],
    recording: str | os.PathLike[str] | Subject | Owner | None,
    upper_arm_m: float | None,
    forearm_hand_m: float | None,
) -> Owner:
    """Whose arm it is: of the recording, with stated lengths, else as the rows tell.

    Parameters
    ----------
    rows : sequence of ImpedanceEstimate
    recording : path, Subject, Owner or None
    upper_arm_m, forearm_hand_m : float or None

    Raises
    ------
    InputError
        The recording cannot be read, or the lengths are not known.
    """
    owner = _recorded(recording)
    who = owner.subject
    if upper_arm_m is not None or forearm_hand_m is not None:
        who = _with_lengths(who, upper_arm_m, forearm_hand_m)
        owner = replace(owner, subject=who, said="as stated")
    if who.height_m is not None or None not in (who.upper_arm_m, who.forearm_hand_m):
        return owner
    lengths = lengths_of(rows)
    if lengths is None:
        raise InputError(
            "the arm's lengths are not known",
            expected="--recording SESSION, or --upper-arm-m and --forearm-hand-m",
        )
    found = _with_lengths(
        replace(who, upper_arm_m=lengths[0], forearm_hand_m=lengths[1]),
        who.upper_arm_m,
        who.forearm_hand_m,
    )
    return replace(owner, subject=found, said="found from hand positions and joint angles")


def _recorded(recording: str | os.PathLike[str] | Subject | Owner | None) -> Owner:
    if isinstance(recording, Owner):
        return recording
    if recording is None:
        return Owner(Subject())
    if isinstance(recording, Subject):
        return Owner(recording, "those of the subject")
    found = read_subject(recording)
    said = "those of the recording's subject"
    return Owner(found.subject, said, found.muscles, found.gravity_m_s2)


def _with_lengths(who: Subject, upper_arm_m: float | None, forearm_hand_m: float | None) -> Subject:
    """The subject with each of these lengths that is given."""
    upper = who.upper_arm_m if upper_arm_m is None else upper_arm_m
    forearm = who.forearm_hand_m if forearm_hand_m is None else forearm_hand_m
    return replace(who, upper_arm_m=upper, forearm_hand_m=forearm)
