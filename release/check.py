"""Build the distributions and use the wheel as a newcomer does: without the repository.

    python release/check.py OUT --python python3.12

Builds source distribution and wheel into OUT, checks their metadata, contents and size, installs
the wheel with what it needs (the versions of the lock, or the newest with --newest), and there runs
the quick demo, the tests of the source distribution that are named below, and a type checker over a
user's script.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tarfile
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LARGEST_MB = 3.0
#: What an installed package cannot do without, beside its modules.
NEEDED = (
    "armimpedance/py.typed",
    "manipulandum_sim/py.typed",
    "armimpedance/__init__.pyi",
    "armimpedance/hand/planning/profiles/designed.csv",
    "armimpedance_figures/__init__.py",
)
#: Tests that are quick and go through files, estimates, mapping and models.
SHIPPED = ("tests/unit/hand/ellipses", "tests/unit/hand/levels")


def main() -> None:
    """Build, look, install, use."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--python", default=sys.executable, help="interpreter to install for")
    parser.add_argument("--newest", action="store_true", help="not the lock: the newest of all")
    arguments = parser.parse_args()
    wheel, source = built(arguments.out.resolve())
    looked_at(wheel)
    with tempfile.TemporaryDirectory() as folder:
        python = installed(wheel, Path(folder) / "venv", arguments.python, newest=arguments.newest)
        used(python, source, Path(folder))
    print(f"package: {wheel.name} installs and runs without the repository")


def built(out: Path) -> tuple[Path, Path]:
    """Wheel and source distribution; the wheel is built from the source distribution."""
    for old in out.glob("armimpedance-*"):
        old.unlink()
    run(sys.executable, "-m", "build", "--outdir", str(out), str(ROOT), quiet=True)
    (wheel,), (source,) = out.glob("*.whl"), out.glob("*.tar.gz")
    run(sys.executable, "-m", "twine", "check", "--strict", str(wheel), str(source))
    return wheel, source


def looked_at(wheel: Path) -> None:
    """Refuse a wheel that is large, lacks something or holds what is not ours to install."""
    size = wheel.stat().st_size / 1e6
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    problems = [f"{size:.2f} MB, more than {LARGEST_MB:g}"] if size > LARGEST_MB else []
    problems += [f"lacks {name}" for name in NEEDED if name not in names]
    packages = (
        r"(armimpedance|armimpedance_figures|manipulandum_sim|armimpedance-[^/]+\.dist-info)/"
    )
    problems += [f"holds {name}" for name in names if not re.match(packages, name)]
    if problems:
        raise SystemExit(f"package: {wheel.name}: {'; '.join(problems)}")
    print(f"package: {wheel.name}, {size:.2f} MB, {len(names)} files")


def installed(wheel: Path, place: Path, python: str, *, newest: bool) -> Path:
    """The interpreter of a new environment that holds the wheel and what it needs."""
    if Path(python).resolve() == Path(sys.executable).resolve():
        venv.create(place, with_pip=False)
    else:
        run(python, "-m", "venv", "--without-pip", str(place))
    made = place / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    quietly = ("--quiet", "--disable-pip-version-check", "--no-compile")
    # the pip of this environment serves the other, too: to install one took longer than to use it
    pip = (sys.executable, "-m", "pip", "--python", str(made))
    install = (*pip, "install", *quietly)
    # constraints know no hashes of a wheel that was built just now
    lock = place / "constraints.txt"
    exact = re.findall(r"^\S+==\S+", (ROOT / "requirements.lock").read_text(), re.MULTILINE)
    lock.write_text("\n".join(exact))
    limits = () if newest else ("--constraint", str(lock))
    run(*install, *limits, f"{wheel}[usual]", "pytest", "hypothesis", "mypy", "pandas-stubs")
    run(*pip, "check", "--disable-pip-version-check")
    return made


def used(python: Path, source: Path, folder: Path) -> None:
    """Run the demo, the tests and a type checker away from the repository."""
    with tarfile.open(source) as archive:
        archive.extractall(folder, filter="data")
    unpacked = folder / source.name.removesuffix(".tar.gz")
    # the tests alone: what they import has to be the installed package
    work = folder / "work"
    work.mkdir()
    for name in ("tests", "pyproject.toml"):
        (unpacked / name).rename(work / name)
    run(str(python), "-m", "armimpedance", "--version", cwd=work)
    run(str(python), "-m", "armimpedance", "demo", "--quick", "--out", "demo", cwd=work, quiet=True)
    if not (work / "demo" / "hand.csv").stat().st_size:
        raise SystemExit("package: the demo wrote no results")
    run(str(python), "-m", "pytest", "-q", "-p", "no:cacheprovider", *SHIPPED, cwd=work)
    script = work / "typed_use.py"
    script.write_text((ROOT / "release" / "typed_use.py").read_text())
    run(
        str(python),
        "-m",
        "mypy",
        "--strict",
        "--python-executable",
        str(python),
        str(script),
        cwd=work,
    )
    run(str(python), str(script), cwd=work, quiet=True)


def run(*command: str, cwd: Path | None = None, quiet: bool = False) -> None:
    """Run a command, without the repository's modules in sight; its output where it fails."""
    clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(command, cwd=cwd, env=clean, capture_output=quiet, text=True, check=False)
    if done.returncode:
        raise SystemExit(
            f"package: {' '.join(command)} ended with {done.returncode}\n{done.stdout}{done.stderr}"
        )


if __name__ == "__main__":
    main()
