"""Scores of many submissions as tables in Markdown: a table a task, a row a method."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.json_text import Fields, json_text, read_json
from armimpedance.lab.benchmark.folder import BenchmarkFolder, file_sha256
from armimpedance.lab.benchmark.layout import VERSION, Half, KnownTruth
from armimpedance.lab.benchmark.scoring import Score, read_submission, score

# The scores of one submission as a JSON file that holds nothing of when or where it was made.

_FORMAT: Final = "armimpedance-benchmark-scores"
#: JSON has no infinite numbers.
_INFINITE: Final = "inf"


@dataclass(frozen=True)
class Scores:
    """Scores of a submission.

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
    benchmark: BenchmarkFolder, file: Path, name: str, sealed: Iterable[KnownTruth] = ()
) -> Scores:
    """Read and score one submission.

    Parameters
    ----------
    benchmark : BenchmarkFolder
    file : Path
        The submission.
    name : str
        Of its method.
    sealed : iterable of KnownTruth
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
    scores = score([*benchmark.public_truth(), *hidden], claims)
    return Scores(name, benchmark.sha256, file_sha256(file), bool(hidden), scores)


def _told(value: Any) -> Any:
    return _INFINITE if isinstance(value, float) and math.isinf(value) else value


def _read(value: Any) -> Any:
    return math.inf if value == _INFINITE else value


Cell = Callable[[Score], float | None]


def _percent(name: str) -> Cell:
    def cell(score: Score) -> float | None:
        value = getattr(score, name)
        return None if value is None else 100 * value

    return cell


#: Heading -> what stands below it, one number a group.
_COLUMNS: Final[Mapping[str, Cell]] = {
    "bias, %": _percent("bias"),
    "random, %": _percent("random"),
    "total, %": _percent("total"),
    "holds, %": _percent("coverage"),
    "width, %": _percent("width"),
    "interval score": lambda s: s.interval_score,
    "silently wrong, %": _percent("silently_wrong"),
    # who warns of everything is never silently wrong: it has to be seen
    "warned, %": _percent("warned"),
    "unsaid, %": lambda s: 100 * (s.asked - s.answered) / s.asked,
}


def table_text(submissions: Sequence[Scores], lines: Mapping[str, str]) -> str:
    """All submissions side by side, those with the lowest interval score first.

    Parameters
    ----------
    submissions : sequence of Scores
        Of one benchmark; a task is shown by its sealed half where all that attempted it were
        scored there, else by its public one.
    lines : mapping
        Task -> what it is, in the order of the tables.

    Returns
    -------
    str
        Markdown.

    Raises
    ------
    InputError
        Submissions of different benchmarks, or two of one name.
    """
    if len({s.benchmark_sha256 for s in submissions}) > 1:
        raise InputError("scores of different benchmarks", expected="of one folder")
    names = [s.name for s in submissions]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two submissions {name!r}", expected="one name each")
    parts = [
        f"# Benchmark {VERSION}: scores",
        f"Of the folder whose `SHA256SUMS` has the SHA-256 `{submissions[0].benchmark_sha256}`. "
        "Numbers of the groups of a task in their order, in per cent of the quantity's size; "
        "a dash: nothing was said. See [benchmark.md](benchmark.md).",
    ]
    tasks = dict.fromkeys([*lines, *(r.task for s in submissions for r in s.scores)])
    parts += [
        _task(task, lines.get(task, ""), submissions)
        for task in tasks
        if any(r.task == task for s in submissions for r in s.scores)
    ]
    return "\n\n".join(parts) + "\n"


def described(score: Score) -> str:
    """One line on a score, for a terminal.

    Parameters
    ----------
    score : Score

    Returns
    -------
    str
    """
    parts = []
    for heading, cell in _COLUMNS.items():
        name, _, unit = heading.partition(", ")
        parts.append(f"{name} {_number(cell(score))} {unit}".rstrip())
    return f"{score.task} {score.half} {score.group}: {', '.join(parts)}"


def _task(task: str, line: str, submissions: Sequence[Scores]) -> str:
    attempts = {
        s.name: [r for r in s.scores if r.task == task]
        for s in submissions
        if any(r.task == task for r in s.scores)
    }
    sealed = all(any(r.half == "sealed" for r in rows) for rows in attempts.values())
    half: Half = "sealed" if sealed else "public"
    shown = {n: [r for r in rows if r.half == half] for n, rows in attempts.items()}
    shown = dict(sorted(shown.items(), key=lambda item: (_rank(item[1]), item[0])))
    groups = " / ".join(dict.fromkeys(r.group for rows in shown.values() for r in rows))
    head = [f"{groups}, {half}", *_COLUMNS, "s"]
    table = [head, ["---"] * len(head), *([n, *_cells(rows)] for n, rows in shown.items())]
    text = "\n".join("| " + " | ".join(row) + " |" for row in table)
    return f"## {task}\n\n{line}\n\n{text}"


def _rank(rows: Sequence[Score]) -> float:
    return math.fsum(r.interval_score for r in rows) / len(rows)


def _cells(rows: Sequence[Score]) -> list[str]:
    cells = []
    for column in _COLUMNS.values():
        shown = [_number(column(row)) for row in rows]
        cells.append("–" if set(shown) == {"–"} else " / ".join(shown))
    times = [r.time_s for r in rows if r.time_s is not None]
    return [*cells, _number(max(times) if times else None)]


def _number(value: float | None) -> str:
    if value is None:
        return "–"
    if math.isinf(value):
        return "∞"
    return f"{value:.0f}" if abs(value) >= 9.95 else f"{value:.2g}"
