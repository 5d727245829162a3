"""From windows of the hand to numbers: what the rigs `hand` and `linear` share."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.records import Window
from armimpedance.hand.still import METHODS, Group, Options, estimate_window
from armimpedance.lab.simulate_study.fields import Field, Settings, one_of
from armimpedance.lab.simulate_study.hand_numbers import EXTRAS, QUANTITIES, numbers_of
from armimpedance.lab.simulate_study.rig import COLUMNS, Numbers, Shortcut

_COVARIANCES: Final = ("cr3", "replicates", "cr1", "bootstrap")
#: The settings that only estimate.
ESTIMATOR: Final = (
    Field("method", METHODS.default, one_of(lambda: METHODS.names), simulated=False),
    Field("covariance", "cr3", one_of(lambda: _COVARIANCES), simulated=False),
)


@dataclass(frozen=True)
class Prepared:
    """The windows of one condition, one for each session, and their truth (3, 2, 2)."""

    windows: list[Window]
    group: Group
    truth: FloatArray


def estimate_all(settings: Settings, made: list[Prepared]) -> Numbers:
    """Every session of every condition; what fails is nan, and its reason counted."""
    method, covariance = str(settings["method"]), str(settings["covariance"])
    options = Options(method, covariance, bound=False)  # type: ignore[arg-type]
    sessions = len(made[0].windows)
    values = np.full((len(made), sessions, len(QUANTITIES), len(COLUMNS)), np.nan)
    extras = np.full((len(made), sessions, EXTRAS), np.nan)
    problems: Counter[str] = Counter()
    for c, one in enumerate(made):
        for s, window in enumerate(one.windows):
            try:
                found = estimate_window(window, one.group, options)
            except ArmImpedanceError as error:
                problems[str(error)] += 1
                continue
            values[c, s], extras[c, s] = numbers_of(found, one.truth)
    return Numbers(values, extras, dict(problems))


def shortcut() -> Shortcut:
    """How estimates at the hand are drawn."""
    from armimpedance.lab.simulate_study.hand_drawing import SHORTCUT

    return SHORTCUT
