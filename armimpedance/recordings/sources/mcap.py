"""MCAP files: logs of ROS 1, ROS 2 and JSON messages, one table per topic.

The records are read here and not by the package mcap, which trusts the sizes that a file states
and reads one record at a time. The records are read in the file's order without an index.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.recordings.mapped.raw_file import RawFile, Source, Wanted
from armimpedance.recordings.messages.decoding import Encoding
from armimpedance.recordings.messages.json_rows import decode_json
from armimpedance.recordings.messages.ros_bags import LARGEST_PART, decompressed
from armimpedance.recordings.messages.topics import (
    Decoder,
    Log,
    LogTopic,
    Unpack,
    nanoseconds,
    readable,
    ros_decoder,
)

MAGIC: Final = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _ATTACHMENT, _METADATA = 3, 4, 5, 6, 9, 12
_END_OF_DATA, _FOOTER = 15, 2
_KNOWN: Final = range(1, 16)
_EXPECTED: Final = "a whole MCAP file"

#: Message encoding and schema encoding -> the language of the schema's text.
_ROS: Final = {("cdr", "ros2msg"): "msg", ("cdr", "ros2idl"): "idl", ("ros1", "ros1msg"): "msg"}


def recognises(path: Path) -> bool:
    """True if a file begins like an MCAP file."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC


def read(path: Path, wanted: Wanted) -> RawFile:
    """Read the topics of an MCAP file.

    Parameters
    ----------
    path : Path
    wanted : callable
        True for a wanted column, such as "/ft.wrench.force.x".

    Returns
    -------
    RawFile
        One run; each topic is a table, since each has its own clock.

    Raises
    ------
    InputError
    """
    log = Log(path, wanted)
    with readable(path):
        add_mcap(log, path)
    return log.raw_file()


def add_mcap(log: Log, path: Path, unpack: Unpack | None = None) -> None:
    """Add the messages of a file to a log.

    `unpack`: decompresses each message; None where messages are not compressed.
    """
    _Reading(log, path, unpack).all()


@dataclass(frozen=True)
class _Schema:
    name: str
    language: str
    text: bytes


class _Reading:
    """One pass through a file; schemas and channels precede their messages."""

    def __init__(self, log: Log, path: Path, unpack: Unpack | None) -> None:
        self.log, self.path, self.unpack = log, path, unpack
        self.size = path.stat().st_size
        self.schemas: dict[int, _Schema] = {}
        self.channels: dict[int, LogTopic] = {}
        self.attached: list[str] = []

    def all(self) -> None:
        """Read from the beginning to the end, or to the place where the file is cut."""
        with self.path.open("rb") as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise self.error("does not begin as an MCAP file does")
            ended = False
            while not ended:
                offset = stream.tell()
                head = stream.read(9)
                size = struct.unpack_from("<Q", head, 1)[0] if len(head) == 9 else 0
                if len(head) < 9 or size > self.size - offset - 9:
                    self.cut(offset)
                    break
                if head[0] not in _KNOWN and head[0] < 128:
                    raise self.error(f"a record of unknown kind {head[0]} at byte {offset}")
                if head[0] in (_END_OF_DATA, _FOOTER):
                    ended = True
                elif head[0] in (_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK):
                    if size > LARGEST_PART:
                        raise self.error(f"a record of {size} bytes at byte {offset}")
                    self.understood(head[0], stream.read(size), offset)
                elif head[0] in (_ATTACHMENT, _METADATA):
                    self.attached.append(self.title(head[0], stream.read(min(size, 4096))))
                    stream.seek(offset + 9 + size)
                else:
                    stream.seek(size, 1)
        self.log.notes += not_taken(list(dict.fromkeys(self.attached))[:20], "no messages")

    def cut(self, offset: int) -> None:
        """Handle a file cut by a crash of its recorder; earlier records are whole."""
        if not self.channels:
            raise self.error("ends before its first message")
        rest = self.size - offset
        reason = (
            f"{self.path.name} ends in the middle of a record, as after a crash of its recorder"
        )
        self.log.notes += not_taken([f"the last {rest} bytes"], reason)

    def understood(self, kind: int, record: bytes, offset: int) -> None:
        """Process one record; errors state its position."""
        try:
            if kind == _CHUNK:
                self.chunk(record)
            else:
                self.record(kind, record)
        except (struct.error, UnicodeDecodeError):
            raise self.error(f"a damaged record at byte {offset}") from None

    def record(self, kind: int, record: bytes) -> None:
        """Process a schema, a channel or a message; other records do not concern columns."""
        if kind == _MESSAGE:
            channel, _, log_ns = struct.unpack_from("<HIQ", record)
            if channel not in self.channels:
                raise self.error(f"a message of channel {channel}, which is not defined")
            message = record[22:] if self.unpack is None else self.unpack(record[22:])
            self.channels[channel].add(message, nanoseconds(log_ns, self.path))
        elif kind == _CHANNEL:
            self.channel(record)
        elif kind == _SCHEMA:
            number = struct.unpack_from("<H", record)[0]
            name, offset = _text(record, 2)
            language, offset = _text(record, offset)
            (length,) = struct.unpack_from("<I", record, offset)
            self.schemas[number] = _Schema(name, language, record[offset + 4 : offset + 4 + length])

    def channel(self, record: bytes) -> None:
        """Add a topic with its decoder."""
        number, schema_number = struct.unpack_from("<HH", record)
        name, offset = _text(record, 4)
        encoding, offset = _text(record, offset)
        schema = self.schemas.get(schema_number, _Schema("", "", b""))
        reason = f"messages in {encoding[:20]!r} are not read"
        kind = schema.name or encoding
        self.channels[number] = self.log.topic(name, kind, self._decoder(encoding, schema), reason)

    def _decoder(self, encoding: str, schema: _Schema) -> Callable[[], Decoder | None]:
        def decoder() -> Decoder | None:
            if encoding == "json":
                return decode_json
            language = _ROS.get((encoding, schema.language))
            if language is None and encoding in ("cdr", "ros1") and not schema.text:
                language = "msg"
            if language is None:
                return None
            text = schema.text.decode(errors="replace")
            message_encoding: Encoding = "ros1" if encoding == "ros1" else "cdr"
            return ros_decoder(schema.name, text, language, message_encoding, self.path)

        return decoder

    def chunk(self, record: bytes) -> None:
        """Process the records of a chunk after a check of its checksum."""
        claimed, checksum = struct.unpack_from("<QI", record, 16)
        method, offset = _text(record, 28)
        (size,) = struct.unpack_from("<Q", record, offset)
        content = record[offset + 8 : offset + 8 + size]
        if claimed > LARGEST_PART or len(content) < size:
            raise self.error(f"a chunk that claims {max(claimed, size)} bytes")
        content = decompressed(content, method, self.path, claimed)
        if len(content) != claimed or (checksum and zlib.crc32(content) != checksum):
            raise self.error("a chunk's checksum is not that of its content")
        for kind, inner in _records(content):
            self.record(kind, inner)

    def title(self, kind: int, record: bytes) -> str:
        """The name of an attachment or a piece of metadata."""
        try:
            name, _ = _text(record, 16 if kind == _ATTACHMENT else 0)
        except (struct.error, UnicodeDecodeError):
            name = "?"
        kind_name = "attachment" if kind == _ATTACHMENT else "metadata"
        return f"{kind_name} {name[:60]!r}"

    def error(self, problem: str) -> InputError:
        return InputError(problem, file=self.path, expected=_EXPECTED)


def _records(content: bytes) -> Iterator[tuple[int, bytes]]:
    """The consecutive records in the content of a chunk."""
    offset, end = 0, len(content)
    head = struct.Struct("<BQ")
    while offset < end:
        kind, size = head.unpack_from(content, offset)
        offset += 9
        if size > end - offset:
            raise struct.error
        yield kind, content[offset : offset + size]
        offset += size


def _text(record: bytes, offset: int) -> tuple[str, int]:
    """A text preceded by its length, and the position after it."""
    (length,) = struct.unpack_from("<I", record, offset)
    end = offset + 4 + length
    if end > len(record):
        raise struct.error
    return record[offset + 4 : end].decode(), end


SOURCE = Source("an MCAP log (.mcap)", recognises, read)
