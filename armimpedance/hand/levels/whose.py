"""Whose arm an estimate or a model belongs to, and which of its joints move."""

from __future__ import annotations

import os
from typing import Final, Literal, cast

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from armimpedance.hand.levels.posture import kinematic_arm
from armimpedance.hand.levels.spatial_posture import spatial_arm
from armimpedance.hand.still import WRIST, elbow_told, is_wrist_free
from armimpedance.limb.arm import IN_SPACE, Arm, joints_that_move
from armimpedance.recordings import read_subject
from armimpedance.show.verbs.sources import PathLike, read_recording

#: Whose arm it is: a recording, its path, or the subject alone.
Whose = Recording | Subject | PathLike
#: Shoulder and elbow.
PLANAR: Final = (0, 1)
#: Whether the upper arm was kept from turning about its own axis.
Elbow = Literal["held", "free"]
#: Whether forearm and hand were kept from turning.
Wrist = Literal["locked", "free"]


def arm_of_whose(whose: Whose, joints: int = 2) -> Arm:
    """The arm of a recording, of the one at a path, or of a subject, with its gravity.

    Parameters
    ----------
    whose : Recording, Subject or path
    joints : int
        Two links in a plane; the four joints of an arm in space, or seven with a free wrist.

    Returns
    -------
    Arm

    Raises
    ------
    InputError
        The recording cannot be read, its subject has neither lengths nor height, gravity acts in
        other axes, or nobody knows arms of so many joints.
    """
    found = read_subject(whose) if isinstance(whose, str | os.PathLike) else whose
    subject = found if isinstance(found, Subject) else found.subject
    gravity = None if isinstance(found, Subject) else found.gravity_m_s2
    if joints in IN_SPACE:
        # one posture at a time, and no dynamics beside the weight
        return cast(Arm, spatial_arm(subject, gravity, joints))
    if joints != len(PLANAR):
        expected = "2, 4 or 7; in Python an arm of your own"
        raise InputError(f"a model of {joints} joints", expected=expected)
    return kinematic_arm(subject, gravity)


def moving_joints(joints: int, recording: Whose, elbow: Elbow | None) -> tuple[int, ...]:
    """The joints that move: without the upper arm's turning about its own axis where it is held.

    Parameters
    ----------
    joints : int
    recording : Recording, Subject or path
    elbow : {"held", "free"} or None
        None: what the recording's trials say, else free.

    Returns
    -------
    tuple of int

    Raises
    ------
    InputError
        The elbow of a planar arm is asked about.
    """
    if joints not in IN_SPACE:
        if elbow is not None:
            raise InputError(f"the elbow of an arm of {joints} joints", expected="it in space only")
        return tuple(range(joints))
    told, wrist = elbow_and_wrist_of(recording)
    return joints_that_move(joints, elbow or told or "free", wrist)


def elbow_and_wrist_of(recording: Whose | None) -> tuple[Elbow | None, Wrist | None]:
    """What the trials of a recording say of elbow and wrist: kept only where throughout."""
    if recording is None or isinstance(recording, Subject):
        return None, None
    found = recording if isinstance(recording, Recording) else read_recording(recording)
    rows = np.arange(len(found.trials))
    if WRIST not in found.trials:
        return elbow_told(found, rows), None
    return elbow_told(found, rows), "free" if is_wrist_free(found, rows) else "locked"
