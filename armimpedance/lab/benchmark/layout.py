"""Names of the benchmark's folder: versions, halves, files. Standard library only."""

from __future__ import annotations

from pathlib import Path
from typing import Final, Literal

#: Another version has other records: raised whenever a task, a seed or the scoring changes.
VERSION: Final = "1.0"

Half = Literal["public", "sealed"]
HALVES: Final[tuple[Half, ...]] = ("public", "sealed")

MARK: Final = "benchmark.json"
SUMS: Final = "SHA256SUMS"
TRUTH: Final = "truth.csv"
ASKED: Final = "asked.csv"
SEALED_TRUTH: Final = "sealed_truth.sha256"
#: What the folder holds at its top.
TOP: Final = (
    MARK, SUMS, "VERSION", "README.md", "LICENSE", "CITATION.cff", "datasheet.md", "tasks",
)  # fmt: skip

ASKED_COLUMNS: Final = ("task", "record", "group", "quantity", "unit")
TRUTH_COLUMNS: Final = (*ASKED_COLUMNS, "value", "scale")


def record_names(half: Half, count: int) -> list[str]:
    """``p01``, ... of the public half, ``s01``, ... of the sealed one.

    Parameters
    ----------
    half : {"public", "sealed"}
    count : int

    Returns
    -------
    list of str
    """
    return [f"{half[0]}{number:02d}" for number in range(1, count + 1)]


def half_of(record: str) -> Half:
    """The half that a record is of, by its name."""
    return "sealed" if record.startswith("s") else "public"


def record_folder(top: Path, task: str, record: str) -> Path:
    """Where a record lies.

    Parameters
    ----------
    top : Path
        The benchmark's folder.
    task, record : str

    Returns
    -------
    Path
    """
    return top / "tasks" / task / half_of(record) / record
