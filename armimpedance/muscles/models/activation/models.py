"""The table of the models over activation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from armimpedance.core.method_table import RecordTable


@dataclass(frozen=True)
class ActivationMethod:
    """A way to fit K and B over activation.

    `promises`: property that every fit has, in one sentence.
    `bounded`: whether the stiffness of every muscle stays nonnegative.
    """

    name: str
    promises: str
    bounded: bool


_BERNSTEIN: Final = ActivationMethod(
    "bernstein",
    "nonnegative stiffness of every muscle over its measured range of activation",
    bounded=True,
)
#: As in the source.
_POLYNOMIAL: Final = ActivationMethod(
    "polynomial",
    "the source's least squares; a muscle's stiffness may fall below zero",
    bounded=False,
)

ACTIVATION_MODELS: Final = RecordTable(
    {one.name: one for one in (_POLYNOMIAL, _BERNSTEIN)}, "activation model", "polynomial"
)
