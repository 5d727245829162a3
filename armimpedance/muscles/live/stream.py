"""Packets from a file, a pipe, UDP, LSL or a session; one line of results for each sample."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO, Final

import numpy as np

from armimpedance.core.errors import ArmImpedanceError, InputError, needed, shortened
from armimpedance.core.json_text import is_number
from armimpedance.core.records import Recording
from armimpedance.muscles.live.updates import Live

# A packet of a stream as the arguments of an update, whatever somebody has sent.
#
# A packet is one JSON object in UTF-8: ``time_s``, ``q_rad`` or ``hand_m``, one number a muscle
# (null where its channel dropped out), and where there are any ``force_N``, ``displacement_m`` and
# ``signal_sd``. ``{"reset": true}`` begins anew.

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

    `signal`: name of the field with the muscles' activity, such as "activation".
    Returns: None: the stream begins anew.
    Raises InputError: a packet that cannot be taken; fields that are not known do no harm.
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
    numbers = fields.get(name)
    if numbers is None:
        raise InputError(f"a packet without {name}", expected="one number a muscle")
    if isinstance(numbers, list) and None in numbers:
        numbers = [_LOST if value is None else value for value in numbers]
        if all(value is _LOST or is_number(value) for value in numbers):
            return numbers
    return _numbers(numbers, name)


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


#: Nobody but this machine can send there.
LOOPBACK: Final = "127.0.0.1"
#: Bytes of datagrams that may wait, some thirty of six muscles: who cannot keep up loses some,
#: which is flagged, rather than to speak of what was long ago.
WAITING: Final = LONGEST
#: What a name of a stream of the Lab Streaming Layer begins with.
LSL: Final = "lsl:"
#: So long such a stream is looked for (s).
_PATIENCE_S: Final = 10.0


def packets_of(
    live: Live, source: BinaryIO | int | tuple[str, int] | str | Recording
) -> Iterator[bytes]:
    """The packets of a source, in the form that `serve` takes.

    Parameters
    ----------
    live : Live
        What they are for.
    source : binary file, int, (str, int), str or Recording
        Lines of JSON; a UDP port of the loopback, or an address and a port; ``"lsl:NAME"``, a
        stream of the Lab Streaming Layer whose channels are the joint angles and then the muscles;
        or a recorded session, which comes as the packets that would have brought it.

    Returns
    -------
    iterator of bytes
        Those of UDP and of the Lab Streaming Layer do not end.

    Raises
    ------
    InputError
        What the packets need is not there.
    OSError
        The port cannot be had.
    """
    if isinstance(source, Recording):
        return _played(source, live)
    if isinstance(source, str):
        return _inlet(source.removeprefix(LSL), live)
    if isinstance(source, int):
        return _datagrams(LOOPBACK, source)
    if isinstance(source, tuple):
        return _datagrams(*source)
    return _lines(source)


def _lines(stream: BinaryIO) -> Iterator[bytes]:
    """The lines of a stream; of one that is too long only the part that shows it."""
    while line := stream.readline(LONGEST + 2):
        yield line
        while len(line) > LONGEST + 1 and not line.endswith(b"\n"):
            # what is left of it is read and dropped
            line = stream.readline(LONGEST + 2) or b"\n"


def _datagrams(host: str, port: int) -> Iterator[bytes]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as door:
        door.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, WAITING)
        door.bind((host, port))
        while True:
            yield door.recv(LONGEST + 1)


def _inlet(name: str, live: Live) -> Iterator[bytes]:
    """Samples of a stream of the Lab Streaming Layer; NaN there is a channel that dropped out."""
    pylsl = needed("pylsl", "lsl", f"{LSL}{name}")
    streams = pylsl.resolve_byprop("name", name, timeout=_PATIENCE_S)
    n, m = live.form.joints, len(live.muscles)
    if not streams:
        raise InputError(f"no stream of the name {name}", expected=f"one within {_PATIENCE_S:g} s")
    if streams[0].channel_count() != n + m:
        problem = f"the stream {name} has {streams[0].channel_count()} channels"
        raise InputError(problem, expected=f"{n} joint angles (rad) and {m} of muscles")
    inlet = pylsl.StreamInlet(streams[0])
    while True:
        sample, stamp = inlet.pull_sample()
        values = [v if abs(v) < np.inf else None for v in sample]
        yield _packet({"time_s": stamp, "q_rad": values[:n], live.signal: values[n:]})


def _played(recording: Recording, live: Live) -> Iterator[bytes]:
    """A recorded session, trial by trial; each begins anew."""
    columns = [_column(recording, name) for name in live.muscles]
    emg = np.asarray(recording.emg)[:, columns]
    name, posture = _postures(recording)
    pushed = recording.force if recording.kind == "hand" else None
    for row in range(recording.n_trials):
        yield _packet({"reset": True})
        for k in range(recording.offsets[row], recording.offsets[row + 1]):
            packet = {
                "time_s": float(recording.time_s[k]),
                name: posture[k].tolist(),
                live.signal: emg[k].tolist(),
            }
            if pushed is not None:
                packet["force_N"] = pushed[k].tolist()
            yield _packet(packet)


def _postures(recording: Recording) -> tuple[str, Any]:
    """Name of the field, and the postures (N, .)."""
    if recording.joint_angles is not None:
        return "q_rad", recording.joint_angles
    if recording.kind == "joint":
        return "q_rad", recording.position
    if recording.shoulder_m is None:
        raise InputError("no posture in the recording", expected="joint angles, or shoulder_m")
    return "hand_m", recording.position - recording.shoulder_m


def _column(recording: Recording, muscle: str) -> int:
    if muscle not in recording.muscles or recording.emg is None:
        raise InputError(f"no EMG of {muscle} in the recording", expected="a column of each muscle")
    return recording.muscles.index(muscle)


def _packet(content: dict[str, Any]) -> bytes:
    return json.dumps(content).encode()


# Packets in, one line a sample out; what cannot be taken is told and left out.

#: So many refusals are told one by one; then every time that their number has doubled.
TOLD: Final = 20


@dataclass
class Served:
    """Counts of a stream's packets.

    `taken`, `refused`: packets.
    `extrapolating`, `indefinite`, `flagged`: samples among the taken ones.
    """

    taken: int = 0
    refused: int = 0
    extrapolating: int = 0
    indefinite: int = 0
    flagged: int = 0

    def __str__(self) -> str:
        parts = [f"{self.taken} samples", f"{self.refused} refused"]
        counts = {
            "extrapolating": self.extrapolating,
            "not definite": self.indefinite,
            "flagged": self.flagged,
        }
        return ", ".join(parts + [f"{count} {name}" for name, count in counts.items() if count])


def serve(
    live: Live,
    packets: Iterable[bytes],
    write: Callable[[str], bool],
    refuse: Callable[[str], object],
) -> Served:
    """Update for each packet and write the result, until there are no more or the listener is gone.

    Parameters
    ----------
    live : Live
    packets : iterable of bytes
    write : callable
        Takes a line without its end; False: nobody listens any more.
    refuse : callable
        Told in one line why a packet was not taken.

    Returns
    -------
    Served
    """
    served = Served()
    for packet in packets:
        if not packet.strip():
            continue
        try:
            arguments = parsed(packet, live.signal)
            if arguments is None:
                live.reset()
                continue
            result = live.update(**arguments)
        except ArmImpedanceError as error:
            served.refused += 1
            count = served.refused
            if count <= TOLD or count & (count - 1) == 0:
                refuse(f"packet {served.taken + count} refused ({count} so far): {error}")
            continue
        served.taken += 1
        served.extrapolating += result.extrapolating
        served.indefinite += not result.definite
        served.flagged += bool(result.flags)
        if not write(json.dumps(result.to_dict(), allow_nan=False)):
            break
    return served
