"""``python -m armimpedance`` and the console script; standard library only until a command runs."""

from __future__ import annotations

import os
import sys


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return its exit status: 0, 1, 2, or 130 where interrupted."""
    _fill_standard_streams()
    # Matrices here are small: threads would get into each other's way and change the last bits.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[variable] = "1"
    # Pictures go to files; a backend for windows may be missing or misspelt.
    os.environ["MPLBACKEND"] = "Agg"
    try:
        from armimpedance.app.cli.main import run

        return run(sys.argv[1:] if argv is None else argv)
    except KeyboardInterrupt:  # while modules are loaded
        if sys.stderr is not None:
            sys.stderr.write("armimpedance: interrupted\n")
        return 130


def _fill_standard_streams() -> None:
    """Put nothing where a standard stream is closed.

    The next file that is opened would have its number, and what a library writes to standard error
    would stand in that file.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free: this one
    if sys.stderr is None:  # NumPy 2.0 asks for its `write` while it is loaded
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115


if __name__ == "__main__":
    sys.exit(main())
