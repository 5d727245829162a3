"""Topics of a log as tables of columns, and the decoders of ROS messages."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.errors import InputError, needed
from armimpedance.core.findings import not_taken
from armimpedance.recordings.mapped.raw_file import RawColumn, RawFile, RawRun, RawTable, Wanted
from armimpedance.recordings.messages.decoding import (
    Block,
    Encoding,
    decode,
    joined_numbers,
    joined_texts,
)
from armimpedance.recordings.messages.definitions import (
    DefinitionError,
    Definitions,
    definitions_of_package,
    definitions_of_text,
    short_name,
)
from armimpedance.recordings.reading import can_be_shown, shown_name, some_names

#: Decodes messages into the wanted columns.
Decoder = Callable[[Sequence[bytes], Wanted], Block]

#: Decompresses one message.
Unpack = Callable[[bytes], bytes]

#: The most messages and bytes in a block that is decoded at once.
_BLOCK_ROWS: Final = 2048
_BLOCK_BYTES: Final = 8_000_000
#: The most numbers in all topics together, 500 MB.
_MOST_NUMBERS: Final = 62_500_000
_LATEST_NS: Final = 2**63 - 1

#: Units of the standard messages (ROS's conventions, REP 103), by the end of a path.
_UNITS: Final = (
    (re.compile(r"(^|\.)force\.[xyz]$"), "N"),
    (re.compile(r"(^|\.)torque\.[xyz]$"), "N m"),
    (re.compile(r"(^|\.)(position|translation)\.[xyz]$"), "m"),
    (re.compile(r"(^|\.)twist\.linear\.[xyz]$"), "m/s"),
    (re.compile(r"(^|\.)(twist\.angular|angular_velocity)\.[xyz]$"), "rad/s"),
    (re.compile(r"(^|\.)(accel\.linear|linear_acceleration)\.[xyz]$"), "m/s^2"),
)
_OF_UNITS: Final = ("geometry_msgs/", "nav_msgs/", "sensor_msgs/Imu")


@dataclass
class LogTopic:
    """The messages of one topic.

    `decode`: the decoder; None: messages of this kind are not read.
    `problem`: the reason for which the topic is not taken; "" if it is taken.
    `numbers`: the number of decoded numbers.
    """

    name: str
    type: str
    decode: Decoder | None
    wanted: Wanted
    problem: str = ""
    numbers: int = 0
    log_ns: list[int] = field(default_factory=list)
    _wanted_paths: dict[str, bool] = field(default_factory=dict)
    _waiting: list[bytes] = field(default_factory=list)
    _bytes: int = 0
    _blocks: list[Block] = field(default_factory=list)

    def add(self, message: bytes, log_ns: int) -> None:
        """Add a message, logged at this time."""
        if self.problem or self.decode is None:
            return
        self._waiting.append(message)
        self._bytes += len(message)
        self.log_ns.append(log_ns)
        if len(self._waiting) >= _BLOCK_ROWS or self._bytes >= _BLOCK_BYTES:
            self.settle()

    def settle(self) -> None:
        """Decode the waiting messages."""
        if not self._waiting or self.decode is None:
            return
        try:
            block = self.decode(self._waiting, self._wants)
        except DefinitionError as error:
            self.problem = str(error)
            self._blocks.clear()
        else:
            self._blocks.append(block)
            self.numbers += len(block.numbers) * block.rows
        if self.numbers > _MOST_NUMBERS:
            self.problem = f"more than {_MOST_NUMBERS} numbers"
            self._blocks.clear()
        self._waiting, self._bytes = [], 0

    def _wants(self, path: str) -> bool:
        if path not in self._wanted_paths:
            self._wanted_paths[path] = self.wanted(f"{self.name}.{path}")
        return self._wanted_paths[path]

    @property
    def unwanted(self) -> list[str]:
        """Names of columns that are not wanted."""
        return [f"{self.name}.{path}" for path, wanted in self._wanted_paths.items() if not wanted]

    @property
    def rounded(self) -> set[str]:
        """Names of columns with integers too large for float64."""
        return {f"{self.name}.{path}" for block in self._blocks for path in block.rounded}

    @property
    def long(self) -> set[str]:
        """Names of arrays and texts that are too long for columns."""
        return {f"{self.name}.{path}" for block in self._blocks for path in block.long}

    def times(self) -> tuple[NDArray[np.int64], str]:
        """The time of each message in ns, and the name of the clock."""
        stamps = [block.stamp_ns for block in self._blocks]
        measured = np.concatenate(stamps) if stamps else np.empty(0, np.int64)
        if len(measured) and (measured > 0).all():
            return measured, "stamp of the message"
        return np.array(self.log_ns, np.int64), "log time"

    def columns(self) -> dict[str, RawColumn]:
        """Path -> column, in the order of appearance; may be called once."""
        rows = len(self.log_ns)
        starts = np.cumsum([0] + [block.rows for block in self._blocks])
        paths: dict[str, None] = {}
        for block in self._blocks:
            paths |= dict.fromkeys([*block.numbers, *block.texts])
        # A text that is too long in one message is not a column for the others.
        long = set().union(*(block.long for block in self._blocks))
        paths = {path: None for path in paths if path not in long}
        stated = self.type.startswith(_OF_UNITS)
        columns = {}
        for path in paths:
            numbers = [
                (at + start, values)
                for block, start in zip(self._blocks, starts, strict=False)
                for at, values in block.numbers.pop(path, ())
            ]
            texts = [
                (at + start, values)
                for block, start in zip(self._blocks, starts, strict=False)
                for at, values in block.texts.pop(path, ())
            ]
            values = joined_numbers(numbers, rows) if numbers else joined_texts(texts, rows)
            if numbers and texts:
                self.problem = f"{path} is a number in some messages and a text in others"
            columns[path] = RawColumn(values, _unit(path) if stated else None)
        return columns


def _unit(path: str) -> str | None:
    return next((unit for pattern, unit in _UNITS if pattern.search(path)), None)


@dataclass
class Log:
    """The topics of one or several files."""

    file: Path
    wanted: Wanted
    topics: dict[tuple[str, str], LogTopic] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def topic(
        self, name: str, kind: str, decode: Callable[[], Decoder | None], why: str
    ) -> LogTopic:
        """The topic of this name and type, created if it is new.

        `decode`: makes its decoder; None or `DefinitionError` where its messages cannot be read.
        `why`: the reason for which they cannot be read, where the decoder is None.
        """
        key = (name, kind)
        if key in self.topics:
            return self.topics[key]
        shown = shown_name(name)
        if any(topic.name == shown for topic in self.topics.values()):
            shown = shown_name(f"{shown} ({kind}) {len(self.topics)}")
        try:
            decoder, problem = decode(), why
        except DefinitionError as error:
            decoder, problem = None, str(error)
        problem = "" if decoder is not None else problem
        self.topics[key] = LogTopic(shown, kind, decoder, self.wanted, problem)
        return self.topics[key]

    def raw_file(self) -> RawFile:
        """The tables of all topics as one run, and sentences on anything not taken.

        Raises InputError: no topic holds numbers, or there are too many for memory.
        """
        for topic in self.topics.values():
            topic.settle()
        if sum(topic.numbers for topic in self.topics.values()) > _MOST_NUMBERS:
            problem = f"more than {_MOST_NUMBERS} numbers in one run"
            raise InputError(problem, file=self.file, expected="fewer topics or a shorter record")
        with_messages = {
            t.name: (t, t.columns(), t.times()) for t in self.topics.values() if t.log_ns
        }
        kept = {name: parts for name, parts in with_messages.items() if not parts[0].problem}
        start = min((int(ns.min()) for _, _, (ns, _) in kept.values()), default=0)
        unshowable: list[str] = []
        tables, facts = [], {}
        for name, (_, columns, (ns, clock)) in kept.items():
            facts[f"clock of {name}"] = clock
            tables.append(_table(name, columns, ns, start, unshowable))
        if kept:
            facts["start"] = _moment(start)
        run = RawRun(name=str(self.file), tables=tuple(t for t in tables if t.columns), facts=facts)
        return RawFile(runs=(run,), not_taken=(*self.notes, *self._left(unshowable)))

    def _left(self, unshowable: list[str]) -> tuple[str, ...]:
        """Sentences on content of the file that is not in the tables."""
        reasons: dict[str, list[str]] = {}
        for topic in self.topics.values():
            if topic.problem:
                reason = shown_name(topic.problem)
                kind = f" ({shown_name(topic.type)})" if topic.type else ""
                reasons.setdefault(reason, []).append(topic.name + kind)
        topics = list(self.topics.values())
        long = sorted(shown_name(name) for t in topics if not t.problem for name in t.long)
        rounded = sorted(shown_name(n) for t in topics if not t.problem for n in t.rounded)
        unwanted = [shown_name(name) for t in topics if not t.problem for name in t.unwanted]
        reasons["the mapping gives them no meaning"] = unwanted
        reasons["arrays or texts too long for columns"] = long
        reasons["digits of whole numbers beyond 2^53"] = rounded
        reasons["names that cannot be shown"] = unshowable
        return tuple(
            s for reason, names in reasons.items() for s in not_taken(some_names(names), reason)
        )


def _table(
    name: str,
    columns: Mapping[str, RawColumn],
    ns: NDArray[np.int64],
    start: int,
    unshowable: list[str],
) -> RawTable:
    """A topic's columns under their full names, sorted by time."""
    order = np.argsort(ns, kind="stable")
    in_order = bool((order == np.arange(len(order))).all())
    named = {}
    for path, column in columns.items():
        full = f"{name}.{path}"
        if not can_be_shown(full):
            unshowable.append(shown_name(full))
            continue
        values = column.values if in_order else column.values[order]
        named[full] = RawColumn(values, column.unit)
    # Integer nanoseconds are subtracted first: a float of the time since 1970 resolves only 0.2 us.
    return RawTable(named, time_s=(ns[order] - start) / 1e9)


def _moment(ns: int) -> str:
    """A time since 1970 in ISO 8601."""
    whole_second = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=ns // 1_000_000_000)
    return f"{whole_second:%Y-%m-%dT%H:%M:%S}.{ns % 1_000_000_000:09d}Z"


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Raise the system's errors on reading a file as errors of the input."""
    try:
        yield
    except OSError as error:
        problem = f"cannot be read: {error.strerror or 'damaged'}"
        raise InputError(problem, file=path, expected="a log") from None


def nanoseconds(value: int, file: Path) -> int:
    """Check a time from a file, in ns.

    Raises InputError: it is beyond the year 2262.
    """
    if not 0 <= value <= _LATEST_NS:
        raise InputError("a message of a time beyond the year 2262", file=file, expected="ns")
    return value


# Decoders of ROS messages, from the definition in the file or ROS's standard definition.


def ros_decoder(kind: str, text: str, language: str, encoding: Encoding, file: Path) -> Decoder:
    """The decoder of a topic.

    `kind`: the message's type, such as "geometry_msgs/msg/Wrench".
    `text`: its definition; "" where the file has none.
    `language`: of the definition.
    `file`: for messages.
    Raises DefinitionError: the type has no definition, or it cannot be parsed.
    """
    name = short_name(kind)
    if not text.strip() and language == "msg" and name != "std_msgs/Empty":
        known = standard_definitions(file)
        if name not in known:
            raise DefinitionError("its type is not one of ROS's own and has no definition here")
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
    """ROS's standard messages, for logs that hold no definitions.

    Raises InputError: the package rosbags is not installed.
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
        # The package's parser raises many kinds of errors.
        raise DefinitionError("its definition (IDL) is not understood") from None
