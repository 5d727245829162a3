"""A packet of a stream as the arguments of an update, whatever somebody has sent.

A packet is one JSON object in UTF-8: ``time_s``, ``q_rad`` or ``hand_m``, one number a muscle
(null where its channel dropped out), and where there are any ``force_N``, ``displacement_m`` and
``signal_sd``. ``{"reset": true}`` begins anew.
"""

from __future__ import annotations

import json
from typing import Any, Final

from armimpedance.core.errors import InputError, shortened
from armimpedance.core.json_text import is_number

#: Bytes of a packet; one of 100 muscles has some 3,000.
LONGEST: Final = 16_384
#: Fields that hold a vector, and the argument of `Live.update` that each of them is.
_VECTORS: Final = {
    "q_rad": "q",
    "hand_m": "hand",
    "force_N": "force",
    "displacement_m": "displacement",
    "signal_sd": "signal_sd",
}
#: What a channel that dropped out is.
_LOST: Final = float("nan")


def parsed(packet: bytes, signal: str) -> dict[str, Any] | None:
    """Arguments of `Live.update`.

    Parameters
    ----------
    packet : bytes
    signal : str
        Name of the field with the muscles' activity, such as "activation".

    Returns
    -------
    dict or None
        None: the stream begins anew.

    Raises
    ------
    InputError
        A packet that cannot be taken; fields that are not known do no harm.
    """
    fields = _object(packet)
    if fields.get("reset") is True:
        return None
    arguments: dict[str, Any] = {"signal": _channels(fields, signal)}
    for name, argument in _VECTORS.items():
        if fields.get(name) is not None:
            arguments[argument] = _numbers(fields[name], name)
    time = fields.get("time_s")
    if time is not None and not is_number(time):
        raise _wrong("time_s", time, "a number")
    return arguments | {"time_s": time}


def _object(packet: bytes) -> dict[str, Any]:
    if len(packet) > LONGEST:
        raise InputError(f"a packet of {len(packet)} bytes", expected=f"at most {LONGEST}")
    try:
        fields = json.loads(packet.decode("utf-8"), parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"a packet that is no JSON: {error}", expected="one object in UTF-8"
        ) from None
    if not isinstance(fields, dict):
        raise InputError(f"a packet of {_kind(fields)}", expected="an object")
    return fields


def _channels(fields: dict[str, Any], name: str) -> list[float]:
    given = fields.get(name)
    if given is None:
        raise InputError(f"a packet without {name}", expected="one number a muscle")
    if isinstance(given, list) and None in given:
        given = [_LOST if value is None else value for value in given]
        if all(value is _LOST or is_number(value) for value in given):
            return given
    return _numbers(given, name)


def _numbers(value: object, name: str) -> list[float]:
    if not isinstance(value, list) or not all(is_number(v) for v in value):
        raise _wrong(name, value, "a list of finite numbers")
    return value


def _wrong(name: str, value: object, expected: str) -> InputError:
    return InputError(f"is {_kind(value)}", column=name, expected=expected)


def _kind(value: object) -> str:
    return (
        shortened(repr(value), 60)
        if isinstance(value, str | int | float)
        else (
            {list: "a list", dict: "an object", type(None): "null"}.get(
                type(value), "something else"
            )
        )
    )


def _no_constant(name: str) -> float:
    raise ValueError(f"it holds {name}")
