"""Read the joint motion of any suitable recording, and fit its equations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
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


@dataclass(frozen=True)
class MassPrior:
    """Prior of the masses; see `body`."""

    skeleton: Skeleton | None
    sd_percent: float | None

    @property
    def sd(self) -> float:
        """Standard deviation of a mass as a fraction of it."""
        return 0.3 if self.sd_percent is None else self.sd_percent / 100


@dataclass(frozen=True)
class AskedEquations:
    """Requested rows and columns of the equations, and treatment of the motion; see `body`."""

    rows: Literal["base", "all"] | None
    cutoff_hz: float | None
    terms: Sequence[TermKind]
    passive_joints: Mapping[str, float] | None
    longest_gap_s: float | None


def fit_body(
    recording: MotionRecording | MarkerRecording | PathLike,
    equations: AskedEquations,
    prior: MassPrior,
    *,
    method: str | None,
    motions: int | Sequence[str] | None,
    noise_draws: int | None,
    what_shows: bool,
    progress: Progress | None,
) -> BodyFit:
    """Read, set up the equations and fit."""
    chosen = method or METHODS.default
    _refuse_idle(chosen, prior)
    motion, notes = _motion(recording, equations.longest_gap_s, progress)
    with naming(recording):
        choice = RowChoice.of(
            motion.skeleton,
            rows=equations.rows,
            cutoff_hz=equations.cutoff_hz,
            terms=equations.terms,
            passive_joints=equations.passive_joints,
        )
        fit = identify_body(
            motion,
            method=chosen,
            choice=choice,
            motions=motions,
            prior=prior.skeleton,
            prior_sd=prior.sd,
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


def _refuse_idle(method: str, prior: MassPrior) -> None:
    """Refuse a prior that the method does not use."""
    if METHODS.named(method).improve is None and prior.skeleton is not None:
        raise InputError(f"a prior with method {method!r}", expected="'consistent' or 'prior'")
    if prior.sd_percent is not None and method != "prior":
        raise InputError(f"a prior's sd with method {method!r}", expected="method 'prior'")
