"""The table of the models over posture; the entries lie in the folder `models`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import MethodTable

if TYPE_CHECKING:
    import numpy as np

    from armimpedance.core.progress import Progress
    from armimpedance.muscles.models.posture.data import FittedMatrix, PostureData

    FitMatrix = Callable[[PostureData, int, np.random.Generator, Progress, bool], FittedMatrix]


@dataclass(frozen=True)
class PostureMethod:
    """A way to fit K and B over posture.

    `promises`: property that every fit has, in one sentence.
    `fit`: it fits one matrix: data, order, generator of the shuffles, progress, and whether rows
    are left out and shuffled to judge the fit.
    """

    name: str
    promises: str
    fit: FitMatrix


#: The default is that of order 2 and above; see `default_model`.
POSTURE_MODELS: Final[MethodTable[PostureMethod]] = MethodTable(
    "armimpedance.muscles.models.posture.models", "MODEL", "posture model", "sos"
)


def default_model(order: int) -> str:
    """The name of the model that is fitted if none is asked for."""
    return "polynomial" if order < 2 else POSTURE_MODELS.default
