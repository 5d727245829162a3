"""Decoders of ROS messages: from the definition in the file, or the one that ROS gives out."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from armimpedance.core.errors import InputError
from armimpedance.core.extras import needed
from armimpedance.recordings.mapped.raw_file import Wanted
from armimpedance.recordings.messages.decoding import Block, decode
from armimpedance.recordings.messages.definitions import (
    DefinitionError,
    Definitions,
    definitions_of_package,
    definitions_of_text,
    short_name,
)
from armimpedance.recordings.messages.layout import Encoding
from armimpedance.recordings.messages.topics import Decoder


def ros_decoder(kind: str, text: str, language: str, encoding: Encoding, file: Path) -> Decoder:
    """The decoder of a topic.

    Parameters
    ----------
    kind : str
        The message's type, such as "geometry_msgs/msg/Wrench".
    text : str
        Its definition; "" where the file has none.
    language : {"msg", "idl"}
        Of the definition.
    encoding : {"ros1", "cdr"}
    file : Path
        For messages.

    Raises
    ------
    DefinitionError
        There is no definition of the type, or it is not understood.
    """
    name = short_name(kind)
    if not text.strip() and language == "msg" and name != "std_msgs/Empty":
        known = standard_definitions(file)
        if name not in known:
            raise DefinitionError("its type is none of ROS's own and has no definition here")
    elif language == "msg":
        known = definitions_of_text(text, kind)
    else:
        known = _of_idl(text, file)
    if name not in known:
        raise DefinitionError("its type has no definition")

    def decoder(messages: Sequence[bytes], wanted: Wanted) -> Block:
        return decode(messages, name, known, encoding, wanted)

    return decoder


@cache
def standard_definitions(file: Path) -> Definitions:
    """The messages that every ROS has, for logs that do not bear definitions.

    Raises
    ------
    InputError
        The package rosbags is not installed.
    """
    typesys = needed("rosbags.typesys", "ros", file)
    return definitions_of_package(typesys.get_typestore(typesys.Stores.ROS2_HUMBLE).fielddefs)


def _of_idl(text: str, file: Path) -> Definitions:
    typesys = needed("rosbags.typesys", "ros", file)
    if len(text) > 100_000:
        raise DefinitionError("a definition of more than 100000 letters")
    parts = [p.partition("\n")[2] for p in text.split("=" * 80 + "\n") if p.startswith("IDL: ")]
    known: dict[str, Any] = {}
    try:
        for part in parts or [text]:
            known |= typesys.get_types_from_idl(part)
        return definitions_of_package(known)
    except InputError:
        raise
    except Exception:
        # The parser of the package ends in whatever its grammar meets.
        raise DefinitionError("its definition (IDL) is not understood") from None
