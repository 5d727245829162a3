"""Definitions of ROS messages, from text or from the package rosbags.

A definition is parsed here and never run: code made from a file's text would be the file's code.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

#: Primitive types by their names in definitions -> numpy's names. ROS 1 knows two more.
PRIMITIVES: Final[Mapping[str, str]] = {
    "bool": "u1", "byte": "u1", "octet": "u1", "char": "u1", "int8": "i1", "uint8": "u1",
    "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float32": "f4", "float64": "f8",
}  # fmt: skip

#: The length of a field whose number of values is stated in each message.
SEQUENCE: Final = -1

_LARGEST_TEXT: Final = 1_000_000
_LINE: Final = re.compile(
    r"\s*(?P<type>[A-Za-z][A-Za-z0-9_/]*)(<=\s*\d+)?(?P<array>\[\s*(<=)?\s*\d*\s*\])?"
    r"\s+(?P<name>[A-Za-z_][A-Za-z0-9_]*)\s*(?P<rest>.*)"
)
_TIMES: Final = {
    "builtin_interfaces/Time": ("int32", "uint32"),
    "builtin_interfaces/Duration": ("int32", "uint32"),
    "time": ("uint32", "uint32"),
    "duration": ("int32", "int32"),
}


class DefinitionError(Exception):
    """A definition is missing or cannot be parsed; the topic is not taken."""


@dataclass(frozen=True)
class MessageField:
    """One field of a message.

    `type`: a primitive type, "string", or the name of a message.
    `length`: of an array; `SEQUENCE` where each message states it; None: a single value.
    """

    name: str
    type: str
    length: int | None = None


#: Name of a message, such as "geometry_msgs/Wrench" -> its fields.
Definitions = Mapping[str, tuple[MessageField, ...]]


def short_name(name: str) -> str:
    """A message's name without the middle part of ROS 2: ``geometry_msgs/Wrench``."""
    parts = [p for p in name.split("/") if p]
    return "/".join([parts[0], parts[-1]]) if len(parts) > 1 else name


def definitions_of_text(text: str, name: str) -> Definitions:
    """Parse a definition as stored in ROS 1 bags, MCAP and ROS 2 databases.

    `text`: the fields of the message, then those of each message in it under ``MSG: name``.
    `name`: the message that the text begins with.
    """
    if len(text) > _LARGEST_TEXT:
        raise DefinitionError("a definition of more than a million letters")
    definitions: dict[str, tuple[MessageField, ...]] = {}
    for number, block in enumerate(re.split(r"(?m)^={20,}\s*$", text)):
        lines = block.splitlines()
        title = name if number == 0 else _title(lines)
        package = short_name(title).rpartition("/")[0]
        fields = [_field(line, package) for line in lines if not line.lstrip().startswith("MSG:")]
        definitions[short_name(title)] = tuple(f for f in fields if f is not None)
    return with_times(definitions)


def _title(lines: list[str]) -> str:
    for line in lines:
        if line.lstrip().startswith("MSG:"):
            return line.partition(":")[2].strip()
    raise DefinitionError("a part of the definition has no name")


def _field(line: str, package: str) -> MessageField | None:
    """The field of a line; None for a constant, a comment or an empty line."""
    code = line.partition("#")[0].strip()
    if not code or code.startswith("@"):
        return None
    match = _LINE.fullmatch(code)
    if match is None:
        raise DefinitionError(f"the line {code[:60]!r} of the definition is not understood")
    if match["rest"].startswith("="):
        return None
    return MessageField(match["name"], _resolved(match["type"], package), _length(match["array"]))


def _length(array: str | None) -> int | None:
    if array is None:
        return None
    inner = array.strip("[] ")
    return int(inner) if inner.isdigit() and len(inner) < 10 else SEQUENCE


def _resolved(name: str, package: str) -> str:
    if name in PRIMITIVES or name in ("string", "wstring") or name in _TIMES:
        return name
    if name == "Header":
        return "std_msgs/Header"
    return short_name(name) if "/" in name else f"{package}/{name}"


def with_times(definitions: Definitions) -> Definitions:
    """Add the definitions of times and durations, which every message may use."""
    times = {
        name: (MessageField("sec", sec), MessageField("nanosec", nanosec))
        for name, (sec, nanosec) in _TIMES.items()
    }
    return {**times, **definitions}


def definitions_of_package(known: Mapping[str, Any]) -> Definitions:
    """Convert a table of the package rosbags (of its stores, or of IDL text).

    `known`: name -> (constants, fields); a field is a name and a description.
    """
    definitions = {
        short_name(name): tuple(_described(field, description) for field, description in fields)
        for name, (_, fields) in known.items()
    }
    return with_times(definitions)


def _described(name: str, description: Any) -> MessageField:
    kind, content = int(description[0]), description[1]
    if kind <= 2:
        return MessageField(name, _type_of(kind, content))
    (inner, inner_content), length = content
    return MessageField(
        name, _type_of(int(inner), inner_content), int(length) if kind == 3 else SEQUENCE
    )


def _type_of(kind: int, content: Any) -> str:
    return str(content[0]) if kind == 1 else short_name(str(content))
