"""How the three processors that wrote C3D files lay out a number: Intel, DEC (VAX), MIPS (SGI)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray

#: A VAX exponent counts from 128 and its mantissa lies between 1/2 and 1: 4 times IEEE's number.
_VAX_FACTOR: Final = 0.25


@dataclass(frozen=True)
class Processor:
    """The order of bytes, and the form of real numbers.

    Attributes
    ----------
    name : str
    order : {"<", ">"}
        Of integers, and of reals where they are IEEE's.
    vax : bool
        Reals are DEC's F_floating.
    """

    name: str
    order: Literal["<", ">"]
    vax: bool = False

    def dtype(self, kind: Literal["i2", "u2", "f4"]) -> np.dtype:
        """The numpy type of stored words; DEC's reals are to be decoded."""
        return np.dtype(f"{self.order}{'u4' if self.vax and kind == 'f4' else kind}")

    def decoded(self, words: NDArray[np.generic]) -> FloatArray:
        """Stored words of `dtype` as numbers."""
        if not (self.vax and words.dtype.kind == "u" and words.dtype.itemsize == 4):
            with np.errstate(invalid="ignore"):
                return words.astype(np.float64)
        # The halves of a VAX number stand the other way round.
        stored = words.view(np.uint32)
        bits = (stored << np.uint32(16)) | (stored >> np.uint32(16))
        exponent = (bits >> np.uint32(23)) & np.uint32(0xFF)
        largest = exponent == 0xFF
        # Such an exponent is a number to a VAX and none to IEEE: one less, and twice the value.
        safe = np.where(largest, bits - np.uint32(1 << 23), bits).astype(np.uint32)
        values = safe.view(np.float32).astype(np.float64) * _VAX_FACTOR
        values[largest] *= 2.0
        values[exponent == 0] = 0.0
        # A sign without an exponent is the VAX's "reserved operand": no number.
        values[(exponent == 0) & (bits >> np.uint32(31) == 1)] = np.nan
        return values


#: The code in the parameter section's fourth byte -> processor.
PROCESSORS: Final = {
    84: Processor("Intel", "<"),
    85: Processor("DEC", "<", vax=True),
    86: Processor("MIPS", ">"),
}
