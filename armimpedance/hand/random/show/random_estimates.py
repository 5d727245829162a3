"""Result of `random`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from armimpedance.hand.random.random_fit import RandomFit
from armimpedance.hand.show.estimates import Estimates
from armimpedance.show.files import Content


@dataclass(frozen=True, repr=False, eq=False)
class RandomEstimates(Estimates):
    """Estimates of random perturbations, each with its reflex, lag and frequency response.

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
        """Content of RESULTS.csv, one row per group; JSON also holds reflex and lag."""
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
