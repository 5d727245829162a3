"""The number of a whole movement: its share, or its projection where the share cannot be told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from armimpedance.joint.therapy.share.result import Contribution


@dataclass(frozen=True)
class WholeMovement:
    """The number of a whole movement: its share, its projection where that cannot be told.

    Attributes
    ----------
    metric : str
    percent, sd, half : float
        `half` of the 95 % interval.
    valid : bool
        Whether either can be told.
    """

    metric: Literal["share", "projection"]
    percent: float
    sd: float
    half: float
    valid: bool

    @classmethod
    def of(cls, whole: Contribution) -> WholeMovement:
        """Of a movement."""
        shown = whole.share.valid or not whole.projection.valid
        told = whole.share if shown else whole.projection
        half = float(np.ptp(told.ci95)) / 2
        name: Literal["share", "projection"] = "share" if shown else "projection"
        return cls(name, told.percent, told.sd, half, told.valid)


def contribution_text(whole: Contribution) -> str:
    """``52 ± 3 %``: the share and half of its 95 % interval; else the projection, which it says."""
    told = WholeMovement.of(whole)
    if not told.valid:
        return "cannot be told"
    said = " (projection)" if told.metric == "projection" else ""
    return f"{round(told.percent)} {_half([told])}{said}"


def contribution_texts(whole: Sequence[WholeMovement]) -> str:
    """``60, 59p, 61 ± 3 %``: of repetitions, with the widest interval; a p marks projections."""
    if not any(w.valid for w in whole):
        return "cannot be told"
    numbers = [
        (f"{round(w.percent)}{'p' if w.metric == 'projection' else ''}" if w.valid else "?")
        for w in whole
    ]
    return f"{', '.join(numbers)} {_half(whole)}"


def _half(whole: Sequence[WholeMovement]) -> str:
    """``± 3 %``: the widest."""
    widest = max(w.half for w in whole if w.valid)
    return f"± {max(round(widest), 1)} %"
