"""Inertia, viscosity and stiffness of a moving hand, phase by phase."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armimpedance.core.conventions import Level
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.hand.reaching.fitted import Method, PhaseFit, to_estimate
from armimpedance.hand.reaching.methods import METHODS
from armimpedance.hand.reaching.session import Session, session_of


def identify_movement(
    recording: Recording,
    *,
    method: str | None = None,
    level: Level = "hand",
    inertia: Sequence[ImpedanceEstimate] | None = None,
    phases: Sequence[str] | None = None,
    window_s: float | None = None,
    progress: Progress | None = None,
) -> list[ImpedanceEstimate]:
    """M, B and K of a reaching hand at every phase of every condition.

    Parameters
    ----------
    recording : Recording
        Reaches in a plane; the trial table says in ``phase``, ``push_deg`` and ``push_onset_s``
        which ones were pushed.
    method : str, optional
        A name of `METHODS`; default: ``latent``.
    level : {"hand", "joint"}
    inertia : sequence of ImpedanceEstimate, optional
        The hand's M of the same person in postures; default: inertia is fitted with the rest.
    phases : sequence of str, optional
        Only these.
    window_s : float, optional
        Length of the fitted window after a push's onset.
    progress : function (done, all), optional

    Returns
    -------
    list of ImpedanceEstimate
        With keys ``condition`` and ``phase``; phases in the order of their onset.

    Raises
    ------
    InputError
        The recording lacks something (see `course`, `pushes`, `windows`), or a name is unknown.
    NotIdentifiableError
        The pushes of a phase do not tell M, B and K apart.
    EstimationError
        M comes out negative.
    """
    chosen = METHODS.named(method)
    _check_level(method or METHODS.default, chosen, level)
    session = session_of(recording, inertia, phases)
    _check_throughout(method or METHODS.default, chosen, session)
    made = []
    for phase in session.phases(window_s, progress):
        for name, windows in phase.windows:
            fit = chosen.fit(windows, level, session.known)
            check_inertia(fit, phase.name)
            keys = {"condition": phase.condition, "phase": name}
            made.append(to_estimate(fit, windows, method or METHODS.default, keys))
    return made


def _check_level(name: str, method: Method, level: Level) -> None:
    if level not in method.levels:
        raise InputError(
            f"method {name} at level {level!r}", expected=f"level {' or '.join(method.levels)}"
        )


def _check_throughout(name: str, method: Method, session: Session) -> None:
    if method.throughout:
        return
    for _, _, phase in session.groups:
        if session.pushes.throughout(phase):
            raise InputError(
                f"method {name}: the pushes of phase {phase} go on throughout",
                expected=f"method {METHODS.default}",
            )


def check_inertia(fit: PhaseFit, phase: str) -> None:
    """Refuse an inertia that is clearly negative.

    Raises
    ------
    EstimationError
        Its diagonal lies below zero by more than chance.
    """
    diagonal = [0, 3]
    if (fit.values[diagonal] < -4 * np.sqrt(np.diag(fit.covariance)[diagonal])).any():
        raise EstimationError(
            f"phase {phase}: the inertia comes out negative; is the force that of the limb on the "
            "device (force_by), and has it not been freed of the handle twice?"
        )
