"""Messages that are JSON objects, read into columns."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np

from armimpedance.recordings.mapped.raw_file import Wanted
from armimpedance.recordings.messages.decoding import LONGEST_ARRAY, LONGEST_TEXT, Block
from armimpedance.recordings.messages.definitions import DefinitionError

_MOST_VALUES: Final = 4096
_DEEPEST: Final = 16

#: Places at which programs store the time of measurement, as seconds and nanoseconds.
_STAMPS: Final = (("header", "stamp"), ("timestamp",), ("stamp",))
_SECONDS: Final = ("sec", "secs")
_NANOSECONDS: Final = ("nsec", "nanosec", "nsecs")


def decode_json(messages: Sequence[bytes], wanted: Wanted) -> Block:
    """Decode these messages into columns.

    `wanted`: whether a path, such as "wrench.force.x", is wanted.
    Raises DefinitionError: a message is not a JSON object.
    """
    block = Block(len(messages), np.zeros(len(messages), np.int64))
    numbers: dict[str, tuple[list[int], list[float]]] = {}
    texts: dict[str, tuple[list[int], list[str]]] = {}
    for row, message in enumerate(messages):
        content = _object(message)
        block.stamp_ns[row] = _stamp(content)
        for path, value in _flat(content, block):
            column_of: Any = texts if isinstance(value, str) else numbers
            if path not in column_of:
                if not wanted(path):
                    continue
                column_of[path] = ([], [])
            column_of[path][0].append(row)
            column_of[path][1].append(value)
        if len(numbers) + len(texts) > _MOST_VALUES:
            raise DefinitionError(f"more than {_MOST_VALUES} values in its messages")
    for path, (rows, values) in numbers.items():
        block.numbers[path] = [(np.array(rows), np.array(values, np.float64))]
    for path, (rows, words) in texts.items():
        block.texts[path] = [(np.array(rows), np.array(words, np.str_))]
    return block


def _object(message: bytes) -> dict[str, Any]:
    try:
        content = json.loads(message)
    except (ValueError, RecursionError):
        raise DefinitionError("a message is no JSON") from None
    if not isinstance(content, dict):
        raise DefinitionError("a message is no JSON object")
    return content


def _flat(content: dict[str, Any], block: Block) -> Iterator[tuple[str, float | str]]:
    """Paths and plain values of an object, including those of nested objects and short lists."""
    count = 0
    pending: list[tuple[str, Any, int]] = [("", content, 0)]
    while pending:
        path, value, depth = pending.pop()
        inner = _inner(path, value, block.long)
        if inner is None:
            plain = _plain(value)
            if isinstance(plain, str) and len(plain) > LONGEST_TEXT:
                block.long.add(path)
                continue
            if type(value) is int and abs(value) > 2**53:
                block.rounded.add(path)
            yield path, plain
        elif depth > _DEEPEST:
            raise DefinitionError("its objects lie in each other too deeply")
        else:
            pending += [(name, v, depth + 1) for name, v in reversed(inner)]
        count += 1
        if count > 20 * _MOST_VALUES:
            raise DefinitionError("too many values in a message")


def _inner(path: str, value: Any, long: set[str]) -> list[tuple[str, Any]] | None:
    """The members of an object or a list with their paths; None for a plain value."""
    if isinstance(value, dict):
        return [(f"{path}.{name}" if path else str(name), v) for name, v in value.items()]
    if isinstance(value, list):
        if len(value) > LONGEST_ARRAY:
            long.add(path)
            return []
        return [(f"{path}[{i}]", v) for i, v in enumerate(value)]
    return None


def _plain(value: Any) -> float | str:
    if isinstance(value, str):
        return value.replace("\x00", "")
    if value is None:
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _stamp(content: dict[str, Any]) -> int:
    """The time of measurement in a message in ns; 0 if the message states none."""
    for keys in _STAMPS:
        value: Any = content
        for name in keys:
            value = value.get(name) if isinstance(value, dict) else None
        if isinstance(value, dict):
            sec = next((value[n] for n in _SECONDS if n in value), None)
            nanosec = next((value[n] for n in _NANOSECONDS if n in value), None)
            if type(sec) is int and type(nanosec) is int and 0 <= sec < 2**33:
                return sec * 1_000_000_000 + min(max(nanosec, 0), 999_999_999)
    return 0
