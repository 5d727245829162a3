"""The path of a recording together with what is wanted of it: which trials, by which mapping."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from armimpedance.core.errors import InputError


class ChosenPath(type(Path())):  # type: ignore[misc]
    """A path that says which trials of its recording are meant, and how its columns are read.

    It is a path wherever a path is taken; `read` alone looks at the choice.

    Attributes
    ----------
    where : str or None
        Trials for which this expression holds only.
    mapping : Path or None
        What the columns of a table of any layout mean.
    leave_out : Path or None
        A list of trials that are left out, as `trials` saves it.
    """

    where: str | None = None
    mapping: Path | None = None
    leave_out: Path | None = None

    @classmethod
    def of(
        cls, path: Path, where: str | None, mapping: Path | None, leave_out: Path | None
    ) -> Path:
        """The same path with a choice; as it is where nothing is chosen."""
        if where is None and mapping is None and leave_out is None:
            return path
        made: Any = cls(path)
        made.where, made.mapping, made.leave_out = where, mapping, leave_out
        return made  # type: ignore[no-any-return]

    def __reduce__(self) -> Any:
        return (ChosenPath.of, (Path(self), self.where, self.mapping, self.leave_out))

    def refused(self) -> InputError:
        """The error of a choice among trials where there are none, as in a file of results."""
        named = {"where": self.where, "mapping": self.mapping, "leave-out": self.leave_out}
        words = " and ".join(f"--{name}" for name, value in named.items() if value is not None)
        return InputError(
            f"{words} on results, which hold no trials", file=self, expected="a recording"
        )

    @property
    def options(self) -> dict[str, Any]:
        """The part of the choice that a reader of files needs."""
        named = {"where": self.where, "mapping": self.mapping}
        return {name: value for name, value in named.items() if value is not None}
