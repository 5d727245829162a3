"""Damaged files at every door: is each read, or refused in one line that names it?

For each format a small valid file is written and damaged `--count` times (`mutations.py`);
each damaged file is opened in a process of its own kind, whose time and memory are measured. Asked:
typed errors only, one line of at most 400 characters with the file's name, no library's warning, at
most 2 s a file and 1 GB in all. A process that dies or hangs counts as a miss, and the next goes on
behind it. Exit status 0 if nothing missed, else 1.

    python benchmarks/doors/hostile_files.py --count 10000
    python benchmarks/doors/hostile_files.py --door "MATLAB 5" --count 200
"""

# The number of threads must be set before numpy is imported.
# ruff: noqa: E402

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import json
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from mutations import damage
from small_files import DOORS

from armimpedance.core.errors import ArmImpedanceError

LONGEST_S, LARGEST_MB, LONGEST_LINE = 2.0, 1024.0, 400
#: A process that is silent for this long hangs.
HANGS_S = 30


def main() -> int:
    """Damage, open, count; the child's part where it is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="damaged files a door")
    parser.add_argument("--door", action="append", help="of this name only")
    parser.add_argument("--first", type=int, default=0, help=argparse.SUPPRESS)
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--keep", type=Path, help="keep damaged files that missed in this folder")
    arguments = parser.parse_args()
    names = arguments.door or list(DOORS)
    if arguments.child:
        work(names[0], arguments.first, arguments.count)
        return 0
    print(f"{'door':26} {'files':>7} {'read':>7} {'refused':>8} {'slowest':>8} {'peak':>8}  missed")
    missed = [try_door(name, arguments.count, arguments.keep) for name in names]
    return 1 if any(missed) else 0


def try_door(name: str, count: int, keep: Path | None) -> int:
    """All damaged files of one format; the number of misses."""
    told: Counter[str] = Counter()
    examples: dict[str, int] = {}
    slowest = peak = 0.0
    first = 0
    while first < count:
        for line in children(name, first, count):
            kind = line["outcome"]
            told[kind] += 1
            first = line["index"] + 1
            slowest, peak = max(slowest, line["seconds"]), max(peak, line["mb"])
            examples.setdefault(kind, line["index"])
    misses = {kind: n for kind, n in told.items() if kind not in ("read", "refused")}
    shown = "; ".join(f"{kind} ({n}, first {examples[kind]})" for kind, n in misses.items())
    print(
        f"{name:26} {count:7d} {told['read']:7d} {told['refused']:8d} {slowest:7.2f}s "
        f"{peak:6.0f}MB  {shown or 'none'}",
        flush=True,
    )
    for index in examples.values() if keep and misses else ():
        make(name, index, keep / f"{index}")
    return sum(misses.values())


def children(name: str, first: int, count: int) -> Iterator[dict[str, Any]]:
    """What a process says of each file; it ends with the process, which may have died."""
    words = [sys.executable, __file__, "--child", "--door", name]
    words += ["--first", str(first), "--count", str(count)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as done:
        at = first
        for text in done.stdout or ():
            line = json.loads(text)
            at = line["index"] + 1
            yield line
        said = [text for text in done.stderr or () if "Warning" not in text and text.strip()]
    if at < count:
        how = f"died: {said[-1].strip()[:100] if said else 'status ' + str(done.returncode)}"
        yield {"index": at, "outcome": how, "seconds": 0.0, "mb": 0.0}


def work(name: str, first: int, count: int) -> None:
    """Damage and open files, and say of each what came of it."""
    # A door that writes into our own standard output must not be heard.
    out = os.fdopen(os.dup(1), "w")
    original(name)
    warnings.simplefilter("error")
    warnings.simplefilter("ignore", ResourceWarning)
    with tempfile.TemporaryDirectory() as folder:
        for index in range(first, count):
            signal.alarm(HANGS_S)
            place = make(name, index, Path(folder) / "try")
            began = time.perf_counter()
            outcome = opened(name, place)
            seconds = time.perf_counter() - began
            mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            if outcome in ("read", "refused") and seconds > LONGEST_S:
                outcome = "slow"
            if outcome in ("read", "refused") and mb > LARGEST_MB:
                outcome = "large"
            line = {"index": index, "outcome": outcome, "seconds": seconds, "mb": mb}
            print(json.dumps(line), file=out, flush=True)
            if outcome == "large":
                return


def make(name: str, index: int, folder: Path) -> Path:
    """The damaged file of this number, in a new folder."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(original(name), folder)
    place = DOORS[name].place(folder)
    damage(place, np.random.default_rng([sum(name.encode()), index]))
    return place


_ORIGINALS: dict[str, tempfile.TemporaryDirectory[str]] = {}


def original(name: str) -> Path:
    """A folder with the valid file."""
    if name not in _ORIGINALS:
        _ORIGINALS[name] = tempfile.TemporaryDirectory()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            DOORS[name].build(Path(_ORIGINALS[name].name))
            # What is refused as it is would be refused damaged, and show nothing.
            DOORS[name].read(DOORS[name].place(Path(_ORIGINALS[name].name)))
    return Path(_ORIGINALS[name].name)


def opened(name: str, place: Path) -> str:
    """What came of opening a damaged file: read, refused, or how it missed."""
    try:
        DOORS[name].read(place)
    except ArmImpedanceError as error:
        text = str(error)
        if len(text) > LONGEST_LINE:
            return "long message"
        if not text.isprintable():
            return "control character or line break in the message"
        # A mapping is wrong of a file, and both may be named.
        near = {place.name, place.parent.name, *(file.name for file in place.parent.iterdir())}
        return "refused" if any(name in text for name in near) else "message without the file"
    except Warning as warning:
        return f"warning {type(warning).__name__}: {str(warning)[:80]}"
    except BaseException as error:  # whatever is not typed is what we look for
        return f"{type(error).__name__}: {str(error)[:80]}"
    return "read"


if __name__ == "__main__":
    raise SystemExit(main())
