"""Commands killed at every system call that changes a file: is the old output there, or the new?

Each command of `cases.py` runs in a child of a process that has loaded its modules, over nothing
and over an earlier output, and is killed before the first call, the second, ... (`traced.py`; of
the writes of one file a sample). Then every output is looked at: absent where none was, the old
one or the new one, byte by byte. Then something is written into the same folders, or, after every
tenth kill, the command runs again: no temporary is left. Exit status 0 if nothing was missed, else
1.

    python benchmarks/faults/kills.py --kills 1000
    python benchmarks/faults/kills.py --case recording --kills 100
"""

# The number of threads must be set before numpy is imported.
# ruff: noqa: E402

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import argparse
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from cases import CASES, Case
from inputs import command, in_a_child, inputs, load_modules
from traced import BULK, run

TEMPORARY = ".armimpedance-"
#: After one kill of so many the whole command runs again; after the others something small.
AGAIN = 10
#: Kills of a command that takes long.
FEW = 12
ABSENT, OLD, NEW = "absent", "old", "new"


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=1000, help="in all (default: 1000)")
    parser.add_argument("--case", help="one of them only")
    parser.add_argument("--folder", type=Path, default=Path("/dev/shm"))  # noqa: S108
    asked = parser.parse_args()
    chosen = [case for case in CASES if asked.case in (None, case.name)]
    each = -(-asked.kills // max(2 * sum(not case.is_long for case in chosen), 1))
    misses, started = [], time.time()
    seen: Counter[str] = Counter()
    with tempfile.TemporaryDirectory(dir=asked.folder) as place:
        os.chdir(place)
        inputs()
        load_modules(chosen)
        for case in chosen:
            for old in (False, True):
                found = list(killed(case, old, min(each, FEW) if case.is_long else each))
                seen.update(state for state, _ in found)
                misses += [line for _, line in found if line]
                took = time.time() - started
                print(
                    f"{case.name:20} over {'an old one' if old else 'nothing':10} "
                    f"{len(found):4} kills, {took:5.0f} s so far",
                    flush=True,
                )
    for line in misses:
        print(f"MISSED {line}")
    print(f"{sum(seen.values())} kills: {dict(seen)}; missed: {len(misses)}")
    return 1 if misses else 0


def killed(case: Case, old: bool, count: int) -> Iterator[tuple[str, str]]:
    """Kill a command `count` times; the state found, and a line for what was missed."""
    fresh(case, old)
    whole = run(command(case.words))
    if whole.status:
        yield "failed", f"{case.name}: status {whole.status} without a kill"
        return
    new = contents()
    for number, at in enumerate(points(whole.calls, count)):
        fresh(case, old)
        before = contents()
        ended = run(command(case.words), at)
        where = f"{case.name}{' over an old one' if old else ''}, call {at} ({ended.calls[-1]})"
        if ended.status != -9:
            yield "not killed", f"{where}: ended with {ended.status}"
            continue
        state, wrong = judged(case, before, new, contents())
        if wrong:
            yield state, f"{where}: {wrong}"
            continue
        wrong = after_the_next_run(case, new, whole=number % AGAIN == 0)
        yield state, f"{where}: {wrong}" if wrong else ""


def after_the_next_run(case: Case, new: dict[str, bytes], *, whole: bool) -> str:
    """What is wrong after the same command ran again, or any that writes into those folders."""
    if not whole:
        folders = {path.parent for path in Path("out").rglob(f"{TEMPORARY}*")} | {Path("out")}
        in_a_child(lambda: write_into(sorted(folders)))
        left = [path.name for path in Path("out").rglob(f"{TEMPORARY}*")]
        return f"after the next run: {left[0]} is left" if left else ""
    status = in_a_child(command(case.words))
    after = contents()
    odd = sorted(set(after) ^ set(new)) or [n for n in new if after[n] != new[n]]
    return f"after the next run (status {status}): {odd[:3]}" if status or odd else ""


def write_into(folders: Sequence[Path]) -> int:
    """Write a file into each folder that is still there, as any command does."""
    from armimpedance.outputs import staged_file

    for folder in folders:
        if folder.is_dir() and TEMPORARY not in str(folder):
            with staged_file(folder / "next.csv") as path:
                path.write_text("next")
    return 0


def judged(
    case: Case, before: dict[str, bytes], new: dict[str, bytes], after: dict[str, bytes]
) -> tuple[str, str]:
    """The state of the outputs, and what is wrong with one."""
    states = set()
    names = case.outputs or sorted({*before, *new, *after})
    for name in names:
        if TEMPORARY in name:
            continue
        was, made, now = (_part(name, each) for each in (before, new, after))
        if now == made:
            states.add(NEW)
        elif now == was:
            states.add(OLD if was else ABSENT)
        else:
            return "half", f"{name} is neither the old nor the new one"
    foreign = [n for n in after if TEMPORARY not in n and n not in before and n not in new]
    if foreign:
        return "half", f"{foreign[0]} is left"
    return " and ".join(sorted(states)) or NEW, ""


def _part(name: str, held: dict[str, bytes]) -> dict[str, bytes]:
    return {n: data for n, data in held.items() if n == name or n.startswith(f"{name}/")}


def points(calls: list[str], count: int) -> list[int]:
    """Which calls to kill before: all that make, rename or remove, and of the writes a part."""
    rare = [n for n, call in enumerate(calls) if call not in BULK]
    bulk = [n for n, call in enumerate(calls) if call in BULK]
    room = max(count - len(rare), count // 4)
    return sorted([*_spread(rare, count - min(room, len(bulk))), *_spread(bulk, room)])


def _spread(numbers: list[int], count: int) -> list[int]:
    if len(numbers) <= count:
        return numbers
    return [numbers[i * len(numbers) // count] for i in range(count)]


def fresh(case: Case, old: bool) -> None:
    """The folder of the outputs as it is before the run."""
    shutil.rmtree("out", ignore_errors=True)
    os.mkdir("out")
    if old:
        case.put_old(Path("out"))


def contents() -> dict[str, bytes]:
    """Every file below the folder of the outputs."""
    out = Path("out")
    files = (path for path in out.rglob("*") if path.is_file())
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in files}


if __name__ == "__main__":
    sys.exit(main())
