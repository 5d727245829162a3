"""Where packets come from: a file or pipe, UDP, Lab Streaming Layer, a recorded session."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from typing import Any, BinaryIO, Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.extras import needed
from armimpedance.core.records import Recording
from armimpedance.muscles.live.packets import LONGEST
from armimpedance.muscles.live.updates import Live

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
    found = pylsl.resolve_byprop("name", name, timeout=_PATIENCE_S)
    n, m = live.form.joints, len(live.muscles)
    if not found:
        raise InputError(f"no stream of the name {name}", expected=f"one within {_PATIENCE_S:g} s")
    if found[0].channel_count() != n + m:
        problem = f"the stream {name} has {found[0].channel_count()} channels"
        raise InputError(problem, expected=f"{n} joint angles (rad) and {m} of muscles")
    inlet = pylsl.StreamInlet(found[0])
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
