"""Commands on a disk that fails: is it told in one line, and is the old output there, or the new?

As `kills.py`, but a system call that changes a file is answered with an error in place of a kill:
one call with EIO, as by a bad sector, or it and all later ones with ENOSPC, as by a full disk.
Asked: a status other than 0 and one line of at most 400 characters, or, where the error met the
tidying up, status 0 and the new outputs; in either case each output whole, and no temporary after
the next run. With `--tmpfs` (root) each command writes onto real small disks of memory, and onto
one that is mounted for reading alone. Exit status 0 if nothing was missed, else 1.

    python benchmarks/faults/disk_errors.py --errors 400
    python benchmarks/faults/disk_errors.py --case table --tmpfs
"""

# The number of threads must be set before numpy is imported.
# ruff: noqa: E402

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import argparse
import errno
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from cases import CASES, Case
from inputs import (
    SAID,
    Enough,
    at_first_output,
    command,
    contents,
    fresh,
    gone_on,
    in_a_child,
    inputs,
    working_in,
)
from kills import FOUND, TEMPORARY, judged, points
from traced import run

LONGEST = 400
#: Sizes of a disk on which some outputs fit and others do not.
SMALL_KB = (16, 64, 256)


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--errors", type=int, default=400, help="in all (default: 400)")
    parser.add_argument("--case", action="append", help="this one only; may be repeated")
    parser.add_argument("--tmpfs", action="store_true", help="real small disks; needs root")
    parser.add_argument("--folder", type=Path, default=Path("/dev/shm"))  # noqa: S108
    asked = parser.parse_args()
    chosen = [
        case for case in CASES if not asked.case or case.name in asked.case and not case.is_long
    ]
    each = -(-asked.errors // (4 * len(chosen)))
    total, missed, started = 0, 0, time.time()
    with working_in(asked.folder):
        inputs()
        for case in chosen:
            work = _small_disks if asked.tmpfs else _campaign
            in_a_child(lambda case=case, work=work: work(case, each))
            found = json.loads(Path(FOUND).read_text())
            Path(FOUND).unlink()
            wrong = [line for line in found if line]
            total, missed = total + len(found), missed + len(wrong)
            took = f"{time.time() - started:5.0f} s"
            print(f"{case.name:20} {len(found):4} errors, {took}", *wrong, sep="\n  ", flush=True)
    print(f"{total} errors; missed: {missed}")
    return 1 if missed else 0


def _campaign(case: Case, count: int) -> int:
    found: list[str] = []
    fresh(case, old=False)
    if command(case.words):
        found.append(f"{case.name}: fails without an error of the disk")
    for old in (False, True) if not found else ():
        fresh(case, old)
        at_first_output(case, lambda old=old: _all_errors(case, old, count, found))
    Path(FOUND).write_text(json.dumps(found))
    return 0


def _all_errors(case: Case, old: bool, count: int, found: list[str]) -> None:
    for one in erred(case, old, count):
        if one is None:
            return  # a child, which goes on
        found.append(one)
    raise Enough


def erred(case: Case, old: bool, count: int) -> Iterator[str | None]:
    """What was missed, or "", at each error; None in a child."""
    fresh(case, old)
    whole = run()
    if whole is None:
        yield None
        return
    new = contents()
    for error, onward in ((errno.EIO, False), (errno.ENOSPC, True)):
        for at in points(whole.calls, count):
            fresh(case, old)
            before = contents()
            os.truncate(SAID, 0)
            ended = run(at, error, onward)
            if ended is None:
                yield None
                return
            called = f"{errno.errorcode[error]} at call {at} ({whole.calls[at]})"
            where = f"{case.name}{' over an old one' if old else ''}, {called}"
            wrong = judged(case, before, new, contents())[1] or told(ended.status, new)
            if not wrong:
                status = gone_on()
                if status is None:
                    yield None
                    return
                if status or contents() != new:
                    wrong = f"after the next run (status {status}): {sorted(contents())[:3]}"
            yield f"{where}: {wrong}" if wrong else ""


def told(status: int, new: dict[str, bytes]) -> str:
    """What is wrong with what a command said and how it ended."""
    said = Path(SAID).read_bytes().decode(errors="replace").splitlines()
    if status == 0:
        now = {n: d for n, d in contents().items() if TEMPORARY not in n}
        return "" if now == new else "status 0 without the new outputs"
    if status < 0:
        return f"ended by signal {-status}"
    if len(said) != 1 or len(said[0]) > LONGEST or "not foreseen" in said[0]:
        return f"said {said[:3]}"
    return ""


def _small_disks(case: Case, _: int) -> int:
    found = []
    for old in (False, True):
        for size in (*SMALL_KB, None):
            fresh(case, old=False)
            _system("mount", "-t", "tmpfs", "-o", f"size={size or 256}k", "none", "out")
            try:
                if old:
                    case.put_old(Path("out"))
                if size is None:
                    _system("mount", "-o", "remount,ro", "out")
                wrong = _on_a_disk(case, read_only=size is None)
                disk = "read-only" if size is None else f"{size} kB"
                found.append(f"{case.name}, {disk}: {wrong}" if wrong else "")
            finally:
                _system("umount", "out")
    Path(FOUND).write_text(json.dumps(found))
    return 0


def _on_a_disk(case: Case, *, read_only: bool) -> str:
    """What is wrong after a run on a small disk."""
    before = contents()
    status = in_a_child(lambda: command(case.words))
    after = contents()
    left = [name for name in after if TEMPORARY in name]
    # Of several outputs of one call the first may be new and the second not: each is whole.
    one = len(case.outputs) == 1
    if status and (one or read_only) and after != before:
        return f"status {status}, and the outputs changed"
    return told(status, after) or (f"{left[0]} is left" if left else "")


def _system(*words: str) -> None:
    subprocess.run(words, check=True)


if __name__ == "__main__":
    sys.exit(main())
