"""The databases (.db3) in which ROS 2 records messages, by Python's own sqlite3."""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.not_taken import not_taken
from armimpedance.recordings.messages.ros_topics import ros_decoder
from armimpedance.recordings.messages.topics import Decoder, Log, Topic, Unpack, nanoseconds

MAGIC: Final = b"SQLite format 3\x00"
_EXPECTED: Final = "a database of ROS 2 with the tables topics and messages"


def add_ros2_database(log: Log, path: Path, unpack: Unpack | None = None) -> None:
    """Add the messages of a database to a log.

    Parameters
    ----------
    unpack : callable, optional
        Where each message is compressed.

    Raises
    ------
    InputError
    """
    waiting = path.with_name(path.name + "-wal")
    if waiting.exists() and waiting.stat().st_size:
        why = "its recorder was stopped hard; opening the database with sqlite3 once takes it in"
        log.notes += not_taken([waiting.name], why)
    try:
        base = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
        base.text_factory = lambda text: text.decode(errors="replace")
        try:
            base.execute("PRAGMA trusted_schema = OFF")
            _add(log, path, base, unpack)
        finally:
            base.close()
    except (sqlite3.Error, OverflowError, UnicodeError) as error:
        problem = f"the database cannot be read: {str(error)[:100]}"
        raise InputError(problem, file=path, expected=_EXPECTED) from None


def _add(log: Log, path: Path, base: sqlite3.Connection, unpack: Unpack | None) -> None:
    # A view under such a name could compute for ever.
    found = base.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
    tables = {row[0] for row in found}
    if not {"topics", "messages"} <= tables:
        raise InputError("has no tables topics and messages", file=path, expected=_EXPECTED)
    told: dict[str, tuple[str, str]] = {}
    if "message_definitions" in tables:
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        told = {str(row[0]): (str(row[1]), str(row[2])) for row in base.execute(query)}
    query = "SELECT id, name, type, serialization_format FROM topics"
    topics = {row[0]: _topic(log, path, row, told) for row in base.execute(query)}
    for number, time_ns, data in base.execute("SELECT topic_id, timestamp, data FROM messages"):
        if number not in topics or type(time_ns) is not int or not isinstance(data, bytes):
            raise InputError("a damaged row of messages", file=path, expected=_EXPECTED)
        message = data if unpack is None else unpack(data)
        topics[number].add(message, nanoseconds(time_ns, path))


def _topic(log: Log, path: Path, row: tuple[Any, ...], told: dict[str, tuple[str, str]]) -> Topic:
    name, kind, encoding = (str(value) for value in row[1:])

    def decoder() -> Decoder | None:
        if encoding != "cdr":
            return None
        language, text = told.get(kind, ("ros2msg", ""))
        return ros_decoder(kind, text, "idl" if language == "ros2idl" else "msg", "cdr", path)

    return log.topic(name, kind, decoder, f"messages in {encoding[:20]!r} are not read")
