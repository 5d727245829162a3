"""Any error as one line for a user and an exit status, in one place."""

from __future__ import annotations

import errno
import os
import re
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from types import FrameType
from typing import Any, Final

from armimpedance.core.errors import (
    LONGEST_MESSAGE,
    ArmImpedanceError,
    WorkerError,
    shortened,
    shown,
)

# What the system sends to end a command: it ends as Ctrl-C ends it, nothing half-written.

#: Of a scheduler or a shutdown, and of a terminal that goes away.
_NAMES: Final = ("SIGTERM", "SIGHUP")


#: So long a command may tidy up, s.
_PATIENCE_S: Final = 2.0


class Stopped(KeyboardInterrupt):
    """The system asks this process to end.

    `number`: of the signal.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(number)


class AskedToEnd:
    """The request to end this process, if one came.

    `why`: a library that is interrupted may raise an error of its own in its place.
    """

    why: KeyboardInterrupt | None = None


@contextmanager
def stopped_in_order() -> Iterator[AskedToEnd]:
    """Turn a signal to end into `Stopped`; a second one at once finds the first at work.

    Later it is heeded again: a library may have swallowed the first. A signal that is ignored, as
    after ``nohup``, or that somebody else heeds, stays theirs.
    """
    asked = AskedToEnd()
    before = _own_signals()
    last = -_PATIENCE_S

    def stop(number: int, _: FrameType | None) -> None:
        nonlocal last
        if number == signal.SIGINT:
            asked.why = KeyboardInterrupt()
        elif monotonic() - last < _PATIENCE_S:
            return
        else:
            last, asked.why = monotonic(), Stopped(number)
        raise asked.why

    for each in before:
        signal.signal(each, stop)
    try:
        yield asked
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


def _own_signals() -> dict[int, Any]:
    """The signals that nobody has changed, and what they did until now."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    numbers = [getattr(signal, name) for name in _NAMES if hasattr(signal, name)]
    found: dict[int, Any] = dict.fromkeys(numbers, signal.SIG_DFL)
    found[signal.SIGINT] = signal.default_int_handler
    return {n: handler for n, handler in found.items() if signal.getsignal(n) is handler}


#: The input or the call is wrong.
WRONG_INPUT: Final = 2
#: Anything else: the machine, the disk, or an error of ours.
FAILED: Final = 1
#: As shells tell a program that Ctrl-C ended; and one that any signal ended, with its number.
INTERRUPTED: Final = 130
_BY_SIGNAL: Final = 128

#: Set in the environment, an unexpected error shows where in the program it happened.
TRACEBACK: Final = "ARMIMPEDANCE_TRACEBACK"

#: What Matplotlib says of each letter that it cannot draw.
_NO_GLYPH: Final = re.compile(r"Glyph (\d+) .*missing from", re.DOTALL)

#: Packages that not every system's installation holds, and how to have them.
_BROUGHT_BY: Final = {
    "pinocchio": "pip install 'armimpedance[bodies]'; on Windows: conda install -c conda-forge "
    "pinocchio",
    "cvxpy": "pip install 'armimpedance[models]'",
    "altair": "pip install 'armimpedance[report]'",
    **dict.fromkeys(("marimo", "uvicorn"), "pip install 'armimpedance[app]'"),
}

#: A library of the system that a package wants, in the loader's words, and who has it.
_NO_LIBRARY: Final = re.compile(r"^(\S+\.so\S*): cannot open shared object file")
_LIBRARIES: Final = {"libgomp.so.1": "Debian, Ubuntu: apt-get install libgomp1; Fedora: libgomp"}

#: Options whose files a command writes.
_WRITTEN: Final = {"out", "figure", "samples", "out_profile", "output", "folder", "out_folder"}

#: Errors of the system that are the machine's; the others are the call's, such as a wrong path.
_OF_THE_MACHINE: Final = {
    *(errno.ENOSPC, errno.EFBIG, errno.EIO, errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.EAGAIN),
    *(errno.EROFS, getattr(errno, "EDQUOT", errno.ENOSPC)),
}


def _of_the_system(error: OSError) -> tuple[str, int]:
    name = str(error.filename) if isinstance(error.filename, str | bytes) else ""
    if not name and not _has_working_folder():
        name = "the working folder"
    where = f"{shortened(shown(name), LONGEST_MESSAGE // 2)}: " if name else ""
    status = FAILED if error.errno in _OF_THE_MACHINE else WRONG_INPUT
    return _line(f"{where}{error.strerror or error}"), status


def told(error: BaseException) -> tuple[str, int]:
    """An error as one line for a user, and the exit status.

    Returns: `line`: without the name of the command.
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
        return _of_the_system(error)
    if isinstance(error, ModuleNotFoundError) and error.name in _BROUGHT_BY:
        return f"the package {error.name} is not installed ({_BROUGHT_BY[error.name]})", FAILED
    if isinstance(error, ImportError) and (lacks := _NO_LIBRARY.match(str(error))):
        hint = _LIBRARIES.get(lacks[1], "install it with the system's packages")
        return f"this system lacks the library {lacks[1]} ({hint})", FAILED
    what = _line(f"{type(error).__name__}: {error}")
    hint_to_report = f"set {TRACEBACK}=1 to see where, and report it, please"
    return shortened(
        f"an error that was not foreseen: {what}", 280
    ) + f" ({hint_to_report})", FAILED


def naming(line: str, options: Mapping[str, object]) -> str:
    """A line with the inputs of the call before it, where it names none of them.

    `line`: as `told` gives it.
    `options`: every option of the call with its value; files and folders that are there and are not
    to be written are its inputs.
    Returns: the line as it is, also where it is about the value of an option.
    """
    values = [value for name, value in options.items() if name not in _WRITTEN]
    places = [str(place) for place in _on_the_disk(values)]
    about_an_option = line.startswith("--") or any(
        isinstance(value, str) and repr(value) in line for value in values
    )
    written = [str(options[name]) for name in _WRITTEN if options.get(name)]
    named = any(_stands_in(line, place) for place in places + written)
    if not places or about_an_option or named:
        return line
    names = ", ".join(shortened(shown(place), 80) for place in places[:2])
    return _line(f"{names}{', …' if len(places) > 2 else ''}: {line}")


def _on_the_disk(values: Iterable[object]) -> Iterator[Path]:
    for value in values:
        if isinstance(value, list | tuple):
            yield from _on_the_disk(value)
        elif isinstance(value, str | Path) and str(value) and _is_there(Path(value)):
            yield Path(value)


def _is_there(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def _stands_in(line: str, place: str) -> bool:
    name = re.escape(shown(Path(place).name))
    return bool(re.search(rf"(?<!\w){name}(?!\w)", line)) or shortened(shown(place), 80) in line


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

    `tell`: takes a line.
    """
    import logging
    import warnings

    seen: dict[str, int] = {}
    letters: dict[str, None] = {}

    def count(text: str) -> None:
        seen[text] = seen.get(text, 0) + 1

    def collect(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        glyph = _NO_GLYPH.match(str(message))
        if glyph:
            letters[chr(int(glyph[1]))] = None
        else:
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
        if letters:
            those = shortened(shown("".join(letters)), 40)
            tell(f"boxes stand in the picture for letters that its font lacks: {those}")
        for text, times in seen.items():
            often = f" ({times} times)" if times > 1 else ""
            tell(f"a library warned{often}: {text}")
