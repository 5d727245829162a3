"""The errors that a user can meet: one root, a few children, one line each."""

from __future__ import annotations

from typing import TypeVar

Entry = TypeVar("Entry")


class ArmImpedanceError(Exception):
    """Root of all errors that the toolkit raises on purpose; the command line exits 2 on it."""


class InputError(ArmImpedanceError):
    """Bad input, told in one line: what is wrong, where, and what was expected.

    Parameters
    ----------
    problem : str
        What is wrong, for example ``"not a number: 'abc'"``.
    file : str or path, optional
        The file in which it is wrong.
    row : int, optional
        The line of the file, counted from 1 with its header (what an editor shows).
    column : str, optional
        The column or field.
    expected : str, optional
        What would have been right.
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
        self.problem, self.file, self.row = problem, file, row
        self.column, self.expected = column, expected
        places = []
        if file is not None:
            places.append(str(file))
        if row is not None:
            places.append(f"row {row}")
        if column is not None:
            places.append(f"column {column}")
        text = f"{', '.join(places)}: {problem}" if places else problem
        if expected is not None:
            text += f" (expected {expected})"
        super().__init__(text)


class RecordError(InputError):
    """A central type was built from arrays that cannot be what the type says."""


class NotIdentifiableError(ArmImpedanceError):
    """The data cannot say: the regressor loses rank, and these parameters are why.

    Parameters
    ----------
    message : str
        One line for a user.
    parameters : tuple of str
        The names of the parameters that cannot be told apart or found at all.
    """

    def __init__(self, message: str, parameters: tuple[str, ...] = ()) -> None:
        self.parameters = parameters
        super().__init__(message)


class EstimationError(ArmImpedanceError):
    """A numerical method ended without an answer that can be trusted."""
