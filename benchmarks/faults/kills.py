"""Commands killed at every system call that changes a file: is the old output there, or the new?

Each command of `cases.py` runs, over nothing and over an earlier output, up to where it begins to
write. From there a child goes on, and is killed before its first call, the next one before its
second, ... (`traced.py`; of the writes of a file a sample). Then every output is looked at: absent
where none was, the old one or the new one, byte by byte. Then another child goes on to the end, as
the next run: the outputs are the new ones, and no temporary is left. Exit status 0 if nothing was
missed, else 1.

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
import json
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from cases import CASES, Case
from inputs import (
    Enough,
    at_first_output,
    command,
    contents,
    folders_made,
    fresh,
    gone_on,
    in_a_child,
    inputs,
    working_in,
)
from traced import BULK, run

TEMPORARY = ".armimpedance-"
#: Kills of a command that takes long.
FEW = 10
ABSENT, OLD, NEW = "absent", "old", "new"
FOUND = "found.json"


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=1000, help="in all (default: 1000)")
    parser.add_argument("--case", action="append", help="this one only; may be repeated")
    parser.add_argument("--folder", type=Path, default=Path("/dev/shm"))  # noqa: S108
    asked = parser.parse_args()
    chosen = [case for case in CASES if not asked.case or case.name in asked.case]
    each = -(-asked.kills // max(2 * sum(not case.is_long for case in chosen), 1))
    misses, started = [], time.time()
    seen: Counter[str] = Counter()
    with working_in(asked.folder):
        inputs()
        for case in chosen:
            count = FEW if case.is_long else each
            in_a_child(lambda case=case, count=count: _campaign(case, count))
            found = json.loads(Path(FOUND).read_text())
            Path(FOUND).unlink()
            seen.update(state for state, _ in found)
            missed = [line for _, line in found if line]
            misses += missed
            took = f"{time.time() - started:5.0f} s"
            print(f"{case.name:20} {len(found):4} kills, {took}", *missed, sep="\n  ", flush=True)
    print(f"{sum(seen.values())} kills: {dict(seen)}; missed: {len(misses)}")
    return 1 if misses else 0


def _campaign(case: Case, count: int) -> int:
    """All kills of a command, over nothing and over an earlier output."""
    found: list[tuple[str, str]] = []
    fresh(case, old=False)
    status = command(case.words)  # loads all modules
    if status:
        found.append(("failed", f"{case.name}: status {status} without a kill"))
    for old in (False, True) if not status else ():
        fresh(case, old)
        at_first_output(case, lambda old=old: _kill_all(case, old, count, found))
    Path(FOUND).write_text(json.dumps(found))
    return 0


def _kill_all(case: Case, old: bool, count: int, found: list[tuple[str, str]]) -> None:
    for one in killed(case, old, count):
        if one is None:
            return  # a child, which goes on
        found.append(one)
    raise Enough


def killed(case: Case, old: bool, count: int) -> Iterator[tuple[str, str] | None]:
    """Kill a command `count` times; the state found, and a line for what was missed.

    None in a child.
    """
    folders = folders_made()
    fresh(case, old, folders)
    whole = run()
    if whole is None:
        yield None
        return
    new = contents()
    for at in points(whole.calls, count):
        fresh(case, old, folders)
        before = contents()
        ended = run(at)
        if ended is None:
            yield None
            return
        where = f"{case.name}{' over an old one' if old else ''}, call {at} ({ended.calls[-1]})"
        if ended.status != -9:
            yield "not killed", f"{where}: ended with {ended.status}"
            continue
        state, wrong = judged(case, before, new, contents())
        if wrong:
            yield state, f"{where}: {wrong}"
            continue
        status = gone_on()
        if status is None:
            yield None
            return
        if status and state == NEW:
            # What goes on had looked before there was an output; a run that begins now sees it.
            status = in_a_child(lambda: command(case.words))
        after = contents()
        odd = sorted(set(after) ^ set(new)) or [n for n in new if after[n] != new[n]]
        wrong = f"after the next run (status {status}): {odd[:3]}" if status or odd else ""
        yield state, f"{where}: {wrong}" if wrong else ""


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


if __name__ == "__main__":
    sys.exit(main())
