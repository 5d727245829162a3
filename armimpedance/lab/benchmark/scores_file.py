"""The scores of one submission as a JSON file that holds nothing of when or where it was made."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.json_text import Fields, json_text, read_json
from armimpedance.lab.benchmark.asked import Known
from armimpedance.lab.benchmark.folder import BenchmarkFolder, file_sha256
from armimpedance.lab.benchmark.layout import VERSION
from armimpedance.lab.benchmark.scoring import Score, score
from armimpedance.lab.benchmark.submission import read_submission

_FORMAT: Final = "armimpedance-benchmark-scores"
#: JSON has no infinite numbers.
_INFINITE: Final = "inf"


@dataclass(frozen=True)
class Scores:
    """What a submission came to.

    Attributes
    ----------
    name : str
        Of the method.
    benchmark_sha256 : str
        Of the benchmark's list of checksums.
    submission_sha256 : str
    sealed : bool
        Whether the sealed half was scored.
    scores : sequence of Score
    """

    name: str
    benchmark_sha256: str
    submission_sha256: str
    sealed: bool
    scores: Sequence[Score]

    @property
    def text(self) -> str:
        """The text of the file."""
        rows = [{k: _told(v) for k, v in asdict(score).items()} for score in self.scores]
        head = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "scores"}
        return json_text({"format": _FORMAT, "version": VERSION, **head, "scores": rows})

    @classmethod
    def read(cls, file: Path) -> Scores:
        """Read what `text` made.

        Raises
        ------
        InputError
            It is no such file, or of another version.
        """
        values = Fields(file, read_json(file))
        values.choice("format", [_FORMAT], required=True)
        values.choice("version", [VERSION], required=True)
        names = [f.name for f in fields(Score)]
        try:
            rows = [Score(**{k: _read(row[k]) for k in names}) for row in values.values["scores"]]
            head = {f.name: values.values[f.name] for f in fields(cls) if f.name != "scores"}
        except (KeyError, TypeError) as error:
            raise InputError("holds broken scores", file=file) from error
        return cls(**head, scores=rows)


def score_submission(
    benchmark: BenchmarkFolder, file: Path, name: str, sealed: Iterable[Known] = ()
) -> Scores:
    """Read and score one submission.

    Parameters
    ----------
    benchmark : BenchmarkFolder
    file : Path
        The submission.
    name : str
        Of its method.
    sealed : iterable of Known
        The truth of the sealed half, by whoever has the key.

    Returns
    -------
    Scores

    Raises
    ------
    InputError
        As `read_submission`, or a public truth was changed.
    """
    claims = read_submission(file, benchmark.asked)
    hidden = list(sealed)
    found = score([*benchmark.public_truth(), *hidden], claims)
    return Scores(name, benchmark.sha256, file_sha256(file), bool(hidden), found)


def _told(value: Any) -> Any:
    return _INFINITE if isinstance(value, float) and math.isinf(value) else value


def _read(value: Any) -> Any:
    return math.inf if value == _INFINITE else value
