"""Frozen records as lists, numbers and texts, and back: what a JSON file can hold.

The record's own type hints say what each field must be; whatever the file holds instead is an
`InputError` that names the field. Numbers that are not finite stand as the texts "inf" and "nan",
for which JSON has no sign.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from armimpedance.core.arrays import LARGEST, FloatArray, IntArray
from armimpedance.core.errors import InputError

Record = TypeVar("Record")

_NOT_FINITE = ("inf", "-inf", "nan")


def to_plain(value: Any) -> Any:
    """Records as mappings of their fields, arrays and tuples as lists, numbers as they are."""
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
    """The record of this type whose `to_plain` this is.

    Parameters
    ----------
    kind : type
        A frozen dataclass whose fields are float arrays, whole-number arrays, numbers, truths,
        texts, such records, tuples of them, or None.
    plain : mapping
    where : str
        The field that it stands in, for messages.

    Raises
    ------
    InputError
        A field is missing, unknown, or not what its type says, or the record refuses it.
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


def _inside(where: str, name: str) -> str:
    return f"{where}.{name}" if where else name


def _read(hint: Any, value: Any, where: str) -> Any:
    if get_origin(hint) in (Union, UnionType):
        kinds = [kind for kind in get_args(hint) if kind is not NoneType]
        return (
            None
            if value is None and len(kinds) < len(get_args(hint))
            else _read(kinds[0], value, where)
        )
    if get_origin(hint) is tuple:
        return _tuple(get_args(hint), value, where)
    if hint in (FloatArray, IntArray):
        return _array(hint, value, where)
    if get_origin(hint) is Literal:
        if value not in get_args(hint):
            allowed = ", ".join(map(str, get_args(hint)))
            raise InputError(f"{value!r:.40}", column=where, expected=allowed)
        return value
    if is_dataclass(hint):
        return from_plain(hint, value, where)  # type: ignore[arg-type]
    return _single(hint, value, where)


def _tuple(kinds: tuple[Any, ...], value: Any, where: str) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise InputError("not a list", column=where, expected="a list")
    if kinds[-1] is not Ellipsis and len(kinds) != len(value):
        raise InputError(f"{len(value)} values", column=where, expected=f"{len(kinds)}")
    each = kinds[:1] * len(value) if kinds[-1] is Ellipsis else kinds
    return tuple(
        _read(kind, part, f"{where}[{i}]")
        for i, (kind, part) in enumerate(zip(each, value, strict=True))
    )


def _array(hint: Any, value: Any, where: str) -> np.ndarray:
    whole = hint == IntArray
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        array = np.array(np.nan)
    # an array of one number is a list too: [] has a shape, 3.0 has none
    # beyond 2^53 not every whole number is a float
    if array.ndim == 0 or (
        whole and not ((np.abs(array) < 2.0**53) & (array == np.floor(array))).all()
    ):
        expected = "lists of whole numbers" if whole else "lists of numbers"
        raise InputError("not an array", column=where, expected=expected)
    return array.astype(np.int64) if whole else array


def _single(hint: Any, value: Any, where: str) -> Any:
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
    raise InputError(f"{value!r:.40}", column=where, expected=names.get(hint, str(hint)))
