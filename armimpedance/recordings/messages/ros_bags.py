"""The records of ROS 1 bags and ROS 2 databases in order, decompressed.

The index of a bag is not used, so a bag that a crash left without one can be read. The package
rosbags needs the index and trusts the sizes in it.
"""

from __future__ import annotations

import bz2
import sqlite3
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, Final

from armimpedance.core.errors import InputError, needed
from armimpedance.core.findings import not_taken
from armimpedance.recordings.messages.topics import (
    Decoder,
    Log,
    LogTopic,
    Unpack,
    nanoseconds,
    ros_decoder,
)

# The databases (.db3) in which ROS 2 records messages, by Python's own sqlite3.

MAGIC_OF_DATABASE: Final = b"SQLite format 3\x00"
_EXPECTED_DATABASE: Final = "a database of ROS 2 with the tables topics and messages"


def add_ros2_database(log: Log, path: Path, unpack: Unpack | None = None) -> None:
    """Add the messages of a database to a log.

    `unpack`: decompresses each message; None where messages are not compressed.
    """
    waiting = path.with_name(path.name + "-wal")
    if waiting.exists() and waiting.stat().st_size:
        reason = "its recorder was stopped hard; opening the database with sqlite3 once takes it in"
        log.notes += not_taken([waiting.name], reason)
    try:
        database = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
        database.text_factory = lambda text: text.decode(errors="replace")
        try:
            database.execute("PRAGMA trusted_schema = OFF")
            _add(log, path, database, unpack)
        finally:
            database.close()
    except (sqlite3.Error, OverflowError, UnicodeError) as error:
        problem = f"the database cannot be read: {str(error)[:100]}"
        raise InputError(problem, file=path, expected=_EXPECTED_DATABASE) from None


def _add(log: Log, path: Path, database: sqlite3.Connection, unpack: Unpack | None) -> None:
    # A view with such a name could compute forever.
    listed = database.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
    tables = {row[0] for row in listed}
    if not {"topics", "messages"} <= tables:
        raise InputError(
            "has no tables topics and messages", file=path, expected=_EXPECTED_DATABASE
        )
    definitions: dict[str, tuple[str, str]] = {}
    if "message_definitions" in tables:
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        definitions = {str(row[0]): (str(row[1]), str(row[2])) for row in database.execute(query)}
    query = "SELECT id, name, type, serialization_format FROM topics"
    topics = {row[0]: _topic(log, path, row, definitions) for row in database.execute(query)}
    for number, time_ns, data in database.execute("SELECT topic_id, timestamp, data FROM messages"):
        if number not in topics or type(time_ns) is not int or not isinstance(data, bytes):
            raise InputError("a damaged row of messages", file=path, expected=_EXPECTED_DATABASE)
        message = data if unpack is None else unpack(data)
        topics[number].add(message, nanoseconds(time_ns, path))


def _topic(
    log: Log, path: Path, row: tuple[Any, ...], definitions: dict[str, tuple[str, str]]
) -> LogTopic:
    name, kind, encoding = (str(value) for value in row[1:])

    def decoder() -> Decoder | None:
        if encoding != "cdr":
            return None
        language, text = definitions.get(kind, ("ros2msg", ""))
        return ros_decoder(kind, text, "idl" if language == "ros2idl" else "msg", "cdr", path)

    return log.topic(name, kind, decoder, f"messages in {encoding[:20]!r} are not read")


# Compressed parts of logs, decompressed up to a given size.

#: Larger parts are refused.
LARGEST_PART: Final = 256_000_000


def decompressed(data: bytes, method: str, file: Path, limit: int = LARGEST_PART) -> bytes:
    """Decompress a part of a file.

    `file`: for messages.
    `limit`: more bytes than this are refused.
    Raises InputError: the part is damaged or too large, or its compression is not known or not
    installed.
    """
    if method in ("", "none"):
        return data
    try:
        content = _undone(data, method, file, limit)
    except InputError:
        raise
    except Exception:
        # zstandard, lz4 and bz2 raise different errors.
        raise InputError(
            f"a part compressed with {method} is damaged", file=file, expected="a whole file"
        ) from None
    if len(content) > limit:
        problem = f"a compressed part holds more than {limit} bytes"
        raise InputError(problem, file=file, expected="what it says, in smaller parts")
    return content


def _undone(data: bytes, method: str, file: Path, limit: int) -> bytes:
    if method == "bz2":
        return bz2.BZ2Decompressor().decompress(data, limit + 1)
    if method == "lz4":
        frame = needed("lz4.frame", "ros", file).LZ4FrameDecompressor()
        return bytes(frame.decompress(data, limit + 1))
    if method == "zstd":
        zstd = needed("zstandard", "ros", file)
        # The stream is read up to the limit, whatever size its header states.
        with zstd.ZstdDecompressor(max_window_size=2**27).stream_reader(data) as stream:
            return bytes(stream.read(limit + 1))
    raise InputError(
        f"unknown compression {method[:20]!r}", file=file, expected="zstd, lz4, bz2 or none"
    )


MAGIC_OF_BAG: Final = b"#ROSBAG V"
_VERSION: Final = b"#ROSBAG V2.0\n"
_MESSAGE, _HEADER, _INDEX, _CHUNK, _CHUNK_INFO, _CONNECTION = 2, 3, 4, 5, 6, 7
_EXPECTED: Final = "a whole ROS bag of version 2.0"


class _CutError(Exception):
    """The file ends in the middle of a record."""


def add_ros1_bag(log: Log, path: Path) -> None:
    """Add the messages of a bag to a log."""
    _Reading(log, path).all()


class _Reading:
    """One pass through a bag; connections precede their messages."""

    def __init__(self, log: Log, path: Path) -> None:
        self.log, self.path = log, path
        self.size = path.stat().st_size
        self.topics: dict[int, LogTopic] = {}

    def all(self) -> None:
        """Read to the end, or to the place where the file is cut."""
        with self.path.open("rb") as stream:
            if stream.read(len(_VERSION)) != _VERSION:
                raise self.error("is no bag of version 2.0")
            offset = stream.tell()
            try:
                while offset < self.size:
                    header, data = self.next(stream)
                    self.understood(header, data, offset)
                    offset = stream.tell()
            except _CutError:
                self.cut(offset)

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

    def cut(self, offset: int) -> None:
        """Handle a file cut by a crash of its recorder; earlier records are whole."""
        if not self.topics:
            raise self.error("ends before its first message")
        reason = (
            f"{self.path.name} ends in the middle of a record, as after a crash of its recorder"
        )
        self.log.notes += not_taken([f"the last {self.size - offset} bytes"], reason)

    def understood(self, header: bytes, data: bytes, offset: int) -> None:
        """Process one record of the file; errors state its position."""
        try:
            fields = _fields(header)
            if fields.get(b"op") == bytes([_CHUNK]):
                method = fields[b"compression"].decode()
                size = min(struct.unpack("<I", fields[b"size"])[0], LARGEST_PART)
                content = decompressed(data, method, self.path, size)
                if len(content) != size:
                    raise self.error(f"a chunk at byte {offset} is not as long as it says")
                for inner, message in _records(content):
                    self.record(_fields(inner), message)
            else:
                self.record(fields, data)
        except (struct.error, KeyError, UnicodeDecodeError):
            raise self.error(f"a damaged record at byte {offset}") from None

    def record(self, fields: Mapping[bytes, bytes], data: bytes) -> None:
        """Process a connection or a message; other records do not concern columns."""
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

    def topic(self, name: str, connection: Mapping[bytes, bytes]) -> LogTopic:
        """The topic of a connection; several connections may share one topic."""
        kind = connection[b"type"].decode()
        text = connection.get(b"message_definition", b"").decode(errors="replace")

        def decoder() -> Decoder:
            return ros_decoder(kind, text, "msg", "ros1", self.path)

        return self.log.topic(name, kind, decoder, "")

    def error(self, problem: str) -> InputError:
        return InputError(problem, file=self.path, expected=_EXPECTED)


def _records(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Headers and data of the records in a chunk."""
    offset, end = 0, len(content)
    while offset < end:
        parts = []
        for _ in range(2):
            (size,) = struct.unpack_from("<I", content, offset)
            offset += 4 + size
            if offset > end:
                raise struct.error
            parts.append(content[offset - size : offset])
        yield parts[0], parts[1]


def _fields(header: bytes) -> dict[bytes, bytes]:
    """Parse the fields ``name=value`` of a header."""
    offset, end = 0, len(header)
    fields = {}
    while offset < end:
        (size,) = struct.unpack_from("<I", header, offset)
        offset += 4 + size
        if offset > end:
            raise struct.error
        name, _, value = header[offset - size : offset].partition(b"=")
        fields[name] = value
    return fields
