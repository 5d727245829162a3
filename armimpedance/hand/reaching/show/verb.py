"""The verb `movement`: the hand's impedance while it moves."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Final

from armimpedance.hand.reaching.methods import METHODS
from armimpedance.hand.show.options import FORCE_BY
from armimpedance.show.verbs.kinds import AnyWord, MethodName, Number, OneOf, PlaceToRead, Switch
from armimpedance.show.verbs.options import DESPITE, Option, Verb

if TYPE_CHECKING:
    from armimpedance.core.conventions import Level
    from armimpedance.core.progress import Progress
    from armimpedance.core.records import ImpedanceEstimate, Recording
    from armimpedance.hand.show.estimates import Estimates, ForceBy
    from armimpedance.show.verbs.results import PathLike

MOVEMENT: Final = Verb(
    "movement",
    (
        Option(
            "method",
            MethodName(values=METHODS.names),
            METHODS.listed(),
            doc='"latent" (the default), or one of the sources\'',
        ),
        Option(
            "level",
            OneOf(values=("hand", "joint")),
            "default: hand",
            "hand",
            doc="at the joints K is that of muscles and joints, without the force term",
        ),
        Option(
            "inertia",
            PlaceToRead("RESULTS", "sequence of ImpedanceEstimate or path"),
            "of `estimate` on the same person in posture (default: fitted to the pushes)",
            doc="the hand's M of the same person in postures, or their RESULTS.csv; default: the "
            "inertia is fitted with the rest",
        ),
        Option(
            "phases",
            AnyWord(python="sequence of str"),
            "only this one; may be repeated",
            flag="--phase",
            many=True,
            doc="only these phases (default: all)",
        ),
        Option(
            "course",
            Switch(),
            "every 20 ms from the first phase to the last, from the pushes of all phases",
            False,
            doc="every 20 ms from the first phase to the last, from the pushes of all phases "
            'together, two phases or more (method "latent")',
        ),
        Option(
            "window_s",
            Number(unit="s", above=0),
            "fitted time after a push's onset (default: until .1 s after the push, at most .3)",
            doc="length of the fitted window after a push's onset; default: until .1 s after the "
            "push, at most .3 s",
        ),
        FORCE_BY,
        DESPITE,
    ),
)


@MOVEMENT.function
def movement(
    recording: Recording | PathLike,
    *,
    method: str | None = None,
    level: Level = "hand",
    inertia: Sequence[ImpedanceEstimate] | PathLike | None = None,
    phases: Sequence[str] | None = None,
    window_s: float | None = None,
    course: bool = False,
    force_by: ForceBy | None = None,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> Estimates:
    """Estimate inertia, viscosity and stiffness of a reaching hand, phase by phase.

    Parameters
    ----------
    recording : Recording or path
        Reaches in a plane, ``perturbation`` "moving": the trial table says in ``phase``,
        ``push_deg`` and ``push_onset_s`` which of them were pushed, empty where nobody pushed.
    {options}
    progress : function (done, all), optional
        Called after each phase.

    Returns
    -------
    Estimates
        One estimate per condition and phase, for the middle of the window; `position` is that of
        undisturbed reaches at that time.

    Raises
    ------
    InputError
        The recording cannot be read or lacks what is needed, a check of `inspect` says STOP, or a
        name is unknown.
    NotIdentifiableError
        The pushes of a phase do not determine M, B and K.
    EstimationError
        M comes out negative or of no person's size: the force's sign or unit is not what the
        recording says.

    Examples
    --------
    >>> from armimpedance.hand.reaching.show import movement
    >>> from manipulandum_sim.movement import simulate_movement
    >>> recording, _ = simulate_movement(seed=1, repeats=2, unperturbed=15, phases=(0.5,))
    >>> moving = movement(recording)
    >>> moving.names
    ('condition free, phase 50%',)
    """
    from armimpedance.hand.reaching.show.fitting import fit_movement

    return fit_movement(
        recording,
        inertia,
        course=course,
        method=method,
        force_by=force_by,
        despite=despite,
        level=level,
        phases=phases,
        window_s=window_s,
        progress=progress,
    )
