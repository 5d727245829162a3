"""Damaged inputs for every command: is each used, or refused in one line that names it?

The calls are those of `command_cases.py`, their inputs small and whole (`command_files.py`). Of
each call one input is damaged (`mutations.py`), or now and then one word of the call itself, and
the command runs as a user runs it, in a process of its own. Asked: status 0 or 2 (3 of `convert`);
where refused, one line of at most 400 characters that names an input, and no output; no library's
warning; no control character on the screen; no `nan` or infinity in an output of text; no input
altered, nothing left beside the outputs; at most 5 s and 1 GB. Exit status 0 if nothing missed.

    python benchmarks/doors/hostile_commands.py --count 100
    python benchmarks/doors/hostile_commands.py --case elbow --count 1000 --keep missed
    python benchmarks/doors/hostile_commands.py --case "elbow --out" --first 17 --count 1
"""

# The number of threads must be set before numpy is imported.
# ruff: noqa: E402

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[variable] = "1"

import argparse
import gc
import json
import resource
import shutil
import signal
import sys
import tempfile
import time
import warnings
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from command_cases import CASES
from command_files import build
from hostile_outputs import Run, misses
from meanings import TEXTS
from mutations import damage

from armimpedance.app.cli.main import run as run_call

LONGEST_S, LARGEST_MB = 5.0, 1024.0
#: Seconds on the clock after which a run hangs.
HANGS_S = 60
#: Address space that a run may take beyond what is loaded before it.
ROOM = 1 << 30
#: Damaged inputs that one process tries; it does not outlive a miss of memory.
MOST_OF_A_CHILD = 25
#: How often the call is damaged and not a file.
OF_CALLS = 0.08


@dataclass(frozen=True)
class Case:
    """A call, where its sound inputs are, where it runs, and where its misses are kept."""

    call: str
    shop: Path
    folder: Path
    keep: Path | None


@dataclass(frozen=True)
class Tried:
    """One damaged call: what was typed, where it ran, what it said, what it took."""

    words: list[str]
    run: Run
    seconds: float
    mb: float


def main() -> int:
    """Damage, run, count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100, help="damaged inputs a call")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("--case", action="append", help="calls that contain this only")
    parser.add_argument("--keep", type=Path, help="keep inputs that missed in this folder")
    parser.add_argument("--shop", type=Path, help="where the sound inputs are, or are to be made")
    arguments = parser.parse_args()
    cases = [c for c in CASES if any(word in c for word in arguments.case or [""])]
    numbers = range(arguments.first, arguments.first + arguments.count)
    print(f"{'runs':>6} {'done':>6} {'refused':>7} {'slowest':>8} {'peak':>7}  missed  call")
    # On the shop's own disk: a run's inputs are other names of the sound ones.
    beside = arguments.shop.resolve().parent if arguments.shop else None
    with tempfile.TemporaryDirectory(dir=beside) as folder:
        shop = stocked(arguments.shop or Path(folder) / "shop")
        missed = [try_case(case, numbers, shop, Path(folder), arguments.keep) for case in cases]
    return 1 if any(missed) else 0


def stocked(shop: Path) -> Path:
    """The sound inputs, made where they are not there yet."""
    if not shop.exists():
        shop.mkdir(parents=True)
        build(shop)
    return shop.resolve()


def try_case(case: str, numbers: range, shop: Path, folder: Path, keep: Path | None) -> int:
    """All damaged inputs of one call; the number of misses."""
    fault = warm_up(case, shop, folder)
    if fault:
        print(f"the sound call fails: {case}: {fault}", flush=True)
        return 1
    told: Counter[str] = Counter()
    first: dict[str, int] = {}
    slowest = peak = 0.0
    for line in children(Case(case, shop, folder, keep), numbers):
        slowest, peak = max(slowest, line["seconds"]), max(peak, line["mb"])
        told["done" if line["status"] == 0 else "refused"] += 1
        for miss in line["misses"]:
            told[f"! {miss}"] += 1
            first.setdefault(miss, line["number"])
    bad = {kind: n for kind, n in told.items() if kind.startswith("!")}
    print(
        f"{len(numbers):6d} {told['done']:6d} {told['refused']:7d} {slowest:7.2f}s {peak:5.0f}MB "
        f"{sum(bad.values()):6d}  {case}",
        flush=True,
    )
    for kind, n in bad.items():
        print(f"       {kind} ({n}, --first {first[kind[2:]]})", flush=True)
    return sum(bad.values())


def children(case: Case, numbers: range) -> Iterator[dict[str, Any]]:
    """What came of each damaged input; a child tries several, and another goes on behind it."""
    report = case.folder / "report.jsonl"
    at = numbers.start
    while at < numbers.stop:
        some = range(at, min(numbers.stop, at + MOST_OF_A_CHILD))
        report.write_text("")
        child = os.fork()
        if child == 0:
            leave(case, some, report)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        for text in report.read_text().splitlines():
            line = json.loads(text)
            at = line["number"] + 1
            yield line
        if at < some.stop and status != 0:
            how = f"ended by signal {-status}" if status < 0 else f"ended with status {status}"
            yield {"number": at, "status": status, "misses": [how], "seconds": 0.0, "mb": 0.0}
            at += 1


def leave(case: Case, numbers: range, report: Path) -> NoReturn:
    """Work, and end without what the parent has to do at its end."""
    status = 70
    try:
        work(case, numbers, report)
        status = 0
    except BaseException as error:  # ours: it must be seen, and not taken for the command's
        print(f"{case.call}: {type(error).__name__}: {error}", file=sys.stderr, flush=True)
    finally:
        os._exit(status)


def work(case: Case, numbers: range, report: Path) -> None:
    """The child: damage, run, look, and say of each input what came of it."""
    os.setsid()
    taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + ROOM, taken + ROOM))
    with report.open("a") as stream:
        for number in numbers:
            signal.alarm(HANGS_S)
            tried = attempt(case.call, number, case.shop, case.folder / "run")
            found = misses(tried.run) + over_the_limits(tried)
            line = {"number": number, "status": tried.run.status, "misses": found}
            line |= {"seconds": tried.seconds, "mb": tried.mb}
            if case.keep and found:
                name = f"{zlib.crc32(case.call.encode()):08x}-{number}"
                kept(case.keep / name, case.call, number, found, tried)
            print(json.dumps(line), file=stream, flush=True)
            # A peak is a process's own: what comes after it starts anew.
            if tried.mb > LARGEST_MB:
                return


def warm_up(case: str, shop: Path, folder: Path) -> str:
    """Run the sound call once here, so that what it imports is loaded; what was wrong."""
    home = folder / "warm"
    lay_out(case, shop, home)
    status = run_here(case.split(), home, home.with_suffix(".said"))
    gc.freeze()
    return "" if status == 0 else (home.with_suffix(".said") / "err").read_text().strip()


def lay_out(case: str, shop: Path, home: Path) -> list[Path]:
    """A new folder with the inputs that a call names; the places that may be damaged."""
    shutil.rmtree(home, ignore_errors=True)
    home.mkdir()
    places = []
    for word in dict.fromkeys(case.split()):
        top = word.split("/")[0]
        if not (shop / top).exists():
            continue
        if (shop / top).is_dir() and not (home / top).exists():
            shutil.copytree(shop / top, home / top, copy_function=os.link)
        elif not (home / top).exists():
            os.link(shop / top, home / top)
        places.append(home / word if "/" not in word else home / top)
    return places


def attempt(case: str, number: int, shop: Path, home: Path) -> Tried:
    """Damage one input of a call and run it."""
    rng = np.random.default_rng([zlib.crc32(case.encode()), number])
    places = lay_out(case, shop, home)
    words = case.split()
    of_call = rng.random() < OF_CALLS or not places
    if of_call:
        damage_call(words, home, rng)
    else:
        damage(places[int(rng.integers(len(places)))], rng)
    before = state_of(home)
    said = home.with_suffix(".said")
    # What this process was warned of once must be told again.
    warnings.filterwarnings("ignore", category=ResourceWarning)
    began = time.process_time()
    status = run_here(words, home, said)
    seconds = time.process_time() - began
    mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    out, err = ((said / name).read_bytes() for name in ("out", "err"))
    run = Run(words, of_call, home, status, out, err, before, state_of(home))
    return Tried(words, run, seconds, mb)


def damage_call(words: list[str], home: Path, rng: np.random.Generator) -> None:
    """Another word in place of one that names neither a command, an input nor an output."""
    free = [
        i
        for i, word in enumerate(words)
        if i > 0 and words[i - 1].startswith("--") and not word.startswith("--")
        if not word.startswith("out") and not (home / word).exists()
        # How much work is asked for is the caller's own affair.
        if words[i - 1] not in ("--permutations", "--order")
    ]
    if free:
        text = TEXTS[int(rng.integers(len(TEXTS)))].replace("\x00", "")
        words[free[int(rng.integers(len(free)))]] = text.encode("utf-8", "replace").decode()


def state_of(home: Path) -> dict[str, tuple[int, int, int]]:
    """Every file with what changes when it is written to."""
    found = {}
    for file in home.rglob("*"):
        if file.is_file():
            held = file.stat()
            found[str(file.relative_to(home))] = (held.st_ino, held.st_size, held.st_mtime_ns)
    return found


def run_here(words: list[str], home: Path, said: Path) -> int:
    """Run a call in its folder with both streams in files; the status."""
    said.mkdir(exist_ok=True)
    before, streams = Path.cwd(), (sys.stdout, sys.stderr)
    os.chdir(home)
    try:
        with (said / "out").open("w") as sys.stdout, (said / "err").open("w") as sys.stderr:
            return run_call(words)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1
    except BaseException as error:  # whatever comes out of a command is what we look for
        (said / "err").write_text(f"{type(error).__name__} came out: {str(error)[:200]}")
        return 99
    finally:
        sys.stdout, sys.stderr = streams
        os.chdir(before)


def over_the_limits(tried: Tried) -> list[str]:
    """What a run took too much of."""
    slow = [f"took more than {LONGEST_S:g} s"] if tried.seconds > LONGEST_S else []
    return slow + (["took more than 1 GB"] if tried.mb > LARGEST_MB else [])


def kept(folder: Path, case: str, number: int, found: list[str], tried: Tried) -> None:
    """Keep the inputs of a run, and how to run it again."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(tried.run.home, folder / "run")
    told = {
        "case": case,
        "number": number,
        "misses": found,
        "words": tried.words,
        "status": tried.run.status,
        "seconds": round(tried.seconds, 2),
        "mb": round(tried.mb),
        "stderr": tried.run.err.decode("utf-8", "replace")[:2000],
        "when": time.strftime("%Y-%m-%d %H:%M:%S", time.gmtime()),
    }
    (folder / "missed.json").write_text(json.dumps(told, indent=1), encoding="utf-8")


if __name__ == "__main__":
    raise SystemExit(main())
