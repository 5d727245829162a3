"""A session as the log of a robot that speaks ROS 2, or JSON: an MCAP file."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final, Literal

import numpy as np

from armimpedance.core.outputs import staged_file
from armimpedance.core.records import Recording
from manipulandum_sim.lab_files.trial_columns import TrialColumns, trials_of

#: When the simulated sessions take place: noon of the first of May 2024, in ns since 1970.
START_NS: Final = 1_714_564_800_000_000_000
#: Between two trials.
PAUSE_NS: Final = 1_000_000_000

_RULE: Final = "=" * 80
_HEADER: Final = f"""\
{_RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_VECTOR: Final = f"{_RULE}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
_WRENCH: Final = f"""\
std_msgs/Header header
Wrench wrench
{_HEADER}{_RULE}
MSG: geometry_msgs/Wrench
Vector3 force
Vector3 torque
{_VECTOR}"""
_POSE: Final = f"""\
std_msgs/Header header
Pose pose
{_HEADER}{_RULE}
MSG: geometry_msgs/Pose
Point position
Quaternion orientation
{_RULE}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
{_RULE}
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
"""


def write_mcap(
    recording: Recording,
    path: Path,
    *,
    style: Literal["ros2", "json"] = "ros2",
    compression: Literal["zstd", "lz4", "none"] = "zstd",
) -> None:
    """Write a session of the hand as one MCAP log, its trials one after another.

    Parameters
    ----------
    recording : Recording
        Of the hand, with two or three axes.
    path : Path
        The file.
    style : {"ros2", "json"}
        "ros2": the topics ``/ft_sensor/wrench`` (the force of the limb on the robot, N),
        ``/robot/pose`` (m), ``/trial`` (number, condition, whether the disturbance is on, and what
        else is known of the trial) and ``/signals`` (further columns of the samples), in CDR, all
        with the robot's stamps. "json": one topic ``/hand`` with an object for each sample, whose
        ``time_s`` and ``onset_s`` count from the start of the trial.
    compression : {"zstd", "lz4", "none"}
        Of the file's chunks.
    """
    from mcap.writer import CompressionType, Writer

    method = CompressionType[compression.upper()]
    with staged_file(path) as staged, staged.open("wb") as stream:
        writer = Writer(stream, compression=method)
        writer.start(profile="ros2" if style == "ros2" else "", library="manipulandum_sim")
        channels: dict[str, int] = {}
        topics = _ros_topics(recording) if style == "ros2" else {"/hand": _JSON}
        for topic, (name, language, text) in topics.items():
            schema = writer.register_schema(name, language, text.encode())
            encoding = "cdr" if style == "ros2" else "json"
            channels[topic] = writer.register_channel(topic, encoding, schema)
        messages = _ros_messages(recording) if style == "ros2" else _json_messages(recording)
        for count, (topic, time_ns, data) in enumerate(messages):
            writer.add_message(channels[topic], time_ns, data, time_ns, count)
        writer.finish()


_JSON: Final = ("hand", "jsonschema", '{"type": "object"}')


def _ros_topics(recording: Recording) -> dict[str, tuple[str, str, str]]:
    """Topic -> name of its messages, language, definition."""
    first = next(trials_of(recording))
    signals, known = _signals(first), _numbers(_all_facts(recording))
    trial = ["std_msgs/Header header", "int32 number", "bool disturbance", "string condition"]
    trial += [f"float64 {name.lower()}" for name in known]
    topics = {
        "/ft_sensor/wrench": ("geometry_msgs/msg/WrenchStamped", "ros2msg", _WRENCH),
        "/robot/pose": ("geometry_msgs/msg/PoseStamped", "ros2msg", _POSE),
        "/trial": ("lab_msgs/msg/Trial", "ros2msg", _own(trial)),
    }
    if signals:
        fields = ["std_msgs/Header header", *(f"float64 {name.lower()}" for name in signals)]
        topics["/signals"] = ("lab_msgs/msg/Signals", "ros2msg", _own(fields))
    return topics


def _own(fields: list[str]) -> str:
    """The definition of a laboratory's own message."""
    return "\n".join(fields) + "\n" + _HEADER


def _ros_messages(recording: Recording) -> Iterator[tuple[str, int, bytes]]:
    axes = "xyz"[: recording.axes]
    known = _numbers(_all_facts(recording))
    for trial, times in _with_times(recording):
        force = _padded(trial, [f"f{a}_N" for a in axes], 6)
        place = _padded(trial, [f"{a}_m" for a in axes], 7)
        # Nothing turns: the quaternion of no rotation.
        place[:, 6] = 1.0
        signals = _signals(trial)
        others = np.column_stack([trial.columns[n] for n in signals]) if signals else None
        facts = struct.pack(f"<{len(known)}d", *(float(trial.facts.get(n, np.nan)) for n in known))
        text = trial.condition.encode() + b"\x00"
        told = [
            struct.pack("<i?xxxI", trial.number, on, len(text)) + text for on in _disturbed(trial)
        ]
        for i, time_ns in enumerate(times):
            yield "/ft_sensor/wrench", time_ns, _message(time_ns, "ft_sensor", b"", force[i])
            yield "/robot/pose", time_ns, _message(time_ns, "base", b"", place[i])
            yield "/trial", time_ns, _message(time_ns, "", told[i], np.frombuffer(facts))
            if others is not None:
                yield "/signals", time_ns, _message(time_ns, "", b"", others[i])


def _message(time_ns: int, frame: str, middle: bytes, numbers: np.ndarray) -> bytes:
    """A message in CDR: a header, what is between, and float64 numbers at multiples of eight."""
    name = frame.encode() + b"\x00"
    sec, nanosec = divmod(time_ns, 1_000_000_000)
    body = struct.pack("<iII", sec, nanosec, len(name)) + name
    if middle:
        body += bytes(-len(body) % 4) + middle
    if len(numbers):
        body += bytes(-len(body) % 8) + numbers.astype("<f8").tobytes()
    return b"\x00\x01\x00\x00" + body


def _json_messages(recording: Recording) -> Iterator[tuple[str, int, bytes]]:
    for trial, times in _with_times(recording):
        columns = {name: values.tolist() for name, values in trial.columns.items()}
        same = {"trial": trial.number, "condition": trial.condition, **trial.facts}
        for i, time_ns in enumerate(times):
            sec, nanosec = divmod(time_ns, 1_000_000_000)
            message: dict[str, object] = {"timestamp": {"sec": sec, "nsec": nanosec}, **same}
            message |= {name: _json_number(values[i]) for name, values in columns.items()}
            yield "/hand", time_ns, json.dumps(message).encode()


def _json_number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _with_times(recording: Recording) -> Iterator[tuple[TrialColumns, list[int]]]:
    """Each trial and the times of its samples in whole ns."""
    start = START_NS
    for trial in trials_of(recording):
        times = [start + round(t * 1e9) for t in trial.columns["time_s"].tolist()]
        yield trial, times
        start = times[-1] + PAUSE_NS


def _padded(trial: TrialColumns, names: list[str], width: int) -> np.ndarray:
    """These columns, then zeros: a plane robot writes them for what it has not."""
    table = np.zeros((len(trial.columns["time_s"]), width))
    table[:, : len(names)] = np.column_stack([trial.columns[name] for name in names])
    return table


def _signals(trial: TrialColumns) -> list[str]:
    """Columns that are neither time, place nor force."""
    known = ("time_s", "x_m", "y_m", "z_m", "fx_N", "fy_N", "fz_N")
    return [name for name in trial.columns if name not in known]


def _disturbed(trial: TrialColumns) -> list[bool]:
    """True for each sample within the disturbance, after its onset and before its end."""
    time = trial.columns["time_s"]
    onset, end = (float(trial.facts.get(name, np.nan)) for name in ("onset_s", "end_s"))
    # The times of a table may miss their samples by rounding, not by half a step.
    half = 0.5 * float(time[1] - time[0]) if len(time) > 1 else 0.0
    on: list[bool] = ((time > onset + half) & (time < end - half)).tolist()
    return on


def _all_facts(recording: Recording) -> dict[str, float | str]:
    """Names of all facts that any trial has."""
    found: dict[str, float | str] = {}
    for trial in trials_of(recording):
        found |= trial.facts
    return found


def _numbers(facts: Mapping[str, float | str]) -> list[str]:
    # The robot's clock knows no time since the start of a trial.
    clock = ("onset_s", "end_s")
    return [n for n, value in facts.items() if not isinstance(value, str) and n not in clock]
