"""Stiffness of the hand live, from posture and muscle activity, one line a sample.

Examples:
  armimpedance fit muscles postures.csv cocontraction.csv --out arm.json
  armimpedance live arm.json --recording session < samples.jsonl
  armimpedance live arm.json --recording session --udp 5005 --to 5006 --limit 20000
  armimpedance live arm.json --recording session --signal emg --udp 5005
  armimpedance live arm.json --replay session > stiffness.jsonl

A sample is a line of JSON, or a UDP datagram with one: {"time_s": 0.001, "q_rad": [0.9, 1.5],
"activation": [0.1, ...]}, one number a muscle in the model's order, null where its channel dropped
out. With --signal emg (raw) or envelope it is emg_V or envelope_V, and the trial table of
--recording says mvc_<muscle>_V and rest_<muscle>_V. hand_m (place of the hand from the shoulder)
may stand in place of q_rad; force_N, displacement_m and signal_sd where they are known.
{"reset": true} begins anew.

Results are lines of JSON: K_N_m, its 95 % half widths, axes, share of each muscle, flags. A sample
that cannot be taken is told in one line on stderr, and the stream goes on. --replay sends a
recorded session the same way.
"""

from __future__ import annotations

import argparse
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Final

if TYPE_CHECKING:
    from armimpedance.core.records import Recording

_HERE: Final = "127.0.0.1"
_HIGHEST_PORT: Final = 65_535


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", type=Path, metavar="MODEL.json")
    parser.add_argument("--recording", type=Path, metavar="RECORDING", help="whose arm it is")
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--udp", type=_port, metavar="PORT", help="samples come by UDP")
    source.add_argument(
        "--lsl", metavar="NAME", help="samples of a stream of the Lab Streaming Layer"
    )
    source.add_argument("--replay", type=Path, metavar="RECORDING", help="a recorded session")
    parser.add_argument(
        "--host", default=_HERE, help="--udp: address to listen on (default: this machine's)"
    )
    parser.add_argument(
        "--to", type=_port, metavar="PORT", help="send the results there by UDP, on this machine"
    )
    parser.add_argument(
        "--signal",
        choices=("activation", "emg", "envelope"),
        default="activation",
        help="what samples hold of the muscles (default: activation; of --replay what it has)",
    )
    parser.add_argument(
        "--rate", type=float, default=1000.0, metavar="HZ", help="of the samples (default: 1000)"
    )
    parser.add_argument(
        "--limit",
        type=float,
        metavar="N/M/S",
        help="commanded_N_m changes no faster (default: no limit)",
    )
    parser.add_argument(
        "--elbow",
        choices=("held", "free"),
        help="in space: whether the upper arm is kept from turning about its own axis (default: "
        "the recording's column `elbow`, else free)",
    )
    parser.add_argument("--samples", type=_count, metavar="N", help="end after so many")


def run(args: argparse.Namespace) -> int:
    """Serve a stream until it ends."""
    from armimpedance.core.errors import InputError
    from armimpedance.muscles.live.stream import packets_of, serve
    from armimpedance.muscles.live.updates import Live
    from armimpedance.show.verbs.results import read_recording

    replayed = None if args.replay is None else read_recording(args.replay)
    whose = args.recording if args.recording is not None else replayed
    if whose is None:
        raise InputError("whose arm is it?", expected="--recording RECORDING")
    raw = args.signal == "emg" or (replayed is not None and replayed.emg_unit == "V")
    live = Live(
        args.model,
        whose,
        rate_hz=args.rate if replayed is None else replayed.sample_rate_hz,
        levels=whose if raw or args.signal == "envelope" else None,
        envelope=args.signal == "envelope",
        limit_N_m_s=args.limit,
        elbow=args.elbow,
    )
    with _output(args) as write:
        served = serve(live, packets_of(live, _source(args, replayed)), write, _tell)
    _tell(str(served))
    return 0


def _port(text: str) -> int:
    if not (text.isascii() and text.isdigit() and 0 < int(text) <= _HIGHEST_PORT):
        raise argparse.ArgumentTypeError(f"{text!r} is no port (expected 1 to {_HIGHEST_PORT})")
    return int(text)


def _count(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text[:9])):
        raise argparse.ArgumentTypeError(f"{text!r} is no count (expected 1 or more)")
    return int(text[:9])


def _source(
    args: argparse.Namespace, replayed: Recording | None
) -> BinaryIO | tuple[str, int] | str | Recording:
    if replayed is not None:
        return replayed
    if args.lsl is not None:
        return f"lsl:{args.lsl}"
    return sys.stdin.buffer if args.udp is None else (args.host, args.udp)


@contextmanager
def _output(args: argparse.Namespace) -> Iterator[Callable[[str], bool]]:
    """Yield a function that writes a line of results and returns False after the last one."""
    remaining = args.samples or 0

    def more() -> bool:
        nonlocal remaining
        remaining -= 1
        return remaining != 0

    if args.to is None:
        yield lambda line: _print(line) and more()
        return
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as door:

        def send(line: str) -> bool:
            # where nobody listens, nobody misses it
            with suppress(ConnectionRefusedError):
                door.sendto(line.encode(), (_HERE, args.to))
            return more()

        yield send


def _print(line: str) -> bool:
    """Print a line at once; whether somebody still reads."""
    print(line, flush=True)
    return not getattr(sys.stdout, "left", False)


def _tell(line: str) -> None:
    print(f"armimpedance live: {line}", file=sys.stderr, flush=True)
