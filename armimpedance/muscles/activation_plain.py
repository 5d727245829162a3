"""Models over activation as plain values, and back: what a JSON file holds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, fields
from typing import Any, TypeVar

import numpy as np

from armimpedance.errors import InputError
from armimpedance.muscles.quality import ElementQuality
from armimpedance.regression.summary import FitSummary, NamedParameter

Model = TypeVar("Model")


def plain_model(model: Any) -> dict[str, Any]:
    """The fields of a frozen model; arrays as lists, infinity and nan as texts."""
    return {f.name: _plain(getattr(model, f.name)) for f in fields(model)}


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, FitSummary | ElementQuality):
        return {name: _plain(part) for name, part in asdict(value).items()}
    if isinstance(value, Mapping):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(part) for part in value]
    if isinstance(value, float) and not np.isfinite(value):
        return str(value)
    return value


def read_plain(kind: type[Model], plain: Mapping[str, Any], **others: Any) -> Model:
    """A model of this type from `plain_model`'s values.

    Parameters
    ----------
    kind : type
        A frozen dataclass of arrays, numbers, texts, `quality` and `summary`.
    plain : mapping
    **others
        Fields that were read before.

    Raises
    ------
    InputError
        A field is missing, unknown or not what it should be.
    """
    if not isinstance(plain, Mapping):
        raise InputError("not a model", expected="a dictionary of its fields")
    wanted = {f.name: str(f.type) for f in fields(kind)}  # type: ignore[arg-type]
    missing = sorted(set(wanted) - set(plain) - set(others))
    unknown = sorted(set(plain) - set(wanted))
    if missing or unknown:
        problem = f"no {', '.join(missing)}" if missing else f"unknown {', '.join(unknown)}"
        raise InputError(f"not a {kind.__name__}: {problem}", expected=", ".join(wanted))
    values = {
        name: _read(name, kind_of, plain[name])
        for name, kind_of in wanted.items()
        if name not in others
    }
    return kind(**values, **others)


def _read(name: str, kind: str, value: Any) -> Any:
    readers: dict[str, Callable[[Any], Any]] = {
        "FloatArray": lambda v: np.array(v, dtype=float),
        "IntArray": lambda v: np.array([_whole(x) for x in np.ravel(v)]).reshape(np.shape(v)),
        "float": _number,
        "int": _whole,
        "bool": _truth,
        "str": _text,
        "tuple[str, ...]": lambda v: tuple(_text(part) for part in _many(v)),
        "tuple[ElementQuality, ...]": lambda v: tuple(_quality(part) for part in _many(v)),
        "FitSummary": _summary,
    }
    try:
        if value is None and kind.endswith("| None"):
            return None
        return readers[kind.removesuffix(" | None")](value)
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise InputError(f"model field {name}: {error}", expected=kind) from error


def _number(value: Any) -> float:
    if isinstance(value, bool):
        raise TypeError(f"not a number: {value}")
    return float(value)


def _whole(value: Any) -> int:
    if isinstance(value, bool) or int(value) != value:
        raise ValueError(f"not a whole number: {value}")
    return int(value)


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise TypeError(f"neither true nor false: {value}")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"not a text: {value}")
    return value


def _many(value: Any) -> list[Any]:
    if not isinstance(value, list | tuple):
        raise TypeError(f"not a list: {value}")
    return list(value)


def _quality(value: Mapping[str, Any]) -> ElementQuality:
    numbers = {n: _number(v) for n, v in value.items() if n != "element"}
    return ElementQuality(element=_text(value["element"]), **numbers)


def _summary(value: Mapping[str, Any]) -> FitSummary:
    parameters = tuple(_parameter(one) for one in _many(value["parameters"]))
    numbers = {n: _number(value[n]) for n in ("cond_raw", "cond_scaled", "r2", "vaf")}
    return FitSummary(
        method=_text(value["method"]),
        n=_whole(value["n"]),
        rank=_whole(value["rank"]),
        parameters=parameters,
        warnings=tuple(_text(one) for one in _many(value["warnings"])),
        **numbers,
    )


def _parameter(value: Mapping[str, Any]) -> NamedParameter:
    numbers = {n: _number(value[n]) for n in ("value", "sd", "sd_robust", "dof")}
    joint = None if value["joint"] is None else _whole(value["joint"])
    return NamedParameter(
        name=_text(value["name"]), unit=_text(value["unit"]), joint=joint, **numbers
    )
