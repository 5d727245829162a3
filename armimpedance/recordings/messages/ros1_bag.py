"""The records of a ROS 1 bag (format 2.0), in the order of the file: no index is needed.

A bag that a crash left without an index reads like any other. The package rosbags reads bags by
their index, and believes the sizes in it.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO, Final

from armimpedance.core.errors import InputError
from armimpedance.core.not_taken import not_taken
from armimpedance.recordings.messages.compression import LARGEST_PART, decompressed
from armimpedance.recordings.messages.ros_topics import ros_decoder
from armimpedance.recordings.messages.topics import Decoder, Log, Topic, nanoseconds

MAGIC: Final = b"#ROSBAG V"
_VERSION: Final = b"#ROSBAG V2.0\n"
_MESSAGE, _HEADER, _INDEX, _CHUNK, _CHUNK_INFO, _CONNECTION = 2, 3, 4, 5, 6, 7
_EXPECTED: Final = "a whole ROS bag of version 2.0"


class _CutError(Exception):
    """The file ends in the middle of a record."""


def add_ros1_bag(log: Log, path: Path) -> None:
    """Add the messages of a bag to a log.

    Raises
    ------
    InputError
    """
    _Reading(log, path).all()


class _Reading:
    """One pass through a bag: connections are known when their messages come."""

    def __init__(self, log: Log, path: Path) -> None:
        self.log, self.path = log, path
        self.size = path.stat().st_size
        self.topics: dict[int, Topic] = {}

    def all(self) -> None:
        """Read to the end, or to where the file is cut."""
        with self.path.open("rb") as stream:
            if stream.read(len(_VERSION)) != _VERSION:
                raise self.error("is no bag of version 2.0")
            place = stream.tell()
            try:
                while place < self.size:
                    header, data = self.next(stream)
                    self.understood(header, data, place)
                    place = stream.tell()
            except _CutError:
                self.cut(place)

    def next(self, stream: BinaryIO) -> tuple[bytes, bytes]:
        """Header and data of the next record."""
        parts = []
        for _ in range(2):
            head = stream.read(4)
            size = struct.unpack("<I", head)[0] if len(head) == 4 else self.size
            if size > self.size - stream.tell():
                raise _CutError
            if size > LARGEST_PART:
                raise self.error(f"a record of {size} bytes at byte {stream.tell()}")
            parts.append(stream.read(size))
        return parts[0], parts[1]

    def cut(self, place: int) -> None:
        """The recorder was stopped hard: what stands before is whole."""
        if not self.topics:
            raise self.error("ends before its first message")
        why = f"{self.path.name} ends in the middle of a record, as after a crash of its recorder"
        self.log.notes += not_taken([f"the last {self.size - place} bytes"], why)

    def understood(self, header: bytes, data: bytes, place: int) -> None:
        """One record of the file; an error names where it stands."""
        try:
            fields = _fields(header)
            if fields.get(b"op") == bytes([_CHUNK]):
                method = fields[b"compression"].decode()
                size = min(struct.unpack("<I", fields[b"size"])[0], LARGEST_PART)
                content = decompressed(data, method, self.path, size)
                if len(content) != size:
                    raise self.error(f"a chunk at byte {place} is not as long as it says")
                for inner, message in _records(content):
                    self.record(_fields(inner), message)
            else:
                self.record(fields, data)
        except (struct.error, KeyError, UnicodeDecodeError):
            raise self.error(f"a damaged record at byte {place}") from None

    def record(self, fields: Mapping[bytes, bytes], data: bytes) -> None:
        """A connection or a message; others tell nothing of columns."""
        kind = fields[b"op"][0] if fields[b"op"] else 0
        if kind == _MESSAGE:
            (connection,) = struct.unpack("<I", fields[b"conn"])
            sec, nanosec = struct.unpack("<II", fields[b"time"])
            if connection not in self.topics:
                raise self.error(f"a message of connection {connection}, which is not defined")
            time_ns = nanoseconds(sec * 1_000_000_000 + nanosec, self.path)
            self.topics[connection].add(data, time_ns)
        elif kind == _CONNECTION:
            (connection,) = struct.unpack("<I", fields[b"conn"])
            if connection not in self.topics:
                self.topics[connection] = self.topic(fields[b"topic"].decode(), _fields(data))
        elif kind == _HEADER and fields.get(b"encryptor"):
            raise self.error("is encrypted")
        elif kind not in (_HEADER, _INDEX, _CHUNK_INFO):
            raise self.error(f"a record of unknown kind {kind}")

    def topic(self, name: str, told: Mapping[bytes, bytes]) -> Topic:
        """The topic of a connection; several connections may be one topic."""
        kind = told[b"type"].decode()
        text = told.get(b"message_definition", b"").decode(errors="replace")

        def decoder() -> Decoder:
            return ros_decoder(kind, text, "msg", "ros1", self.path)

        return self.log.topic(name, kind, decoder, "")

    def error(self, problem: str) -> InputError:
        return InputError(problem, file=self.path, expected=_EXPECTED)


def _records(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Headers and data of the records in a chunk."""
    place, end = 0, len(content)
    while place < end:
        parts = []
        for _ in range(2):
            (size,) = struct.unpack_from("<I", content, place)
            place += 4 + size
            if place > end:
                raise struct.error
            parts.append(content[place - size : place])
        yield parts[0], parts[1]


def _fields(header: bytes) -> dict[bytes, bytes]:
    """The fields ``name=value`` of a header."""
    place, end = 0, len(header)
    found = {}
    while place < end:
        (size,) = struct.unpack_from("<I", header, place)
        place += 4 + size
        if place > end:
            raise struct.error
        name, _, value = header[place - size : place].partition(b"=")
        found[name] = value
    return found
