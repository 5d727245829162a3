"""The inputs of the cases, and commands that stop where their first output begins."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterable, Sequence
from contextlib import contextmanager
from pathlib import Path

from cases import INPUTS, Case

#: What a command prints, and what it says of an error.
PRINTED, SAID = "printed.txt", "said.txt"


class Enough(BaseException):
    """Ends a command that stopped at its first output."""


def inputs() -> None:
    """Write what the cases read into the working folder."""
    for line in INPUTS:
        if in_a_child(lambda line=line: command(line.split())):
            raise RuntimeError(f"{line}: {Path(SAID).read_text()}")


def command(words: Sequence[str]) -> int:
    """A call of the command line, in a child: what it prints goes to files."""
    for number, name in ((1, PRINTED), (2, SAID)):
        handle = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND)
        os.dup2(handle, number)
        os.close(handle)
    from armimpedance.__main__ import main

    try:
        return main(list(words))
    except SystemExit as end:
        return int(end.code or 0)


def at_first_output(case: Case, faults: Callable[[], None]) -> None:
    """Run a command up to where it begins to write; there, `faults` goes on in children.

    All that was read and computed is there, so that a fault costs the writing alone. A child of
    `faults` that returns from it goes on with the command.

    Parameters
    ----------
    case : Case
    faults : function
        In a child it returns; at its end it raises `Enough`.
    """
    from armimpedance.core import outputs

    real, met = outputs._final_path, []

    def first(path: str | os.PathLike[str]) -> Path:
        if not met:
            met.append(path)
            faults()
        return real(path)

    outputs._final_path = first
    try:
        # A child of `faults` ends here.
        os._exit(command(case.words))
    except Enough:
        return
    finally:
        outputs._final_path = real


def in_a_child(work: Callable[[], int]) -> int:
    """Run `work` in a child; its exit status."""
    child = os.fork()
    if child == 0:
        status = 99
        try:
            status = work()
        finally:
            os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def gone_on() -> int | None:
    """None in a child, which goes on with the command; its exit status in the parent."""
    child = os.fork()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) if child else None


def folders_made() -> list[Path]:
    """Folders below that of the outputs; a command may make them before it writes."""
    return sorted(path for path in Path("out").rglob("*") if path.is_dir())


def fresh(case: Case, old: bool, folders: Iterable[Path] = ()) -> None:
    """The folder of the outputs as it is before the first output."""
    shutil.rmtree("out", ignore_errors=True)
    os.mkdir("out")
    for folder in folders:
        if not old or folder.name not in case.outputs:
            folder.mkdir(exist_ok=True)
    if old:
        case.put_old(Path("out"))


def contents() -> dict[str, bytes]:
    """Every file below the folder of the outputs."""
    out = Path("out")
    files = (path for path in out.rglob("*") if path.is_file())
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in files}


@contextmanager
def working_in(folder: Path):
    """Work in a new folder that is removed at the end."""
    import tempfile

    with tempfile.TemporaryDirectory(dir=folder) as place:
        os.chdir(place)
        try:
            yield
        finally:
            os.chdir("/")
