"""Standard output that never costs a result, and progress bars.

What a command prints comes after, and matters less than, what it writes to files: it waits until
the command has ended well, or hands it on with `flush`. A sink that cannot take a text takes it in
another form or not at all; the command goes on, and its caller asks at the end what was lost.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock
from typing import Final, TextIO

from armimpedance.core.progress import Progress

#: What an ASCII terminal is shown in place of the signs that the reports use.
_ASCII: Final = str.maketrans(
    {"±": "+-", "×": "x", "·": "*", "–": "-", "—": "-", "…": "...", "°": " deg", "²": "^2"}
)


class Screen(io.TextIOBase):
    """Standard output as the commands see it.

    `left`: the reader has gone (a closed pipe).
    `failed`: why nothing more could be written, such as a full disk.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._waiting: list[str] = []
        self.left = False
        self.failed: OSError | None = None

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """The same as the wrapped stream's."""
        return getattr(self._stream, "encoding", None) or "utf-8"

    def isatty(self) -> bool:
        """True if the wrapped stream is a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """The same as the wrapped stream's."""
        return self._stream.fileno()

    def writable(self) -> bool:
        """Always."""
        return True

    def write(self, text: str) -> int:
        """Take a text; it waits for `flush`."""
        self._waiting.append(text)
        return len(text)

    def flush(self) -> None:
        """Hand on what waits, without characters that command a terminal."""
        text = _encodable(_harmless("".join(self._waiting)), self.encoding)
        self._waiting.clear()
        self._try(lambda: self._stream.write(text))
        self._try(self._stream.flush)

    def forget(self) -> None:
        """Drop what waits: the command came to nothing."""
        self._waiting.clear()

    def _try(self, action: object) -> None:
        if self.left or self.failed is not None:
            return
        try:
            action()  # type: ignore[operator]
        except BrokenPipeError:
            self.left = True
        except OSError as error:
            self.failed = error


@contextmanager
def safe_screen() -> Iterator[Screen | None]:
    """Put a `Screen` in front of standard output; None where there is no standard output."""
    stream = sys.stdout
    if stream is None:
        yield None
        return
    screen = Screen(stream)
    sys.stdout = screen  # type: ignore[assignment]
    try:
        yield screen
    finally:
        screen.flush()
        sys.stdout = stream
        if screen.left or screen.failed is not None:
            _silence(stream)


def _silence(stream: TextIO) -> None:
    """Let the interpreter's last flush go nowhere: it would complain of what we know."""
    try:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
    except (OSError, ValueError):
        return


def _harmless(text: str) -> str:
    """A text whose control characters, line ends and tabs aside, are written out."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)


def _encodable(text: str, encoding: str) -> str:
    """A text that the sink's alphabet can take."""
    try:
        text.encode(encoding)
    except (UnicodeEncodeError, LookupError):
        plain = text.translate(_ASCII)
        return plain.encode("ascii", "backslashreplace").decode("ascii")
    return text


# Progress bars on what takes longer than a second; silent where nobody watches.

DELAY_S = 1.0


@contextmanager
def bar(title: str) -> Iterator[Progress]:
    """A bar fed by ``progress(done, all)``; it shows after a second, and only on a terminal."""
    from tqdm import tqdm

    # its own is a lock of the system, which outlives a process that is killed
    tqdm.set_lock(RLock())
    with tqdm(desc=title, disable=None, delay=DELAY_S, leave=False) as shown:

        def progress(done: int, total: int) -> None:
            shown.total = total
            shown.update(done - shown.n)

        yield progress
