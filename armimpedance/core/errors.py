"""Errors that a user can meet: one base class, a few subclasses, one line of text each."""

from __future__ import annotations

from importlib import import_module
from math import inf
from typing import Any, Final, TypeVar

Entry = TypeVar("Entry")

#: A message is one line of at most this many characters.
LONGEST_MESSAGE: Final = 400


def shown(text: str) -> str:
    """Return a text from a file for a message: on one line and without control characters.

    Returns: printable; any other character as Python writes it, such as ``\\x1b``.
    """
    if text.isprintable():
        return text
    words = " ".join(text.split())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in words)


def shortened(text: str, length: int) -> str:
    """Return a text, with its middle left out if it is longer than `length`.

    `length`: at least 3.
    """
    if len(text) <= length:
        return text
    head = (length - 1) * 2 // 3
    return f"{text[:head]}…{text[len(text) - (length - 1 - head) :]}"


def beginning(text: str, length: int) -> str:
    """Return a text; if it is longer than `length`, its beginning up to the end of a clause."""
    if len(text) <= length:
        return text
    head = text[: length - 2]
    clause = max(head.rfind(mark) for mark in (", ", "; ", ": ", ". "))
    return f"{head[:clause] if clause > length // 2 else head} …"


class ArmImpedanceError(Exception):
    """Base class of all errors that the toolkit raises on purpose; the command line then exits 2.

    Examples
    --------
    >>> import armimpedance as ai
    >>> try:
    ...     ai.read("nowhere")
    ... except ai.ArmImpedanceError as error:
    ...     print(type(error).__name__)
    InputError
    """


class InputError(ArmImpedanceError):
    """Bad input, stated in one line: what is wrong, where, and what was expected.

    Parameters
    ----------
    problem : str
        What is wrong, for example ``"not a number: 'abc'"``.
    file : str or path, optional
        The file in which it is wrong.
    row : int, optional
        The line of the file, counted from 1 with its header, as an editor shows it.
    column : str, optional
        The column or field.
    expected : str, optional
        The correct form.

    Examples
    --------
    >>> import armimpedance as ai
    >>> ai.read("nowhere")
    Traceback (most recent call last):
    armimpedance.core.errors.InputError: nowhere: no such file or folder (expected a recording)
    """

    def __init__(
        self,
        problem: str,
        *,
        file: object | None = None,
        row: int | None = None,
        column: str | None = None,
        expected: str | None = None,
    ) -> None:
        self.problem: str = problem
        self.file: object | None = file
        self.row: int | None = row
        self.column: str | None = column
        self.expected: str | None = expected
        places = []
        if file is not None:
            places.append(shortened(shown(str(file)), LONGEST_MESSAGE // 2))
        if row is not None:
            places.append(f"row {row}")
        if column is not None:
            places.append(f"column {shortened(shown(column), 60)}")
        where = f"{', '.join(places)}: " if places else ""
        what = "" if expected is None else f" (expected {shown(expected)})"
        # The place is never shortened; the expectation is shortened before the problem.
        room = LONGEST_MESSAGE - len(where)
        problem = shortened(shown(problem), max(room * 2 // 3, room - len(what)))
        super().__init__(where + problem + shortened(what, room - len(problem)))


class RecordError(InputError):
    """A record was built from arrays that break the rules of its type."""


def check_number(
    value: float,
    problem: str,
    *,
    above: float | None = None,
    low: float | None = None,
    below: float | None = None,
    high: float | None = None,
    unit: str = "",
    error: type[InputError] = InputError,
) -> None:
    """Refuse a number outside its bounds, NaN always, and infinity unless `high` allows it.

    `problem`: the sentence, with the number in it.
    `above`, `below`: bounds that are not allowed themselves.
    `low`, `high`: bounds that are.
    """
    inside = (
        value <= high if high is not None else abs(value) < inf,
        above is None or value > above,
        low is None or value >= low,
        below is None or value < below,
    )
    if not all(inside):
        raise error(problem, expected=f"{_in_words(above, low, below, high)} {unit}".rstrip())


def check_level(level: float) -> None:
    """Refuse a confidence level that does not lie between 0 and 1."""
    check_number(level, f"confidence level {level}", above=0, below=1)


def _in_words(
    above: float | None, low: float | None, below: float | None, high: float | None
) -> str:
    """The bounds of a number, such as "more than 0" or "0.02 to 2"."""
    if above is not None and below is not None:
        return f"between {above:g} and {below:g}"
    if low is not None and high is not None:
        return f"{low:g} to {high:g}"
    words = [
        *([] if above is None else [f"more than {above:g}"]),
        *([] if low is None else [f"{low:g} or more"]),
        *([] if below is None else [f"less than {below:g}"]),
        *([] if high is None or high == inf else [f"at most {high:g}"]),
    ]
    return ", ".join(words) or "a finite number"


class NotIdentifiableError(ArmImpedanceError):
    """The data do not determine these parameters: the regressor loses rank.

    Parameters
    ----------
    message : str
        One line for a user.
    parameters : tuple of str
        The names of the parameters that cannot be distinguished or estimated at all.

    Examples
    --------
    >>> import armimpedance as ai
    >>> issubclass(ai.NotIdentifiableError, ai.ArmImpedanceError)
    True
    """

    def __init__(self, message: str, parameters: tuple[str, ...] = ()) -> None:
        self.parameters = parameters
        super().__init__(message)


class EstimationError(ArmImpedanceError):
    """A numerical method ended without an answer that can be trusted.

    Examples
    --------
    >>> import armimpedance as ai
    >>> issubclass(ai.EstimationError, ai.ArmImpedanceError)
    True
    """


class WorkerError(EstimationError):
    """A worker process ended before its work was done."""


# Packages that only some formats need: imported when such a file is read, reported if missing.


def needed(module: str, extra: str, file: object) -> Any:
    """Import a package that an extra of the installation brings.

    `module`: what is imported, such as ``"h5py"``.
    `extra`: the extra of `pyproject.toml` that brings it, such as ``"matlab"``.
    `file`: the file that needs it, for the message.
    Raises InputError: the package is not installed; the message says how to install it.
    """
    try:
        return import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise InputError(
            f"the package {package} is not installed",
            file=file,
            expected=f"it: pip install 'armimpedance[{extra}]'",
        ) from None
