"""Run the tests of what has changed since a revision, the nearest first, for at most 40 seconds.

    python tests/touched.py [--since REVISION] [--minutes N] [--study]

A test file is touched if it has changed itself, or if it imports a module that has changed. Those
in the folder that mirrors the module's come first. What does not fit into the time is counted;
`make test` runs it, and with --study, which takes the slow tests in their place, `make study`.
"""

from __future__ import annotations

import argparse
import ast
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SECONDS = 40.0


class InTime:
    """A pytest plugin that starts no test after the time is over."""

    def __init__(self, seconds: float) -> None:
        self.end, self.left = time.monotonic() + seconds, 0

    def pytest_runtest_setup(self) -> None:
        """Leave the test out if it is late."""
        if time.monotonic() > self.end:
            self.left += 1
            pytest.skip("the time is over")


def changed(since: str) -> list[Path]:
    """Python files that differ from the revision, also those that are not committed."""
    ways = (["diff", "--name-only", since], ["ls-files", "--others", "--exclude-standard"])
    calls = (["git", "-C", str(ROOT), *way] for way in ways)
    # without a history (a source archive) nothing is known to have changed
    lines = [subprocess.run(c, capture_output=True, text=True, check=False).stdout for c in calls]
    paths = (Path(line) for line in "".join(lines).splitlines())
    return [path for path in paths if path.suffix == ".py" and (ROOT / path).exists()]


def imported(path: Path) -> set[str]:
    """Modules of the project that a file names, and those that hold the names."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module]
    modules = {str(node.module) for node in nodes}
    return modules | {f"{node.module}.{alias.name}" for node in nodes for alias in node.names}


def touched(paths: list[Path]) -> list[str]:
    """Test files, those that have changed and those of the same folder first."""
    modules = {".".join(path.with_suffix("").parts).removesuffix(".__init__") for path in paths}
    rooms = {module.rpartition(".")[0] for module in modules} - {""}
    folders = {Path("tests/unit", *path.parent.parts[1:]) for path in paths}
    ranked = []
    for test in sorted(ROOT.glob("tests/**/test_*.py")):
        own = test.relative_to(ROOT)
        if own.parts[1] in ("browser", "office"):
            continue
        named = imported(test)
        near = any(own.is_relative_to(folder) for folder in folders if len(folder.parts) > 2)
        if own in paths or named & modules:
            ranked.append((0 if own in paths else 1, str(own)))
        elif near or named & rooms:
            ranked.append((2 if near else 3, str(own)))
    return [test for _, test in sorted(ranked)]


def main() -> int:
    """Run them; pytest's exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--since", default="HEAD", help="a revision (default: HEAD)")
    parser.add_argument("--minutes", type=float, default=SECONDS / 60)
    parser.add_argument("--study", action="store_true", help="the slow tests")
    chosen = parser.parse_args()
    tests = touched(changed(chosen.since))
    if not tests:
        sys.stdout.write("no test is touched\n")
        return 0
    plugin, mark = InTime(60 * chosen.minutes), "study" if chosen.study else "not study"
    words = ["-q", "--no-header", "-x", "-r", "fE", "-m", mark, *tests]
    status = int(pytest.main(words, plugins=[plugin]))
    if plugin.left:
        rest = "make study" if chosen.study else "make test"
        sys.stdout.write(f"{plugin.left} touched tests are left to `{rest}`\n")
    # no test of this mark among the touched files is no failure
    return 0 if status == pytest.ExitCode.NO_TESTS_COLLECTED else status


if __name__ == "__main__":
    sys.exit(main())
