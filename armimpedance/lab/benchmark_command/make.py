"""Write the benchmark's folder: tasks, records, the public truth, hashes of the sealed one.

Examples:
  armimpedance benchmark make --out benchmark
  armimpedance benchmark make --key secret.key --out benchmark
  armimpedance benchmark make --quick --task hand_ideal --out try_it

Without --key there is a public half alone. A key file that is not there yet is drawn: keep it, and
the truths that are written beside it, and keep both secret; who has the key can score the sealed
half. The same version and key give the same folder, to the bit.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.core.errors import InputError
from armimpedance.show.command.outputs import OutputPath, add_replace, check_folder

if TYPE_CHECKING:
    from armimpedance.lab.benchmark import Key

#: Records of each half.
RECORDS, QUICK, MOST = 10, 2, 99


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--out", type=OutputPath, required=True, metavar="FOLDER")
    parser.add_argument("--key", type=Path, metavar="FILE", help="of the sealed half")
    parser.add_argument(
        "--task",
        dest="tasks",
        action="append",
        metavar="NAME",
        help="only this one, such as hand_ideal; may be repeated (a wrong name lists all)",
    )
    count = parser.add_mutually_exclusive_group()
    count.add_argument("--records", type=int, default=RECORDS, help=f"of each half ({RECORDS})")
    count.add_argument("--quick", action="store_true", help=f"{QUICK} records a half")
    parser.add_argument("--table", choices=("parquet", "csv"), default="parquet")
    parser.add_argument("--workers", type=int, metavar="N", help="processes (as many as cores)")
    add_replace(parser)


def run(arguments: argparse.Namespace) -> int:
    """Draw, simulate, write all or nothing."""
    from armimpedance.core.outputs import staged_folder
    from armimpedance.core.workers import usable_cores
    from armimpedance.lab.benchmark import MARK, TOP, BenchmarkFolder, keep_truth
    from armimpedance.lab.benchmark_command.tasks import TASKS
    from armimpedance.lab.benchmark_command.written import Wanted, write_benchmark
    from armimpedance.show.command.screen import bar

    check_folder(arguments.out, TOP, replace=arguments.replace, mark=MARK)
    key = _key(arguments.key, arguments.out)
    count = QUICK if arguments.quick else arguments.records
    if not 1 <= count <= MOST:
        raise InputError(f"--records {count}", expected=f"1 to {MOST}")
    for name in arguments.tasks or ():
        TASKS.named(name)
    tasks = tuple(name for name in TASKS.names if name in (arguments.tasks or TASKS.names))
    workers = usable_cores() if arguments.workers is None else max(1, arguments.workers)
    wanted = Wanted(tasks, count, key, arguments.table, workers)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    with staged_folder(arguments.out, MARK, TOP) as staged, bar("making") as progress:
        truth = write_benchmark(wanted, staged, progress)
    if key is not None:
        keep_truth(arguments.key, truth)
    folder = BenchmarkFolder.open(arguments.out)
    halves = "public" if key is None else "public and sealed"
    print(f"{arguments.out}: {len(tasks)} tasks, {count} records each, {halves}")
    print(f"  SHA-256 of its SHA256SUMS: {folder.sha256}")
    return 0


def _key(file: Path | None, out: Path) -> Key | None:
    """The key in the file, drawn if it is not there."""
    from armimpedance.lab.benchmark import Key

    if file is None:
        return None
    if out.resolve() in file.resolve().parents:
        raise InputError("a key in what is published", file=file, expected="another folder")
    if file.exists():
        return Key.read(file)
    key = Key.drawn(file)
    print(f"{file}: a new key; keep it, and keep it secret", flush=True)
    return key
