"""Joint motion of a recording of a moving body, from its markers where it holds those."""

from __future__ import annotations

from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording, MotionRecording
from armimpedance.core.progress import Progress
from armimpedance.limb.mocap.joint_motion import joint_motion

#: Longest loss of a marker that is bridged where nothing else is said, s.
_USUAL_GAP_S = 0.2


def motion_of(
    recording: MarkerRecording | MotionRecording,
    *,
    longest_gap_s: float | None = None,
    forces: bool = False,
    progress: Progress | None = None,
) -> tuple[MotionRecording, tuple[str, ...]]:
    """The joint motion, and what a reader must know of how it was found.

    Parameters
    ----------
    recording : MarkerRecording or MotionRecording
    longest_gap_s : float, optional
        Longest loss of markers to bridge, s (default: 0.2).
    forces : bool
        Refuse a recording without force plates before its markers are followed.
    progress : function, optional
        Called with how many frames are done, of how many.

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
    if not gap > 0:
        raise InputError(f"gaps of {gap:g} s to bridge", expected="more than 0 s")
    if isinstance(recording, MotionRecording):
        if longest_gap_s is not None:
            raise InputError("gaps to bridge in joint motion", expected="a recording of markers")
        return recording, ()
    if forces and recording.wrenches is None:
        raise InputError("markers without force plates", expected="the forces of all contacts")
    followed = joint_motion(recording, longest_gap_s=gap, progress=progress)
    return followed.motion, followed.notes
