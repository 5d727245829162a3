"""A cell of the study: records with one assumption broken, what the command says, the verdict.

What a record's answer can be, in this order: *refused* (an error of the toolkit's own), *named* (a
finding that warns and bears a name that this violation may have), and of every printed number
*right or wide* (the 95 % interval, widened by half, holds the truth) or *silently wrong*. "Cannot
tell" names nothing: such a sentence stands on clean records as well, and only a wide interval makes
it good.
"""

from __future__ import annotations

import re
import time
import zlib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.findings import Finding

SEED = 20261123
#: The 95 % interval is widened by this before it is called wrong.
WIDENED = 1.5
#: Sentences about precision: they tell how wide an interval is, not that an assumption is broken.
OF_PRECISION = re.compile(
    r"not (well )?identified|is known to|wide|few trials|degrees of freedom|condition number|"
    r"hardly told|static range"
)


@dataclass(frozen=True)
class Made:
    """A record, the true values of what a command prints of it, and what it needs beside."""

    record: Any
    truth: Mapping[str, float]
    beside: Any = None


@dataclass(frozen=True)
class Answer:
    """What a command printed: name -> (value, low, high), and what it warned of.

    `names` are those of findings that warn or stop, `sentences` warnings that are no finding.
    """

    numbers: Mapping[str, tuple[float, float, float]]
    names: tuple[str, ...] = ()
    sentences: tuple[str, ...] = ()
    refused: str = ""

    @property
    def alarms(self) -> tuple[str, ...]:
        """All that a reader would take for a warning."""
        return (*self.names, *(s for s in self.sentences if not OF_PRECISION.search(s)))


Maker = Callable[[Sequence[int]], list[Made]]


@dataclass(frozen=True)
class Rig:
    """Where clean records come from, and the command that is asked about them.

    `naive` gives the values of a fit that doubts nothing, as a yardstick of a violation's size.
    """

    command: str
    name: str
    make: Maker
    run: Callable[[Made], Answer]
    naive: Callable[[Made], Mapping[str, float]] | None = None


@dataclass(frozen=True)
class Cell:
    """A violation of one size on one rig; `named_by` are the names that tell it.

    `seen` is False where nothing in the record can show the violation: the page says so, and
    nothing is asked of the command.
    """

    rig: Rig
    violation: str
    size: str
    named_by: tuple[str, ...]
    make: Maker
    seen: bool = True

    @property
    def key(self) -> str:
        """Name of the cell as a file."""
        text = "-".join((self.rig.command, self.rig.name, self.violation or "clean", self.size))
        return re.sub(r"[^A-Za-z0-9.+]+", "_", text).strip("_")


def clean(rig: Rig) -> Cell:
    """The cell of a rig's clean records."""
    return Cell(rig, "", "", (), rig.make)


def seeds_of(stream: str, index: int) -> np.random.Generator:
    """Random numbers of one record that depend on a name and the record's number alone."""
    key = (zlib.crc32(stream.encode()), index)
    return np.random.default_rng(np.random.SeedSequence(SEED, spawn_key=key))


def seed_of(stream: str, index: int) -> int:
    """The same as a whole number, for simulators that take one."""
    return int(seeds_of(stream, index).integers(2**31))


def damaged(rig: Rig, damage: Callable[[Made, np.random.Generator], Made]) -> Maker:
    """Clean records of a rig, each with the same damage."""

    def make(indices: Sequence[int]) -> list[Made]:
        made = rig.make(indices)
        return [damage(one, seeds_of("damage", i)) for i, one in zip(indices, made, strict=True)]

    return make


def on_record(change: Callable[..., Any]) -> Callable[[Made, np.random.Generator], Made]:
    """A damage to the record that leaves the truth as it is: ``change(record, rng)``."""
    return lambda made, rng: Made(change(made.record, rng), made.truth, made.beside)


def asked(run: Callable[[Made], Answer], made: Made) -> Answer:
    """The command's answer; its own errors are refusals, all others go up."""
    try:
        return run(made)
    except ArmImpedanceError as error:
        return Answer({}, refused=" ".join(str(error).split()) or type(error).__name__)


def said(checks: Sequence[Finding], warnings: Sequence[str] = ()) -> dict[str, tuple[str, ...]]:
    """Names of the findings that warn, and the warnings that are no finding's sentence."""
    told = {f.sentence for f in checks}
    names = tuple(f.name for f in checks if f.verdict in ("warning", "unusable"))
    return {"names": names, "sentences": tuple(w for w in warnings if w not in told)}


def is_named(answer: Answer, names: Sequence[str]) -> bool:
    """Whether a finding bears one of these names, or a sentence has one before its first stop.

    A sentence that goes on to list what may be the cause names none of it; a phrase of several
    words counts wherever it stands.
    """
    if set(answer.names) & set(names):
        return True
    phrases = [name for name in names if name.count(" ") > 2]
    if any(phrase in sentence for phrase in phrases for sentence in answer.sentences):
        return True
    heads = [re.split(r"[:;,(]", s)[0] for s in answer.sentences]
    return any(re.search(rf"\b{re.escape(n)}\b", h) for n in names for h in heads)


def holds(number: tuple[float, float, float], truth: float) -> bool:
    """Whether the interval widened by half about its middle holds the truth."""
    _, low, high = number
    middle, half = (low + high) / 2, (high - low) / 2
    return bool(abs(truth - middle) <= WIDENED * half) or not np.isfinite(half)


@dataclass
class Tally:
    """Counts of one cell over its records, and what its effect is worked out from.

    Shares are of the records; of a record that is neither refused nor named, each printed number
    counts as its part of it. Where a command has no numbers, silence is wrong.
    `held` is the part of all printed numbers, named or not, whose widened interval holds the truth.
    """

    n: int = 0
    refused: float = 0.0
    named: float = 0.0
    silently_wrong: float = 0.0
    wide_or_right: float = 0.0
    records_wrong: float = 0.0
    held: float = 0.0
    alarmed: float = 0.0
    alarms: dict[str, int] = field(default_factory=dict)
    wrong: dict[str, int] = field(default_factory=dict)
    example: str = ""
    seconds: float = 0.0
    half: dict[str, float] = field(default_factory=dict)
    error: dict[str, float] = field(default_factory=dict)
    naive: dict[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def run_cell(cell: Cell, records: int) -> Tally:
    """Make the records of a cell, ask the command and count."""
    start, tally = time.perf_counter(), Tally(n=records)
    halves: dict[str, list[float]] = {}
    held: list[bool] = []
    errors: dict[str, list[float]] = {}
    naive: dict[str, list[float]] = {}
    alarms, wrong = Counter[str](), Counter[str]()
    for made in cell.make(range(records)):
        answer = asked(cell.rig.run, made)
        _count(tally, cell, made, answer, wrong)
        alarms.update(dict.fromkeys(answer.alarms, 1))
        for name, truth in made.truth.items():
            if name in answer.numbers:
                value, low, high = answer.numbers[name]
                held.append(holds(answer.numbers[name], truth))
                halves.setdefault(name, []).append((high - low) / 2)
                errors.setdefault(name, []).append(abs(value - truth))
        if cell.rig.naive is not None:
            for name, value in cell.rig.naive(made).items():
                naive.setdefault(name, []).append(value - made.truth[name])
    for share in ("refused", "named", "silently_wrong", "wide_or_right", "records_wrong"):
        setattr(tally, share, getattr(tally, share) / records)
    tally.alarmed /= records
    tally.held = float(np.mean(held)) if held else float("nan")
    tally.alarms, tally.wrong = dict(alarms.most_common(8)), dict(wrong.most_common(8))
    tally.half = {k: float(np.median(v)) for k, v in halves.items()}
    tally.error = {k: float(np.median(v)) for k, v in errors.items()}
    tally.naive = {k: float(np.median(v)) for k, v in naive.items()}
    tally.seconds = time.perf_counter() - start
    return tally


def _count(tally: Tally, cell: Cell, made: Made, answer: Answer, wrong: Counter[str]) -> None:
    """Add one record to the shares, as sums still."""
    tally.alarmed += bool(answer.alarms)
    if answer.refused:
        tally.refused += 1
        tally.example = tally.example or answer.refused
        return
    if cell.violation and is_named(answer, cell.named_by):
        tally.named += 1
        return
    judged = [n for n in made.truth if n in answer.numbers]
    missed = [n for n in judged if not holds(answer.numbers[n], made.truth[n])]
    wrong.update(missed)
    # a command that prints no numbers must speak; one that tells none of them did
    silence = float(bool(cell.violation) and not made.truth)
    part = len(missed) / len(judged) if judged else silence
    tally.silently_wrong += part
    tally.wide_or_right += 1 - part
    tally.records_wrong += part > 0


def effect(broken: Mapping[str, Any], sound: Mapping[str, Any]) -> float:
    """Largest error that the violation causes, in standard errors of the clean interval.

    The larger of the printed numbers' median error and of what it does to the naive fit; inf where
    no number was meant or printed.
    """
    sizes = []
    for name, half in sound["half"].items():
        se = half / 1.96
        if not se > 0:
            continue
        if name in broken["error"]:
            sizes.append(broken["error"][name] / se)
        if name in broken["naive"]:
            sizes.append(abs(broken["naive"][name] - sound["naive"][name]) / se)
    return max(sizes, default=float("inf"))
