"""The verb `random`: a hand under a random perturbation."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from armimpedance.hand.show.options import BY, FORCE_BY
from armimpedance.show.verbs.kinds import NumberPair
from armimpedance.show.verbs.options import DESPITE, Option, Verb

if TYPE_CHECKING:
    from armimpedance.core.progress import Progress
    from armimpedance.core.records import Recording
    from armimpedance.hand.random.show.random_estimates import RandomEstimates
    from armimpedance.hand.show.estimates import ForceBy
    from armimpedance.show.verbs.results import PathLike

RANDOM: Final = Verb(
    "random",
    (
        BY,
        Option(
            "band_hz",
            NumberPair(unit="Hz"),
            "fitted band in Hz (default: where the commands have power, at most 25 Hz)",
            flag="--band",
            doc="fitted band; default: where the commands have power, at most 25 Hz",
        ),
        FORCE_BY,
        DESPITE,
    ),
)


@RANDOM.function
def random(
    recording: Recording | PathLike,
    *,
    by: str | Sequence[str] = "condition",
    band_hz: tuple[float, float] | None = None,
    force_by: ForceBy | None = None,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> RandomEstimates:
    """Estimate inertia, viscosity, stiffness and a reflex from random perturbations.

    Parameters
    ----------
    recording : Recording or path
        Of a hand in two or three axes, or of two or three joints, ``perturbation`` "stochastic",
        with the robot's commands in the columns ``command_x``, ``command_y``, ``command_z``.
    {options}
    progress : function (done, all), optional
        Called after each group.

    Returns
    -------
    RandomEstimates
        M, B and K of every group without the reflex; `fits` holds reflex, lag and the frequency
        response.

    Raises
    ------
    InputError
        The recording cannot be read, lacks commands, is short, its hand does not follow them, or
        its wrist was free.
    NotIdentifiableError
        The commands do not move the hand along all axes.
    EstimationError
        The inertia is negative or of an impossible size: a unit, a sign or an axis differs from
        that stated in the recording.

    Examples
    --------
    >>> from armimpedance.hand.random.show import random
    >>> from manipulandum_sim.random_hand import simulate_random
    >>> recording, _ = simulate_random(seed=1, trials=2, duration_s=6.0)
    >>> random(recording).names
    ('random',)
    """
    from armimpedance.hand.random.doubts import check_wrist
    from armimpedance.hand.random.identify import identify_random
    from armimpedance.hand.random.show.random_estimates import RandomEstimates
    from armimpedance.hand.show.estimates import opened
    from armimpedance.show.verbs.checks import TopicChecks, checked

    with opened(recording, by, 0, force_by) as (read, columns):
        marks = checked(read, despite, TopicChecks(response=check_wrist))
        marks = tuple(mark for mark in marks if not mark.startswith("imposed"))
        fits = identify_random(read, columns, band_hz, progress)
        fits = [replace(fit, estimate=fit.estimate.marked(marks)) for fit in fits]
        estimates = tuple(fit.estimate for fit in fits)
        return RandomEstimates(estimates, read.subject, read.gravity_m_s2, tuple(fits))
