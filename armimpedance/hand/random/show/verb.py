"""A hand under a random perturbation: the verb."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.hand.random.identify import identify_random
from armimpedance.hand.random.random_fit import RandomFit
from armimpedance.hand.show.estimates import Estimates, ForceBy, opened
from armimpedance.show.files import Content
from armimpedance.show.verbs.checks import checked
from armimpedance.show.verbs.results import PathLike


@dataclass(frozen=True, repr=False, eq=False)
class RandomEstimates(Estimates):
    """Estimates of random perturbations, with what stands beside each.

    `fits`: in the order of the estimates: reflex, lag and frequency response.

    Examples
    --------
    >>> from armimpedance.hand.random.show import random
    >>> from manipulandum_sim.random_hand import simulate_random
    >>> recording, _ = simulate_random(seed=1, trials=2, duration_s=6.0)
    >>> hand = random(recording)
    >>> hand.to_frame()["n_trials"].tolist(), len(hand.fits)
    ([2], 1)
    """

    fits: tuple[RandomFit, ...] = ()

    @property
    def content(self) -> Content:
        """What RESULTS.csv holds, one row a group; JSON holds reflex and lag beside it."""
        own = super().content
        plain = own.objects or (lambda: [])
        return replace(
            own,
            objects=lambda: [a | b for a, b in zip(plain(), self._beside(), strict=True)],
        )

    def _beside(self) -> list[dict[str, Any]]:
        return [
            {
                "reflex": fit.reflex.to_dict(),
                "lag_s": fit.lag_s,
                "lag_probability": fit.lag_probability,
                "band_hz": list(fit.band_hz),
            }
            for fit in self.fits
        ]


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
        with what the robot was told in the columns ``command_x``, ``command_y``, ``command_z``.
    by : str or sequence of str
        Columns of the trial table; trials alike in all of them form a group.
    band_hz : (low, high), optional
        Fitted band; default: where the commands have power, at most 25 Hz.
    force_by : {"limb", "device"}, optional
        Whose force on the other a Kinarm's sensor holds.
    despite : str or collection of str
        Names of checks of `inspect` whose STOP is overruled; every estimate says so.
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
        The recording cannot be read, lacks commands, is short, or its hand does not follow them.
    NotIdentifiableError
        The commands do not move the hand along all axes.
    EstimationError
        The inertia comes out negative: a sign or an axis is not what the recording says.

    Examples
    --------
    >>> from armimpedance.hand.random.show import random
    >>> from manipulandum_sim.random_hand import simulate_random
    >>> recording, _ = simulate_random(seed=1, trials=2, duration_s=6.0)
    >>> random(recording).names
    ('random',)
    """
    with opened(recording, by, 0, force_by) as (read, columns):
        marks = tuple(m for m in checked(read, despite) if not m.startswith("imposed"))
        fits = identify_random(read, columns, band_hz, progress)
        fits = [replace(fit, estimate=fit.estimate.marked(marks)) for fit in fits]
        made = tuple(fit.estimate for fit in fits)
        return RandomEstimates(made, read.subject, read.gravity_m_s2, tuple(fits))
