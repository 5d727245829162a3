"""Arrays that records hold: copied in once, then read-only, of a stated shape, all finite."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armimpedance.errors import RecordError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


def frozen_array(
    values: ArrayLike, name: str, shape: tuple[int | None, ...], dtype: Any = np.float64
) -> Any:
    """Copy into a read-only array and check its shape (None = any length) and finiteness.

    An array that nobody can write to any more (see `frozen`) is taken as it is.
    """
    taken = isinstance(values, np.ndarray) and values.dtype == dtype and _is_frozen(values)
    array = np.asarray(values) if taken else np.array(values, dtype=dtype)
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits:
        wanted = "(" + ", ".join("any" if s is None else str(s) for s in shape) + ")"
        raise RecordError(f"{name} has shape {array.shape}", expected=f"shape {wanted}")
    if np.issubdtype(array.dtype, np.floating) and not _all_finite(array):
        raise RecordError(f"{name} holds a value that is not finite", expected="finite numbers")
    array.flags.writeable = False
    return array


def _all_finite(array: np.ndarray) -> bool:
    """Whether no value is NaN or infinite; the sum tells in one pass unless it overflows."""
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.isfinite(array.sum()) or np.isfinite(array).all())


def frozen(array: FloatArray) -> FloatArray:
    """Give up the right to write to a fresh array, so that a type can take it without a copy."""
    array.flags.writeable = False
    return array


def _is_frozen(array: np.ndarray) -> bool:
    """Whether neither this array nor any that it is a view of can be written to."""
    seen: Any = array
    while isinstance(seen, np.ndarray):
        if seen.flags.writeable:
            return False
        seen = seen.base
    return seen is None
