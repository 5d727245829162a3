"""The inputs of the cases, and a process that has loaded what the commands load."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from cases import INPUTS, Case

#: What a command prints, and what it says of an error.
PRINTED, SAID = "printed.txt", "said.txt"


def inputs() -> None:
    """Write what the cases read into the working folder."""
    for line in INPUTS:
        if in_a_child(command(line.split())):
            raise RuntimeError(f"{line}: {Path(SAID).read_text()}")


def load_modules(cases: Sequence[Case]) -> None:
    """Import here what each case imports, so that a child has it without reading a file.

    Imported, not run: threads that a library starts in its work would be lost in a child.
    """
    for case in cases:
        listing = Path("modules.txt")

        def loaded(case: Case = case, listing: Path = listing) -> int:
            os.mkdir("out")
            status = command(case.words)()
            listing.write_text("\n".join(sys.modules))
            return status

        if in_a_child(loaded):
            raise RuntimeError(f"{case.name}: {Path(SAID).read_text()}")
        os.system("rm -rf out")  # noqa: S605, S607
        for name in listing.read_text().split("\n"):
            if name.split(".")[0] in _LIBRARIES and name not in sys.modules:
                try:
                    importlib.import_module(name)
                except Exception as error:  # a name that a library put there by hand
                    print(f"not loaded: {name}: {error}", file=sys.stderr)


_LIBRARIES = {
    *("armimpedance", "armimpedance_figures", "manipulandum_sim", "numpy", "scipy", "pandas"),
    *("pyarrow", "matplotlib", "PIL", "cvxpy", "jinja2", "altair", "vl_convert", "openpyxl"),
    *("h5py", "pinocchio", "tqdm", "sqlite3", "xml", "zipfile", "html", "concurrent"),
}


def command(words: Sequence[str]) -> Callable[[], int]:
    """A call of the command line, for a child: what it prints goes to files."""

    def work() -> int:
        for number, name in ((1, PRINTED), (2, SAID)):
            handle = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(handle, number)
            os.close(handle)
        from armimpedance.__main__ import main

        try:
            return main(list(words))
        except SystemExit as end:
            return int(end.code or 0)

    return work


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
