"""The table of the models over activation; the entries lie in the folder `models`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from armimpedance.core.method_table import MethodTable


@dataclass(frozen=True)
class ActivationMethod:
    """A way to fit K and B over activation.

    `promises`: property that every fit has, in one sentence.
    `bounded`: whether the stiffness of every muscle stays nonnegative.
    """

    name: str
    promises: str
    bounded: bool


ACTIVATION_MODELS: Final[MethodTable[ActivationMethod]] = MethodTable(
    "armimpedance.muscles.models.activation.models", "MODEL", "activation model", "polynomial"
)
