"""Score a submission against the truths: the public ones, and with the key the sealed ones.

Examples:
  armimpedance benchmark score benchmark mine.csv --out mine.json
  armimpedance benchmark score benchmark mine.csv --key secret.key --out mine.json

With --key the sealed truth is made again and checked against the hashes that were published with
the folder. Nothing in the result depends on when or where it was scored.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.cli.parts.outputs import Output, check_outputs

if TYPE_CHECKING:
    from armimpedance.benchmark import BenchmarkFolder, Known


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("benchmark", type=Path, metavar="FOLDER")
    parser.add_argument("submission", type=Path, metavar="SUBMISSION.csv")
    parser.add_argument("--key", type=Path, metavar="FILE", help="of the sealed half")
    parser.add_argument("--name", metavar="TEXT", help="of the method (the file's name)")
    parser.add_argument("--out", type=Path, required=True, metavar="SCORES.json")


def run(arguments: argparse.Namespace) -> int:
    """Read, score, write."""
    from armimpedance.benchmark import BenchmarkFolder, described, score_submission
    from armimpedance.outputs import staged_file

    reads = [arguments.submission, arguments.key]
    check_outputs(Output("--out", arguments.out, (".json",)), reads=reads)
    benchmark = BenchmarkFolder.open(arguments.benchmark)
    sealed = [] if arguments.key is None else _sealed_truth(benchmark, arguments.key)
    name = arguments.name or arguments.submission.stem
    made = score_submission(benchmark, arguments.submission, name, sealed)
    with staged_file(arguments.out) as staged:
        staged.write_text(made.text, encoding="utf-8")
    for row in made.scores:
        print(described(row))
    return 0


def _sealed_truth(benchmark: BenchmarkFolder, file: Path) -> list[Known]:
    """Made again from the key, and shown to be the one that was fixed."""
    from armimpedance.benchmark import Key
    from armimpedance.cli.benchmark.task import truth_of

    key = Key.read(file)
    benchmark.check_key(key)
    truth: list[Known] = []
    for task in benchmark.tasks:
        own = truth_of(task, benchmark.records(task, "sealed"), key)
        benchmark.check_sealed(task, own, key)
        truth += own
    return truth
