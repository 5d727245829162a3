"""What the system sends to end a command: it ends as Ctrl-C ends it, nothing half-written."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from types import FrameType
from typing import Any, Final

#: Of a scheduler or a shutdown, and of a terminal that goes away.
_NAMES: Final = ("SIGTERM", "SIGHUP")


#: So long a command may tidy up, s.
_PATIENCE_S: Final = 2.0


class Stopped(KeyboardInterrupt):
    """The system asks this process to end.

    Parameters
    ----------
    number : int
        Of the signal.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(number)


class Asked:
    """Whether this process was asked to end.

    Attributes
    ----------
    why : KeyboardInterrupt or None
        A library that is interrupted may raise an error of its own in its place.
    """

    why: KeyboardInterrupt | None = None


@contextmanager
def stopped_in_order() -> Iterator[Asked]:
    """Turn a signal to end into `Stopped`; a second one at once finds the first at work.

    Later it is heeded again: a library may have swallowed the first. A signal that is ignored, as
    after ``nohup``, or that somebody else heeds, stays theirs.
    """
    asked = Asked()
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
