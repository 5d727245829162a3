"""A folder of people to one table and one report; a second run repeats only what changed.

Examples:
  armimpedance study data out participant
  armimpedance study data out group
  armimpedance study data out participant --dry-run
  armimpedance study data out participant --participant-label 01 02 --workers 4
  armimpedance study data out participant --design other.toml
  armimpedance study data out participant --scheduler tcp://host:8786
  armimpedance study data out slurm-script --tasks 100 > study.sh

DATA holds a folder a person (sub-01/ses-1/... as in BIDS, or any names), with recordings that
`inspect` takes. For each recording the commands of DATA/study.toml run in a folder of OUT:

  steps = ["inspect {recording} --out checks.csv",
           "estimate {recording} --by condition --out hand.csv",
           "map hand.csv --recording {recording} --to joint --out joint.csv",
           "report {recording} --out report.html"]

A name without a folder lies in the session's folder; {study}/arm.csv lies beside study.toml.
{participant} and {session} are their names. Without study.toml: inspect, estimate, report.
A step runs an analysis and writes in the session's folder; one of DATA/study.toml reads the
recording and what lies beside the design, one of a design named with --design reads any file.

What fails is a row with its reason (exit status 3), the others are unharmed. A step runs again
only if its words, the bytes that it reads, or the program changed.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.app.study import Engine, StudyDesign, StudySession

LEVELS = ("participant", "group", "slurm-script")
#: Done, but not for every session.
SOME_FAILED = 3
#: A group step that prints more is told by its last lines.
MOST_LINES = 24


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("data", metavar="DATA", type=Path)
    parser.add_argument("out", metavar="OUT", type=Path)
    parser.add_argument(
        "level", choices=LEVELS, help="each session; all of them; a script for SLURM"
    )
    parser.add_argument("--design", type=Path, metavar="FILE.toml", help="default: DATA/study.toml")
    parser.add_argument(
        "--participant-label",
        nargs="+",
        metavar="LABEL",
        help="only these people (with or without sub-)",
    )
    parser.add_argument(
        "--workers", type=int, metavar="N", help="processes (default: as many as cores)"
    )
    parser.add_argument(
        "--dry-run", action="store_true", help="say what would be done, and do nothing"
    )
    parser.add_argument(
        "--resume", action="store_true", help="go on with a study: OUT has to hold one"
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of Dask: workers on many machines")
    parser.add_argument(
        "--cluster", choices=("slurm",), help="workers of Dask as jobs, --workers of them"
    )
    parser.add_argument("--task-index", type=int, metavar="I", help="of a job array, from 0")
    parser.add_argument("--tasks", type=int, metavar="N", help="jobs of the array")
    parser.add_argument("--time", default="04:00:00", help="of each job (default: 04:00:00)")
    parser.add_argument("--memory", default="4G", help="of each job (default: 4G)")


def run(arguments: argparse.Namespace) -> int:
    """Do one level of the study, print what became of it."""
    check_folders(arguments.data, arguments.out, arguments.resume)
    _check(arguments)
    design, sessions = _found(arguments)
    if arguments.level == "slurm-script":
        return _script(arguments)
    if arguments.level == "group":
        return _group(arguments, design, sessions)
    if arguments.dry_run:
        return _dry_run(arguments, design, sessions)
    return _participants(arguments, design, sessions)


def _check(arguments: argparse.Namespace) -> None:
    """Refuse options that have no effect."""
    from armimpedance.core.errors import InputError

    array = arguments.level == "slurm-script"
    if (arguments.task_index is None) == (arguments.tasks is not None and not array):
        raise InputError("--task-index and --tasks belong together", expected="both")
    if array and (arguments.tasks is None or arguments.tasks < 1):
        raise InputError("slurm-script", expected="--tasks N, the number of jobs")
    if arguments.level != "participant":
        for name in ("dry_run", "resume", "scheduler", "cluster", "workers", "task_index"):
            if getattr(arguments, name):
                option = f"--{name.replace('_', '-')}"
                raise InputError(f"{option} with {arguments.level}", expected="participant")
    if arguments.scheduler and (arguments.cluster or arguments.workers):
        raise InputError("--scheduler", expected="no --cluster or --workers beside it")
    if arguments.cluster and not arguments.workers:
        raise InputError(f"--cluster {arguments.cluster}", expected="--workers N, the jobs")


def check_folders(data: Path, out: Path, resume: bool = False) -> None:
    """Refuse an output that lies within the data, or around them."""
    from armimpedance.app.study import STORE
    from armimpedance.core.errors import InputError

    top, place = data.resolve(), out.resolve()
    own = place.is_relative_to(top / "derivatives") and place != top / "derivatives"
    if not own and (place.is_relative_to(top) or top.is_relative_to(place)):
        expected = "another, or one in its folder derivatives"
        raise InputError("lies in the data's folder, or around it", file=out, expected=expected)
    if out.exists() and not out.is_dir():
        raise InputError("is a file", file=out, expected="a folder for the results")
    names = [entry.name for entry in out.iterdir()] if out.is_dir() else []
    if names and STORE not in names:
        problem = f"holds {sorted(names)[0]}, and no earlier study"
        raise InputError(problem, file=out, expected="a new or empty folder, or a study's")
    if resume and STORE not in names:
        raise InputError("--resume: no study there", file=out, expected="the folder of a study")


def _participants(
    arguments: argparse.Namespace, design: StudyDesign, sessions: list[StudySession]
) -> int:
    from armimpedance.app.study import StudyLog, run_participants, share_of
    from armimpedance.show.command.screen import bar

    if arguments.task_index is not None:
        sessions = share_of(sessions, arguments.task_index, arguments.tasks)
    out = arguments.out.resolve()
    engine = _engine(arguments)
    log = StudyLog(out)
    log.begun(f"{len(sessions)} sessions of {arguments.data}")
    failed: dict[str, str] = {}
    ran = steps = 0
    with bar("sessions") as progress:
        for one in run_participants(sessions, design, out, command, engine):
            log.ended(one)
            progress(one.done, one.all)
            ran += one.outcome.recomputed
            steps += len(one.outcome.done)
            if one.outcome.reason:
                failed[str(one.session)] = one.outcome.reason
    print(f"{len(sessions)} sessions: {len(sessions) - len(failed)} done, {len(failed)} failed")
    print(f"{steps} steps: {ran} run, {steps - ran} known from before")
    return _told(failed)


def _engine(arguments: argparse.Namespace) -> Engine:
    """The engine: processes of this machine, workers of Dask, or jobs of SLURM."""
    from armimpedance.app.study import Dask, Processes, SlurmJobs

    if arguments.scheduler:
        return Dask(arguments.scheduler)
    if arguments.cluster:
        return SlurmJobs(arguments.workers, f"{arguments.memory}B".replace("BB", "B"))
    return Processes(arguments.workers)


def _script(arguments: argparse.Namespace) -> int:
    """Print a job array's script."""
    from armimpedance.app.study import array_script

    program = [sys.executable, "-m", "armimpedance"]
    words = [*program, "study", str(arguments.data.resolve()), str(arguments.out.resolve())]
    options: list[str] = []
    if arguments.design is not None:
        options += ["--design", str(arguments.design.resolve())]
    if arguments.participant_label:
        options += ["--participant-label", *arguments.participant_label]
    print(array_script(words, options, arguments.tasks, arguments.time, arguments.memory), end="")
    return 0


def _group(arguments: argparse.Namespace, design: StudyDesign, sessions: list[StudySession]) -> int:
    from armimpedance.app.study import run_group

    gathered = run_group(sessions, design, arguments.data, arguments.out.resolve(), command)
    for name, rows in gathered.rows:
        print(f"{rows} rows in {arguments.out / 'group' / name}")
    for one in gathered.outcome.done:
        print(f"\n$ armimpedance {one.step}\n{_shortly(one.result.printed)}".rstrip())
    if gathered.unusable:
        count = f"{gathered.unusable} of {len(sessions)} sessions"
        print(f"\n{count} are not in these tables: see {arguments.out / 'group/sessions.csv'}")
    print(f"\npage of all sessions: {arguments.out / 'group' / gathered.page.name}")
    return _told({"group": gathered.outcome.reason} if gathered.outcome.reason else {}) or (
        SOME_FAILED if gathered.unusable else 0
    )


def _shortly(printed: str) -> str:
    """Text that a step printed; if it is long, its last lines (the log has the rest)."""
    lines = printed.strip().splitlines()
    if len(lines) <= MOST_LINES:
        return "\n".join(lines)
    return "\n".join([f"... {len(lines) - 3} lines in group/log.txt", *lines[-3:]])


def _told(failed: dict[str, str]) -> int:
    """Print who failed and why; the exit status."""
    for name, reason in sorted(failed.items()):
        print(f"  {name}: {reason}")
    return SOME_FAILED if failed else 0


def _dry_run(
    arguments: argparse.Namespace, design: StudyDesign, sessions: list[StudySession]
) -> int:
    """Print which sessions have work to do."""
    from armimpedance.app.study import unknown_sessions

    waiting = unknown_sessions(sessions, design, arguments.out.resolve())
    print(f"{len(sessions)} sessions, {len(waiting)} to be worked on:")
    for session in waiting:
        print(f"  {session}: {session.recording}")
    print("each with these steps, where their inputs changed:")
    for step in design.steps:
        print(f"  armimpedance {step}")
    return 0


def _found(arguments: argparse.Namespace) -> tuple[StudyDesign, list[StudySession]]:
    from armimpedance.app.study import check_steps, chosen, find_sessions, read_design
    from armimpedance.recordings import is_recording

    design = read_design(arguments.design, arguments.data)
    check_steps(design, parse)
    sessions = find_sessions(arguments.data, design.recordings, is_recording)
    return design, chosen(sessions, arguments.participant_label)


def parse(words: list[str]) -> argparse.Namespace:
    """Parse a command's words and do nothing.

    Raises InputError: they are no call of a command.
    """
    import io
    from contextlib import redirect_stderr, redirect_stdout

    from armimpedance.app.cli.main import make_parser
    from armimpedance.core.errors import InputError

    complaints = io.StringIO()
    try:
        with redirect_stderr(complaints), redirect_stdout(io.StringIO()):
            return make_parser(words).parse_args(words)
    except SystemExit:
        raise InputError(complaints.getvalue().strip() or "no command") from None


def command(words: list[str]) -> int:
    """Run one command, as if it had been typed."""
    from armimpedance.app.cli.main import run as run_words

    return run_words(words)
