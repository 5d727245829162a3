"""Any error as one line for a user and an exit status, in one place."""

from __future__ import annotations

import errno
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

from armimpedance.cli.parts.stopping import Stopped
from armimpedance.errors import LONGEST_MESSAGE, ArmImpedanceError, WorkerError, shortened, shown

#: The input or the call is wrong.
WRONG_INPUT: Final = 2
#: Anything else: the machine, the disk, or an error of ours.
FAILED: Final = 1
#: As shells tell a program that Ctrl-C ended; and one that any signal ended, with its number.
INTERRUPTED: Final = 130
_BY_SIGNAL: Final = 128

#: Set in the environment, an unexpected error shows where in the program it happened.
TRACEBACK: Final = "ARMIMPEDANCE_TRACEBACK"

#: Errors of the system that are the machine's; the others are the call's, such as a wrong path.
_OF_THE_MACHINE: Final = {
    *(errno.ENOSPC, errno.EFBIG, errno.EIO, errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.EAGAIN),
    *(errno.EROFS, getattr(errno, "EDQUOT", errno.ENOSPC)),
}


def told(error: BaseException) -> tuple[str, int]:
    """What a user is told of an error, and the exit status.

    Parameters
    ----------
    error : BaseException

    Returns
    -------
    line : str
        Without the name of the command.
    status : int
    """
    if isinstance(error, ArmImpedanceError):
        return _line(str(error)), FAILED if isinstance(error, WorkerError) else WRONG_INPUT
    if isinstance(error, Stopped):
        name = signal.Signals(error.number).name
        return f"ended by {name}; nothing half-written is left", _BY_SIGNAL + error.number
    if isinstance(error, KeyboardInterrupt):
        return "interrupted; nothing half-written is left", INTERRUPTED
    if isinstance(error, MemoryError):
        return "this machine has not enough memory for that; nothing was written", FAILED
    if isinstance(error, OSError):
        name = str(error.filename) if isinstance(error.filename, str | bytes) else ""
        if not name and not _has_working_folder():
            name = "the working folder"
        where = f"{shortened(shown(name), LONGEST_MESSAGE // 2)}: " if name else ""
        status = FAILED if error.errno in _OF_THE_MACHINE else WRONG_INPUT
        return _line(f"{where}{error.strerror or error}"), status
    what = _line(f"{type(error).__name__}: {error}")
    asked = f"set {TRACEBACK}=1 to see where, and report it, please"
    return shortened(f"an error that was not foreseen: {what}", 280) + f" ({asked})", FAILED


def _has_working_folder() -> bool:
    try:
        os.getcwd()
    except OSError:
        return False
    return True


def _line(text: str) -> str:
    return shortened(shown(" ".join(text.split())), LONGEST_MESSAGE)


@contextmanager
def library_warnings(tell: Callable[[str], object]) -> Iterator[None]:
    """Collect what libraries warn of or log, and tell each once, as a line, at the end.

    Which warnings are shown at all, or are errors, stays as it is.

    Parameters
    ----------
    tell : callable
        Takes a line.
    """
    import logging
    import warnings

    seen: dict[str, int] = {}

    def count(text: str) -> None:
        seen[text] = seen.get(text, 0) + 1

    def collect(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        count(_line(f"{category.__name__}: {message}"))

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            # Matplotlib's own module logs one thing: that its cache lies somewhere else today.
            if record.name != "matplotlib":
                count(_line(f"{record.name}: {record.getMessage()}"))

    collector = Collector(logging.WARNING)
    before, warnings.showwarning = warnings.showwarning, collect
    logging.getLogger().addHandler(collector)
    try:
        yield
    finally:
        warnings.showwarning = before
        logging.getLogger().removeHandler(collector)
        for text, times in seen.items():
            often = f" ({times} times)" if times > 1 else ""
            tell(f"a library warned{often}: {text}")
