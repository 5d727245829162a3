"""A simulated body on force plates, from twelve motions to its base parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MotionRecording
from armimpedance.joint.body import (
    BodyEquations,
    BodyFit,
    BodyValidation,
    MotionChoice,
    RowChoice,
    body_equations,
    choose_motions,
    essential_base_parameters,
    identify_body,
    motion_conditions,
)
from manipulandum_sim.body import ALL, simulate_body

#: Low-pass of both sides of the equation, Hz. White noise of 2 mrad on the angles, differentiated
#: twice, makes moments of 5 N m at the analysis's usual 6 Hz and of 1 N m at 3 Hz; motions this
#: slow lose next to nothing of their own.
CUTOFF_HZ: Final = 3.0
ANGLE_NOISE_RAD: Final = 0.002
#: The motion in which everything moves at once: no one does it naturally.
UNNATURAL: Final = "all_joints"
#: Motions that the body does; fewer in tests.
MOTIONS = ALL


@dataclass(frozen=True)
class StudiedBody:
    """What the poster's figures are drawn from.

    Attributes
    ----------
    recording : MotionRecording
    rows : RowChoice
    equations : BodyEquations
    weighted, prior : BodyFit
        Weighted least squares, and physically consistent with a prior of 30 %; both from the
        greedily chosen motions.
    natural : MotionChoice
        Greedy choice without `UNNATURAL`; counts among the other motions.
    exact_alone : (T,)
        Condition of every motion alone without noise on the angles: only a simulation knows it.
    true_phi : (p,)
        The simulated body's parameters.
    """

    recording: MotionRecording
    rows: RowChoice
    equations: BodyEquations
    weighted: BodyFit
    prior: BodyFit
    natural: MotionChoice
    exact_alone: FloatArray
    true_phi: FloatArray

    def agreement(self, phi: FloatArray, motions: tuple[str, ...]) -> BodyValidation:
        """How well parameters predict some motions."""
        rows = [self.equations.motions.index(motion) for motion in motions]
        return self.equations.subset(rows).validate(phi)

    def median_error_percent(self, fit: BodyFit) -> float:
        """Median of the base parameters' errors against the truth, % of each."""
        true = fit.base.mapping @ self.true_phi
        return float(100 * np.median(np.abs(fit.parameters.values / true - 1)))


def study(experiment: str, *, subject: str, seed: int, sets: int) -> StudiedBody:
    """All motions of a simulated body; `sets`, of the hand's tests, plays no part.

    Raises
    ------
    InputError
        An unknown experiment or subject.
    """
    del sets
    if experiment != "body":
        raise InputError(f"no experiment {experiment!r}", expected="body")
    recording, truth = simulate_body(
        MOTIONS, subject=subject, seed=seed, angle_noise_rad=ANGLE_NOISE_RAD
    )
    rows = RowChoice(cutoff_hz=CUTOFF_HZ)
    equations = body_equations(recording, rows)
    base = essential_base_parameters(recording.skeleton, rows)
    exact = body_equations(replace(recording, coordinates=truth.q), rows)
    others = [t for t, motion in enumerate(equations.motions) if motion != UNNATURAL]
    return StudiedBody(
        recording,
        rows,
        equations,
        identify_body(recording, method="weighted", choice=rows, motions=len(MOTIONS)),
        identify_body(recording, method="prior", choice=rows, motions=len(MOTIONS)),
        choose_motions(equations.subset(others), base, most=len(others)),
        motion_conditions(exact, base),
        truth.parameters.ravel(),
    )


def design(studied: StudiedBody) -> str:
    """The sentence about the data that every caption holds."""
    recording = studied.recording
    return (
        f"Simulated subject {recording.subject.id}: 15 segments, 36 coordinates, "
        f"{studied.weighted.base.rank} base parameters (as many as the poster's), "
        f"{recording.sample_rate_hz:g} samples/s, noise of {1e3 * ANGLE_NOISE_RAD:g} mrad on the "
        "angles and 1 N, 0.5 N m on each of two force plates"
    )
