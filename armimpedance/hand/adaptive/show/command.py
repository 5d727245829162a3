"""Choose the next pushes of an experiment, and say how many it still needs.

Examples:
  armimpedance simulate cocontraction --sets 2 --disturbance designed --out session
  armimpedance next session --k-percent 5
  armimpedance next session --k-percent 5 --count 16 --out next.csv
  armimpedance next session --difference-percent 20 --between cocontraction_00 cocontraction_10
  armimpedance next --conditions relaxed tense --k-percent 5 --lines --out-recording session

Without a recording it chooses the first set. Intervals are those that `estimate` prints: what it
allows for, such as a reflex, is counted, and the pushes that exclude it are chosen.

--lines talks to a robot, one JSON object a line: it reads {"ready": true} or {"trial": {...}} and
answers each with the push to do (docs/how_to/next.md).
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import Any

from armimpedance.hand.adaptive.show.options import NEXT


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.show.command.outputs import OutputPath, add_replace

    parser.add_argument(
        "recording", metavar="RECORDING", type=Path, nargs="?", help="what was measured so far"
    )
    NEXT.configure(parser)
    parser.add_argument(
        "--servo", type=float, metavar="N_PER_M", help="the robot's stiffness (default: ideal)"
    )
    out = parser.add_argument_group("output")
    out.add_argument("--out", type=OutputPath, metavar="CSV", help="the next pushes, one a row")
    out.add_argument(
        "--lines", action="store_true", help="talk to a robot over standard input and output"
    )
    out.add_argument(
        "--out-recording",
        type=OutputPath,
        metavar="FOLDER",
        help="with --lines: the trials, as a recording",
    )
    add_replace(out)
    out.add_argument(
        "--sample-rate-hz", type=float, default=1000.0, metavar="HZ", help="with --lines (1000)"
    )
    out.add_argument(
        "--handle-kg",
        type=float,
        default=0.0,
        metavar="KG",
        help="with --lines: mass between force sensor and hand (0)",
    )


def run(args: argparse.Namespace) -> int:
    """Choose, write the table, print; or answer a robot line by line."""
    from armimpedance.core.errors import InputError
    from armimpedance.show.command.outputs import Output, check_outputs

    check_outputs(Output("--out", args.out, (".csv",)), reads=[args.recording])
    if args.recording is None and not args.conditions:
        raise InputError("no RECORDING and no --conditions", expected="one of them")
    if args.out_recording is not None and not args.lines:
        raise InputError("--out-recording without --lines", expected="both")
    return _serve(args) if args.lines else _once(args)


def _once(args: argparse.Namespace) -> int:
    from armimpedance.core.outputs import staged_file
    from armimpedance.hand.adaptive.show import next_text, next_trials

    made = next_trials(args.recording, **_keywords(args))
    if args.out is not None:
        with staged_file(args.out) as staged:
            made.to_frame().to_csv(staged, index=False)
    print(next_text(made))
    return 0


def _serve(args: argparse.Namespace) -> int:
    """Respond to each line immediately: the robot waits."""
    import sys

    from armimpedance.hand.adaptive import OneCourse, PushSession, Setup, answers, trials_of
    from armimpedance.hand.adaptive.show import next_trials
    from armimpedance.recordings import FOLDER_FILES, write_recording
    from armimpedance.show.command.outputs import check_folder
    from armimpedance.show.verbs.results import read_recording

    if args.out_recording is not None:
        check_folder(args.out_recording, FOLDER_FILES, replace=args.replace)
    begun = [] if args.recording is None else trials_of(read_recording(args.recording))
    choose = OneCourse(partial(next_trials, checks=False, **_keywords(args)))
    session = PushSession(choose, Setup(args.sample_rate_hz, args.handle_kg), begun)
    try:
        for answer in answers(session, sys.stdin):
            print(answer, flush=True)
    finally:
        session.close()
        if args.out_recording is not None and session.trials:
            write_recording(session.recording(), args.out_recording)
    return 0


def _keywords(args: argparse.Namespace) -> dict[str, Any]:
    """Keyword arguments of `next_trials` from the command line."""
    from armimpedance.hand.planning import Servo

    servo = None if args.servo is None else Servo(args.servo)
    return {**NEXT.keywords(args), "servo": servo}
