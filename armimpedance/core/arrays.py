"""Arrays that records hold, checked and read-only, and records as plain values for JSON."""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache, partial, wraps
from types import MappingProxyType, NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Final,
    Literal,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armimpedance.core.errors import InputError, RecordError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

#: Larger than any quantity in any unit; squares and products of smaller numbers stay finite.
LARGEST: Final = 1e100

#: Tolerance for a correlation: its covariance may have been written with three digits.
ROUNDED: Final = 1e-2

#: Fewest degrees of freedom of a fit: with fewer, the factor of the t distribution overflows.
LEAST_DOF: Final = 0.1


def frozen_array(
    values: ArrayLike,
    name: str,
    shape: tuple[int | None, ...],
    dtype: Any = np.float64,
    *,
    finite: bool = True,
) -> Any:
    """Copy into a read-only array and check its shape (None = any length) and, unless
    `finite` is off, that all values are finite.

    An array that is read-only already (see `frozen`) is not copied.
    """
    reusable = isinstance(values, np.ndarray) and values.dtype == dtype and _is_frozen(values)
    array = np.asarray(values) if reusable else np.array(values, dtype=dtype)
    if array.shape != shape and not _fits(array.shape, shape):
        wanted = "(" + ", ".join("any" if s is None else str(s) for s in shape) + ")"
        raise RecordError(f"{name} has shape {array.shape}", expected=f"shape {wanted}")
    if finite and array.dtype.kind == "f" and not _all_numbers(array):
        problem = "too large to be measured" if np.isfinite(array).all() else "not finite"
        raise RecordError(f"{name} holds a value that is {problem}", expected="finite numbers")
    array.flags.writeable = False
    return array


def _fits(have: tuple[int, ...], wanted: tuple[int | None, ...]) -> bool:
    """True if a shape is the wanted one (None = any length)."""
    return len(have) == len(wanted) and all(
        needed is None or size == needed for size, needed in zip(have, wanted, strict=True)
    )


def _all_numbers(array: np.ndarray) -> bool:
    """True if no value is NaN, infinite, or so large that its powers overflow."""
    if array.size == 0:
        return True
    # the order of the values does not matter; a flat view is the fastest to read
    values = array.ravel(order="K")
    return bool(np.minimum.reduce(values) > -LARGEST and np.maximum.reduce(values) < LARGEST)


def frozen(array: FloatArray) -> FloatArray:
    """Make a fresh array read-only, so that a record can take it without a copy."""
    array.flags.writeable = False
    return array


def by_axis(signal: FloatArray) -> FloatArray:
    """Copy signals (T, S, d) to rows over time, (d T, S): all trials of the first axis first."""
    return np.array(signal.transpose(2, 0, 1), order="C").reshape(-1, signal.shape[1])


def lengths(vectors: FloatArray) -> FloatArray:
    """Length (...,) of vectors (..., d): `numpy.linalg.norm` to the last bit, axis by axis.

    For many short vectors it is much faster and needs no memory for their squares.
    """
    if not 0 < vectors.shape[-1] < 8:
        # NumPy adds eight and more in another order
        return np.asarray(np.linalg.norm(vectors, axis=-1))
    total = np.square(vectors[..., 0])
    for axis in range(1, vectors.shape[-1]):
        total += np.square(vectors[..., axis])
    return np.asarray(np.sqrt(total, out=total))


def require_covariance(covariance: FloatArray, name: str) -> None:
    """Refuse a matrix (..., p, p) that is not a covariance, beyond rounding.

    Raises RecordError: it is not symmetric, or a combination of the elements has a negative
    variance.
    """
    variance = np.diagonal(covariance, axis1=-2, axis2=-1)
    # an element without variance is exact and has no correlation
    scale = np.sqrt(np.where(variance > 0, variance, 1.0))
    correlation = covariance / scale[..., :, None] / scale[..., None, :]
    transposed = np.swapaxes(correlation, -1, -2)
    if (variance < 0).any():
        raise RecordError(f"{name} holds a negative variance", expected="variances of at least 0")
    if (np.abs(correlation - transposed) > ROUNDED).any():
        raise RecordError(f"{name} is not symmetric", expected="a covariance")
    every = np.eye(variance.shape[-1], dtype=bool)
    correlation = np.where(every, variance[..., None] > 0, (correlation + transposed) / 2)
    if correlation.size and np.linalg.eigvalsh(correlation).min() < -ROUNDED:
        problem = f"{name} gives a combination of the elements a negative variance"
        raise RecordError(problem, expected="correlations that can be together")


def _is_frozen(array: np.ndarray) -> bool:
    """True if neither this array nor any array that it is a view of can be written to."""
    seen: Any = array
    while isinstance(seen, np.ndarray):
        if seen.flags.writeable:
            return False
        seen = seen.base
    return seen is None


class FrozenRecord:
    """Base of records, which are frozen dataclasses: fields are checked by their annotations.

    The shape of an array field is in its annotation: ``Annotated[FloatArray, "m n"]``. A letter
    stands for one size throughout the record, a number for itself, ``m+1`` for one more than m,
    ``_`` for any size. ``nan`` at the end allows numbers that are not finite; ``covariance``
    there applies `require_covariance` to the last two axes. Sizes of tuples are checked too:
    ``Annotated[tuple[str, ...], "m"]`` has m entries. A list where a tuple is declared becomes a
    tuple, and a mapping becomes read-only. None is always allowed.

    A record with further rules extends ``__post_init__`` and calls this one first.

    Raises RecordError: an array has another shape, a value that is not finite, or sizes that
    disagree.
    """

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        record: Any = type(self)
        for name, rule in _rules(record):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, rule(value, name, sizes))


_Rule = Callable[[Any, str, dict[str, int]], Any]


@cache
def _rules(record: Any) -> tuple[tuple[str, _Rule], ...]:
    """Return the check of each field of a record; fields without one are left out."""
    hints = get_type_hints(record, include_extras=True)
    rules = ((f.name, _rule(hints[f.name])) for f in fields(record))
    return tuple((name, rule) for name, rule in rules if rule is not None)


def _rule(hint: Any) -> _Rule | None:
    """Return the check of one annotation; of a union, that of its first type. None: no check."""
    if get_origin(hint) in (Union, UnionType):
        return _rule(next(kind for kind in get_args(hint) if kind is not NoneType))
    if get_origin(hint) is Annotated:
        kind, text, *_ = get_args(hint)
        words = text.split()
        marks = {word for word in words if word in ("nan", "covariance")}
        dims = tuple(_Dim(word) for word in words if word not in marks)
        if get_origin(kind) is tuple:
            return partial(_frozen_tuple, dim=dims[0])
        return partial(_frozen_shape, dims=dims, marks=marks, dtype=_DTYPES[kind])
    if get_origin(hint) is tuple and get_args(hint)[-1:] == (Ellipsis,):
        return partial(_frozen_tuple, dim=_Dim("_"))
    return _frozen_mapping if get_origin(hint) is Mapping else None


def _frozen_tuple(value: Any, name: str, sizes: dict[str, int], *, dim: _Dim) -> Any:
    entries = tuple(value)
    wanted = dim.size(sizes, len(entries))
    if wanted is not None and wanted != len(entries):
        raise RecordError(f"{len(entries)} {name}", expected=f"{wanted}")
    return entries


def _frozen_mapping(value: Any, _name: str, _sizes: dict[str, int]) -> Any:
    return value if isinstance(value, MappingProxyType) else MappingProxyType(dict(value))


def _frozen_shape(
    value: Any,
    name: str,
    sizes: dict[str, int],
    *,
    dims: tuple[_Dim, ...],
    marks: set[str],
    dtype: Any,
) -> Any:
    have = np.shape(value)
    if len(have) != len(dims):
        raise RecordError(f"{name} has shape {have}", expected=f"{len(dims)} axes")
    wanted = tuple(dim.size(sizes, n) for dim, n in zip(dims, have, strict=True))
    array = frozen_array(value, name, wanted, dtype, finite="nan" not in marks)
    if "covariance" in marks:
        require_covariance(array, name)
    return array


class _Dim:
    """One dimension of an annotation."""

    def __init__(self, word: str) -> None:
        self._letter, _, more = word.partition("+")
        self._more = int(more or 0)
        self._fixed = int(word) if word.isdigit() else None
        self._any = word == "_"

    def size(self, sizes: dict[str, int], have: int) -> int | None:
        """Return the required size (None: any); a new letter is bound to the present size."""
        if self._any or self._fixed is not None:
            return self._fixed
        return sizes.setdefault(self._letter, have - self._more) + self._more


#: Element types of the array annotations.
_DTYPES: Final = {FloatArray: np.float64, BoolArray: np.bool_, IntArray: np.int64}

# Results that are computed once for each frozen record.

Kept = TypeVar("Kept")
Answer = TypeVar("Answer")


def once_per_record(function: Callable[[Kept], Answer]) -> Callable[[Kept], Answer]:
    """Return the same function with a cache: each record's result is kept while the record lives.

    Parameters
    ----------
    function : callable
        Takes one frozen record and always returns the same value for it.

    Returns
    -------
    callable
    """
    kept: dict[int, tuple[weakref.ref[Any], Answer]] = {}

    @wraps(function)
    def cached(record: Kept) -> Answer:
        key = id(record)
        entry = kept.get(key)
        if entry is not None and entry[0]() is record:
            return entry[1]
        answer = function(record)
        kept[key] = (weakref.ref(record, lambda _gone: kept.pop(key, None)), answer)
        return answer

    return cached


# Frozen records as lists, numbers and texts, and back: what a JSON file can hold.
#
# The record's own type hints say what each field must be; anything else in the file is an
# `InputError` that names the field. Numbers that are not finite are written as the texts "inf" and
# "nan", which JSON has no number for.

Record = TypeVar("Record")

_NOT_FINITE = ("inf", "-inf", "nan")


def to_plain(value: Any) -> Any:
    """Return records as mappings of their fields, arrays and tuples as lists, numbers unchanged."""
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: to_plain(getattr(value, f.name)) for f in fields(value) if f.init}
    if isinstance(value, np.ndarray | np.generic):
        return to_plain(value.tolist())
    if isinstance(value, tuple | list):
        return [to_plain(part) for part in value]
    if isinstance(value, float) and not np.isfinite(value):
        return str(value)
    return value


def from_plain(kind: type[Record], plain: Any, where: str = "") -> Record:
    """Return the record of type `kind` whose `to_plain` is `plain`.

    `kind`: a frozen dataclass whose fields are float or integer arrays, numbers, booleans, texts,
    such records, tuples of them, or None.
    `where`: the field that contains this record, for messages.
    Raises InputError: a field is missing, unknown, or not what its type says, or the record refuses
    it.
    """
    if not isinstance(plain, Mapping):
        raise InputError(f"not a {kind.__name__}", column=where or None, expected="a mapping")
    hints = get_type_hints(kind)
    wanted = [f.name for f in fields(kind) if f.init]  # type: ignore[arg-type]
    wrong = [f"no {n}" for n in wanted if n not in plain]
    wrong += [f"unknown {n}" for n in plain if n not in wanted]
    if wrong:
        raise InputError(f"not a {kind.__name__}: {', '.join(wrong)}", column=where or None)
    values = {name: _read(hints[name], plain[name], _inside(where, name)) for name in wanted}
    try:
        return kind(**values)
    except (TypeError, ValueError, LookupError, ArithmeticError) as error:
        problem = f"not a {kind.__name__}: {str(error).splitlines()[0]}"
        raise InputError(problem, column=where or None) from error


def _inside(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _read(hint: Any, value: Any, path: str) -> Any:
    if get_origin(hint) in (Union, UnionType):
        kinds = [kind for kind in get_args(hint) if kind is not NoneType]
        return (
            None
            if value is None and len(kinds) < len(get_args(hint))
            else _read(kinds[0], value, path)
        )
    if get_origin(hint) is tuple:
        return _tuple(get_args(hint), value, path)
    if hint in (FloatArray, IntArray):
        return _array(hint, value, path)
    if get_origin(hint) is Literal:
        if value not in get_args(hint):
            allowed = ", ".join(map(str, get_args(hint)))
            raise InputError(f"{value!r:.40}", column=path, expected=allowed)
        return value
    if is_dataclass(hint):
        return from_plain(hint, value, path)  # type: ignore[arg-type]
    return _single(hint, value, path)


def _tuple(kinds: tuple[Any, ...], value: Any, path: str) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise InputError("not a list", column=path, expected="a list")
    if kinds[-1] is not Ellipsis and len(kinds) != len(value):
        raise InputError(f"{len(value)} values", column=path, expected=f"{len(kinds)}")
    types = kinds[:1] * len(value) if kinds[-1] is Ellipsis else kinds
    return tuple(
        _read(kind, part, f"{path}[{i}]")
        for i, (kind, part) in enumerate(zip(types, value, strict=True))
    )


def _array(hint: Any, value: Any, path: str) -> np.ndarray:
    whole = hint == IntArray
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        array = np.array(np.nan)
    # beyond 2^53 not every whole number is a float
    if array.ndim == 0 or (
        whole and not ((np.abs(array) < 2.0**53) & (array == np.floor(array))).all()
    ):
        expected = "lists of whole numbers" if whole else "lists of numbers"
        raise InputError("not an array", column=path, expected=expected)
    return array.astype(np.int64) if whole else array


def _single(hint: Any, value: Any, path: str) -> Any:
    truth = isinstance(value, bool)
    number = isinstance(value, int | float) and not truth
    number = number and not LARGEST <= abs(value) < math.inf
    if hint is float and (number or value in _NOT_FINITE):
        return float(value)
    if hint is int and number and float(value).is_integer():
        return int(value)
    if (hint is bool and truth) or (hint is str and isinstance(value, str)):
        return value
    names = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
    raise InputError(f"{value!r:.40}", column=path, expected=names.get(hint, str(hint)))
