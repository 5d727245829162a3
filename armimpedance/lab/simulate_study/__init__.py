"""A Monte-Carlo study: many simulated sessions, estimated in every way that is asked for.

Examples:
  armimpedance simulate-study coverage.toml --out coverage
  armimpedance simulate-study coverage.toml --out coverage --dry-run
  armimpedance simulate-study coverage.toml --out coverage --workers 4
  armimpedance simulate-study coverage.toml --out coverage --scheduler tcp://host:8786

CONFIG says how many sessions, and what of; every combination of a grid's lists is a cell:

  sessions = 300
  seed = 1
  power = [["cocontraction_00", "cocontraction_10"]]

  [grid]
  rig = "hand"
  experiment = "cocontraction"
  conditions = [["cocontraction_00", "cocontraction_10"]]
  noise = ["nominal", "sensor"]
  method = ["weighted", "exact"]

Instead of sessions = N, [fixed] with full = 400 and drawn = 1000000 simulates 400 sessions and
draws a million from the distribution of their estimates. OUT gets cells.csv (bias, error, coverage,
efficiency), changes.csv (power) and sessions.parquet (every session). What is done is kept: a
study that was killed goes on, one that is enlarged adds what is new.
See docs/reference/simulate_study.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.show.command.outputs import OutputPath

if TYPE_CHECKING:
    from armimpedance.app.study import Engine
    from armimpedance.lab.simulate_study.blocks import Blocks
    from armimpedance.lab.simulate_study.config import Config

#: Done, but not all of it.
SOME_FAILED = 3


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", metavar="CONFIG.toml", type=Path)
    parser.add_argument("--out", type=OutputPath, required=True, metavar="FOLDER")
    parser.add_argument(
        "--workers", type=int, metavar="N", help="processes (default: as many as cores)"
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of Dask: workers on many machines")
    parser.add_argument(
        "--dry-run", action="store_true", help="say what would be done, and do nothing"
    )


def run(arguments: argparse.Namespace) -> int:
    """Do what is missing of the study, write its tables, print a short one."""
    from armimpedance.core.errors import InputError
    from armimpedance.lab.simulate_study.blocks import Blocks
    from armimpedance.lab.simulate_study.config import read_config

    if arguments.scheduler and arguments.workers is not None:
        raise InputError("--scheduler", expected="no --workers beside it")
    config = read_config(arguments.config)
    _check_folder(arguments.out)
    blocks = Blocks(arguments.out.resolve(), config.seed)
    if arguments.dry_run:
        return _dry_run(config, blocks)
    return carry_out(config, blocks, _engine(arguments))


def carry_out(config: Config, blocks: Blocks, engine: Engine) -> int:
    """Do what is missing, write the tables, print; the exit status."""
    from armimpedance.lab.simulate_study.drawing import with_drawn
    from armimpedance.lab.simulate_study.tables import printed, write_tables
    from armimpedance.lab.simulate_study.work import results_of, tasks_of, work_off
    from armimpedance.show.command.screen import bar

    blocks.prepare()
    tasks = tasks_of(config, blocks)
    problems: dict[str, int] = {}
    with bar("blocks of sessions") as progress:
        for done, (task, problem) in enumerate(work_off(tasks, blocks, engine), 1):
            progress(done, len(tasks))
            if problem:
                problems[problem] = problems.get(problem, 0) + task.sessions
    results = [with_drawn(one, config, blocks) for one in results_of(config, blocks)]
    write_tables(results, config, blocks)
    ran = sum(task.sessions * len(task.cells) for task in tasks)
    total = config.sessions * len(config.cells)
    print(f"{len(config.cells)} cells of {config.sessions} sessions: {total - ran} were known")
    for line in printed(results, config):
        print(line)
    for problem, sessions in sorted(problems.items()):
        print(f"  {sessions} sessions not done: {problem}")
    print(f"tables in {blocks.out}")
    return SOME_FAILED if problems else 0


def _dry_run(config: Config, blocks: Blocks) -> int:
    from armimpedance.lab.simulate_study.tables import differing
    from armimpedance.lab.simulate_study.work import tasks_of

    tasks = tasks_of(config, blocks)
    waiting = dict.fromkeys(config.cells, 0)
    for task in tasks:
        for cell in task.cells:
            waiting[cell] += task.sessions
    simulated = sum(task.sessions for task in tasks)
    print(f"{len(config.cells)} cells of {config.sessions} sessions; {simulated} to be simulated")
    for cell, settings in zip(config.cells, differing(config.cells), strict=True):
        print(f"  {settings or cell.rig_name}: {waiting[cell]} sessions to do")
    if config.drawn:
        print(f"then {config.drawn} sessions are drawn of each")
    return 0


def _engine(arguments: argparse.Namespace) -> Engine:
    from armimpedance.app.study import Dask, Processes

    return Dask(arguments.scheduler) if arguments.scheduler else Processes(arguments.workers)


def _check_folder(out: Path) -> None:
    """Refuse a folder that holds anything but an earlier study."""
    from armimpedance.core.errors import InputError
    from armimpedance.lab.simulate_study.blocks import STORE

    if out.exists() and not out.is_dir():
        raise InputError("is a file", file=out, expected="a folder for the results")
    names = [entry.name for entry in out.iterdir()] if out.is_dir() else []
    if names and STORE not in names:
        problem = f"holds {sorted(names)[0]}, and no earlier study"
        raise InputError(problem, file=out, expected="a new or empty folder, or a study's")
