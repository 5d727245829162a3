"""Stiffness of the hand live, from posture and muscle activity, one line a sample.

Examples:
  armimpedance fit muscles postures.csv cocontraction.csv --out arm.json
  armimpedance live arm.json --recording session < samples.jsonl
  armimpedance live arm.json --recording session --limit 20000 < samples.jsonl > stiffness.jsonl

A sample is a line of JSON: {"time_s": 0.001, "q_rad": [0.9, 1.5], "activation": [0.1, ...]}, one
number a muscle in the model's order, null where its channel dropped out. hand_m (place of the hand
from the shoulder) may stand in place of q_rad; force_N, displacement_m and signal_sd where they are
known. {"reset": true} begins anew. Results are lines of JSON: K_N_m, its 95 % half widths, axes,
share of each muscle, flags. A sample that cannot be taken is told in one line on stderr, and the
stream goes on. --recording says whose arm it is.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", type=Path, metavar="MODEL.json")
    parser.add_argument("--recording", type=Path, metavar="RECORDING", help="whose arm it is")
    parser.add_argument(
        "--rate", type=float, default=1000.0, metavar="HZ", help="of the samples (default: 1000)"
    )
    parser.add_argument(
        "--limit",
        type=float,
        metavar="N/M/S",
        help="commanded_N_m changes no faster (default: no limit)",
    )


def run(args: argparse.Namespace) -> int:
    """Serve a stream until it ends."""
    from armimpedance.errors import InputError
    from armimpedance.live import Live, lines_of, serve

    if args.recording is None:
        raise InputError("whose arm is it?", expected="--recording RECORDING")
    live = Live(args.model, args.recording, rate_hz=args.rate, limit_N_m_s=args.limit)
    served = serve(live, lines_of(sys.stdin.buffer), _write, _tell)
    _tell(str(served))
    return 0


def _write(line: str) -> bool:
    """Print a line at once; whether somebody still reads."""
    print(line, flush=True)
    return not getattr(sys.stdout, "left", False)


def _tell(line: str) -> None:
    print(f"armimpedance live: {line}", file=sys.stderr, flush=True)
