"""Run the tests against the oldest versions that `pyproject.toml` allows, or the newest there are.

    python release/versions.py OUT --python python3.13 --resolution highest
    python release/versions.py OUT tests/unit/hand/levels --resolution lowest-direct

An environment of its own, the wheel, and the tests in a folder without the package's source.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

from check import ROOT, built, run

TESTS = ["tests/oracles", "tests/recovery", "tests/unit"]


def main() -> None:
    """Resolve, install, test."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--resolution", choices=("lowest-direct", "highest"), default="highest")
    parser.add_argument("tests", nargs="*", default=TESTS)
    arguments = parser.parse_args()
    wheel, _ = built(arguments.out.resolve())
    uv = str(Path(sys.executable).with_name("uv"))
    with tempfile.TemporaryDirectory() as folder:
        place, work = Path(folder) / "venv", Path(folder) / "work"
        run(uv, "venv", "--quiet", "--seed", "--python", arguments.python, str(place))
        wanted = Path(folder) / "versions.txt"
        resolve = (uv, "pip", "compile", "--quiet", "--extra", "dev", str(ROOT / "pyproject.toml"))
        how = ("--resolution", arguments.resolution, "--python", str(place), "-o", str(wanted))
        run(*resolve, *how)
        install = (uv, "pip", "install", "--quiet", "--python", str(place))
        run(*install, "--requirement", str(wanted))
        run(*install, "--no-deps", str(wheel))
        # some tests read the pages and the build's own settings; none may import the source
        for name in ("tests", "docs", "benchmarks", "figures", "release"):
            shutil.copytree(ROOT / name, work / name, ignore=shutil.ignore_patterns("__pycache__"))
        for name in ("pyproject.toml", "Makefile", "CITATION.cff", "README.md", "CHANGELOG.md"):
            shutil.copy(ROOT / name, work)
        python = str(place / "bin" / "python")
        options = ("-q", "-n", "2", "-p", "no:cacheprovider")
        run(python, "-m", "pytest", *options, *arguments.tests, cwd=work)


if __name__ == "__main__":
    main()
