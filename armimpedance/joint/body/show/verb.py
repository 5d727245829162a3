"""Base parameters of a body or a robot, from its motion and what acts on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording, MotionRecording
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body.identify import identify_body
from armimpedance.joint.body.methods import METHODS
from armimpedance.joint.body.regressor import TermKind
from armimpedance.joint.body.result import BodyFit
from armimpedance.joint.body.rows import RowChoice
from armimpedance.limb.mocap import motion_of
from armimpedance.show.verbs.results import PathLike, naming, read


def body(
    recording: MotionRecording | MarkerRecording | PathLike,
    *,
    method: str | None = None,
    motions: int | Sequence[str] | None = 4,
    rows: Literal["base", "all"] | None = None,
    cutoff_hz: float | None = 6.0,
    terms: Sequence[TermKind] = (),
    passive_joints: Mapping[str, float] | None = None,
    prior: Skeleton | None = None,
    prior_sd_percent: float | None = None,
    noise_draws: int | None = None,
    what_shows: bool = False,
    longest_gap_s: float | None = None,
    progress: Progress | None = None,
) -> BodyFit:
    """Fit the combinations of masses, first moments and inertias that motion can show.

    For a body on force plates the six equations of the root alone are fitted, so that no joint
    torque is needed (Venture, poster). For a robot the torques of all joints are fitted.

    Parameters
    ----------
    recording : MotionRecording, MarkerRecording or path
        Joint motion or markers with force plates, or joint motion with the torques of a robot.
    method : {"weighted", "consistent", "ls", "prior"}, optional
        Rows weighted by their residuals (the default); every segment physically possible; plain
        least squares; possible and near the prior.
    motions : int, sequence of str, or None
        Which conditions to fit: at most so many, chosen by how they excite; these; or all. The
        others are predicted.
    rows : {"base", "all"}, optional
        The root's wrench alone (default of a body), or every joint's torque too (of a robot).
    cutoff_hz : float or None
        Cut-off of the zero-phase low-pass, Hz; None: no filter.
    terms : sequence of {"viscosity", "friction", "inertia", "offset"}
        What every joint of a robot adds.
    passive_joints : mapping of names to float, optional
        Relaxed joints and their rest angles, rad: their k, h and f are fitted too.
    prior : Skeleton, optional
        Expected masses and inertias, of the methods ``consistent`` and ``prior``; by default the
        recording's own skeleton.
    prior_sd_percent : float, optional
        Only with the method ``prior``: how far a mass may be from the expected one, %
        (default: 30).
    noise_draws : int, optional
        Draws of added noise, to take off what the angles' own noise does (default: 6; 0: none).
    what_shows : bool
        Fit what these motions show instead of refusing where they show too little.
    longest_gap_s : float, optional
        Only with markers: longest loss of a marker to bridge, s (default: 0.2).
    progress : function, optional
        Called with how much is done, of how much: frames of markers, trials, draws of noise.

    Returns
    -------
    BodyFit
        The combinations that motion can show, their standard errors and the predicted motions.

    Raises
    ------
    InputError
        The recording cannot be read or used, something is in another unit or frame, or an option
        has no effect on it.
    NotIdentifiableError
        The motions show too little; names the parameters.
    EstimationError
        The physically consistent fit does not settle, or the skeleton cannot follow the markers.

    Examples
    --------
    >>> from armimpedance.joint.body.show import body
    >>> from manipulandum_sim.body import simulate_body
    >>> recording, truth = simulate_body(("walk", "all_joints"))
    >>> person = body(recording, motions=("all_joints",), method="ls")
    >>> person.base.rank
    128
    >>> person.parameters["m_pelvis"].unit
    'kg'
    """
    chosen = method or METHODS.default
    _refuse_idle(chosen, prior, prior_sd_percent)
    motion, notes = _motion(recording, longest_gap_s, progress)
    with naming(recording):
        choice = RowChoice.of(
            motion.skeleton,
            rows=rows,
            cutoff_hz=cutoff_hz,
            terms=terms,
            passive_joints=passive_joints,
        )
        fit = identify_body(
            motion,
            method=chosen,
            choice=choice,
            motions=motions,
            prior=prior,
            prior_sd=0.3 if prior_sd_percent is None else prior_sd_percent / 100,
            data_dependent=what_shows,
            noise_draws=noise_draws,
            progress=progress,
        )
    return replace(fit, notes=notes)


def _motion(
    source: MotionRecording | MarkerRecording | PathLike,
    longest_gap_s: float | None,
    progress: Progress | None,
) -> tuple[MotionRecording, tuple[str, ...]]:
    """The joint motion and notes on it; markers without force plates are refused."""
    recording = read(source)
    with naming(source):
        if isinstance(recording, Recording):
            raise InputError(
                f"a recording of kind {recording.kind!r}", expected="kind 'markers' or 'motion'"
            )
        return motion_of(recording, longest_gap_s=longest_gap_s, forces=True, progress=progress)


def _refuse_idle(method: str, prior: Skeleton | None, prior_sd_percent: float | None) -> None:
    """Refuse an unknown method, and a prior that it does not use."""
    if METHODS.named(method).improve is None and prior is not None:
        raise InputError(f"a prior with method {method!r}", expected="'consistent' or 'prior'")
    if prior_sd_percent is None:
        return
    if method != "prior":
        raise InputError(f"a prior's sd with method {method!r}", expected="method 'prior'")
    if not 0 < prior_sd_percent < float("inf"):
        raise InputError(f"a prior's sd of {prior_sd_percent:g} %", expected="more than 0")
