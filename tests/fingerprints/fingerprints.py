"""Fingerprints of what the commands print and write, to hold a revision against another.

    python tests/fingerprints/fingerprints.py run FOLDER            every call of calls.txt
    python tests/fingerprints/fingerprints.py run FOLDER --small    those marked with * only
    python tests/fingerprints/fingerprints.py compare BEFORE AFTER  exit status 1 where bytes differ

`run` takes the calls in their order, each in a process of its own, in FOLDER/work, and writes
FOLDER/fingerprints.json: of each call the exit status, the hashes of what it printed and of every
file that it wrote. To compare two revisions run each with its own interpreter (--python) on the
same machine: last bits differ between machines. FOLDER/printed keeps the text, to look at.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

CALLS = Path(__file__).with_name("calls.txt")

#: Methods side by side end in a column of their time.
_METHODS = "weighted|definite|exact|frequency|instruments|likelihood|paper|weak_form"
#: What may differ between two runs of one revision: how long something took (the folder too).
PASSING = (
    (re.compile(r"\b\d+(\.\d+)? s\b"), "N s"),
    (re.compile(r"\b\d+ min\b"), "N min"),
    (re.compile(rf"(?m)^((?:{_METHODS}) .*) +[\d.]+$"), r"\1"),
)
#: The date in the head of a MATLAB file.
DATED = re.compile(rb"\AMATLAB 5\.0 MAT-file.{93}", re.DOTALL)


def calls(small: bool = False) -> list[str]:
    """The calls of the list, in order."""
    lines = [line.strip() for line in CALLS.read_text(encoding="utf-8").splitlines()]
    lines = [line for line in lines if line and not line.startswith(("#", "["))]
    return [line.lstrip("*") for line in lines if line.startswith("*") or not small]


def fingerprint(line: str, work: Path, python: str, printed: Path | None) -> dict[str, Any]:
    """Run one call in a folder; its exit status, and hashes of its text and of its files."""
    before = _stamps(work)
    done = subprocess.run(
        [python, "-m", "armimpedance", *shlex.split(line)],
        cwd=work,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        env={**os.environ, "COLUMNS": "100"},
    )
    after = _stamps(work)
    written = sorted(name for name, stamp in after.items() if before.get(name) != stamp)
    texts = {"out": _steady(done.stdout, work), "err": _steady(done.stderr, work)}
    if printed is not None:
        printed.write_text(f"$ {line}\n{texts['out']}\n--- stderr\n{texts['err']}")
    return {
        "status": done.returncode,
        **{name: _sha(text.encode()) for name, text in texts.items()},
        "files": {name: _sha(DATED.sub(b"", (work / name).read_bytes())) for name in written},
    }


def run(lines: list[str], folder: Path, python: str = sys.executable) -> dict[str, Any]:
    """The fingerprints of all calls, by their text and place in the list."""
    work, printed = folder / "work", folder / "printed"
    work.mkdir(parents=True)
    printed.mkdir()
    return {
        f"{row:03d} {line}": fingerprint(line, work, python, printed / f"{row:03d}.txt")
        for row, line in enumerate(lines)
    }


def differences(before: dict[str, Any], after: dict[str, Any]) -> Iterator[str]:
    """One line for each call or file that is not the same."""
    for call in sorted(before.keys() | after.keys()):
        one, other = before.get(call), after.get(call)
        if one is None or other is None:
            yield f"{call}: in one of the two only"
            continue
        for part in ("status", "out", "err"):
            if one[part] != other[part]:
                yield f"{call}: {part}"
        names = one["files"].keys() | other["files"].keys()
        for name in sorted(names):
            if one["files"].get(name) != other["files"].get(name):
                yield f"{call}: {name}"


def _stamps(work: Path) -> dict[str, tuple[int, int]]:
    files = [path for path in work.rglob("*") if path.is_file()]
    stats = {str(path.relative_to(work)): path.stat() for path in files}
    return {name: (stat.st_mtime_ns, stat.st_ino) for name, stat in stats.items()}


def _steady(text: bytes, work: Path) -> str:
    steady = text.decode(errors="replace").replace(str(work), "WORK")
    for pattern, name in PASSING:
        steady = pattern.sub(name, steady)
    return steady


def _sha(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def main() -> int:
    """Run or compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    steps = parser.add_subparsers(dest="step", required=True)
    step = steps.add_parser("run")
    step.add_argument("folder", type=Path)
    step.add_argument("--small", action="store_true")
    step.add_argument("--python", default=sys.executable)
    step = steps.add_parser("compare")
    step.add_argument("before", type=Path)
    step.add_argument("after", type=Path)
    chosen = parser.parse_args()
    if chosen.step == "run":
        found = run(calls(chosen.small), chosen.folder.resolve(), chosen.python)
        (chosen.folder / "fingerprints.json").write_text(json.dumps(found, indent=1))
        return 0
    both = [
        json.loads((at / "fingerprints.json").read_text()) for at in (chosen.before, chosen.after)
    ]
    found = list(differences(*both))
    texts = sum(len(entry["files"]) + 2 for entry in both[0].values())
    found.append(f"{len(both[0])} calls, {texts} texts and files, {len(found)} differ")
    sys.stdout.write("\n".join(found) + "\n")
    return 1 if len(found) > 1 else 0


if __name__ == "__main__":
    sys.exit(main())
