"""Score a submission against the truths: the public ones, and with the key the sealed ones.

Examples:
  armimpedance benchmark score benchmark mine.csv --out mine.json
  armimpedance benchmark score benchmark mine.csv --key secret.key --out mine.json

With --key the sealed truth, which `make` kept beside the key, else made again, is checked against
the hashes that were published with the folder. Nothing in the result depends on when or where it
was scored.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.core.errors import InputError
from armimpedance.show.command.outputs import Output, OutputPath, check_outputs

if TYPE_CHECKING:
    from armimpedance.lab.benchmark import BenchmarkFolder, KnownTruth


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("benchmark", type=Path, metavar="FOLDER")
    parser.add_argument("submission", type=Path, metavar="SUBMISSION.csv")
    parser.add_argument("--key", type=Path, metavar="FILE", help="of the sealed half")
    parser.add_argument("--name", metavar="TEXT", help="of the method (the file's name)")
    parser.add_argument("--out", type=OutputPath, required=True, metavar="SCORES.json")


def run(arguments: argparse.Namespace) -> int:
    """Read, score, write."""
    from armimpedance.core.outputs import staged_file
    from armimpedance.lab.benchmark import BenchmarkFolder, described, score_submission

    reads = [arguments.submission, arguments.key]
    check_outputs(Output("--out", arguments.out, (".json",)), reads=reads)
    benchmark = BenchmarkFolder.open(arguments.benchmark)
    sealed = [] if arguments.key is None else _sealed_truth(benchmark, arguments.key)
    name = arguments.name or arguments.submission.stem
    result = score_submission(benchmark, arguments.submission, name, sealed)
    with staged_file(arguments.out) as staged:
        staged.write_text(result.text, encoding="utf-8")
    for row in result.scores:
        print(described(row))
    return 0


def _sealed_truth(benchmark: BenchmarkFolder, file: Path) -> list[KnownTruth]:
    """The sealed truth, stored or simulated anew, checked against its published hash.

    Raises InputError: another key, or a truth whose hash is another.
    """
    from armimpedance.lab.benchmark import Key, kept_truth
    from armimpedance.lab.benchmark_command.tasks import truth_of

    key = Key.read(file)
    benchmark.check_key(key)
    kept, truth = kept_truth(file), []
    for task in benchmark.tasks:
        own = [known for known in kept if known.asked.task == task]
        if not benchmark.holds_sealed(task, own, key):
            own = truth_of(task, benchmark.records(task, "sealed"), key)
        if not benchmark.holds_sealed(task, own, key):
            problem = f"{task}: the truth made from the key is not the one that was published"
            expected = "the program that made the folder"
            raise InputError(problem, file=benchmark.path, expected=expected)
        truth += own
    return truth
