"""The parts of a report page: a verdict, sections of blocks, and its methods.

A page holds facts, no HTML: `rendering` turns it into a file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding

if TYPE_CHECKING:
    import pandas as pd

# Blocks of a page about many sessions: a table of marks, and lists that fold.


@dataclass(frozen=True)
class Mark:
    """One cell of a table of marks.

    Attributes
    ----------
    style : str
        A class of the page's style sheet.
    sign : str
        What is seen; the colour is never alone.
    word : str
        The same in words, for who hears the page; "" where the sign says it.
    told : str
        What the pointer shows.
    """

    style: str
    sign: str
    word: str = ""
    told: str = ""


@dataclass(frozen=True)
class Row:
    """One session in a table of marks.

    Attributes
    ----------
    name : str
    link, log : str
        Relative addresses of its page and its log; "" where there is none.
    state : Mark
    cells : tuple of Mark
        One a column.
    told : str
        What is wrong with it.
    """

    name: str
    link: str
    log: str
    state: Mark
    cells: tuple[Mark, ...]
    told: str


@dataclass(frozen=True)
class Heat:
    """Sessions and checks: a row a session, a column a check.

    Attributes
    ----------
    caption : str
    columns : tuple of str
    rows : tuple of Row
        In the order in which they are shown.
    legend : tuple of Mark
    states : tuple of str
        Words of the states by which a reader can choose.
    """

    caption: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    legend: tuple[Mark, ...]
    states: tuple[str, ...]
    kind: str = field(default="heat", init=False)


@dataclass(frozen=True)
class Fold:
    """A line that opens to a list.

    Attributes
    ----------
    title : str
    items : tuple of (str, str)
        Text and relative address; "" where there is none.
    """

    title: str
    items: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Folds:
    """Lists that fold.

    Attributes
    ----------
    folds : tuple of Fold
    """

    folds: tuple[Fold, ...]
    kind: str = field(default="folds", init=False)


State = Literal["ok", "warning", "unusable"]

#: State -> the word and the mark that a reader sees; the colour is never alone.
STATES: Final[Mapping[str, tuple[str, str]]] = {
    "ok": ("can be used", "✓"),
    "warning": ("use with care", "!"),
    "unusable": ("cannot be used", "✗"),
}


@dataclass(frozen=True)
class Verdict:
    """The first lines of a page: trust, problem, advice.

    Attributes
    ----------
    state : {"ok", "warning", "unusable"}
    trust : str
        Whether the numbers can be trusted, one sentence.
    wrong : str
        What is wrong, one sentence.
    next_step : str
        What to do next, one sentence.
    """

    state: State
    trust: str
    wrong: str
    next_step: str

    @property
    def sentences(self) -> tuple[str, str, str]:
        """The three sentences in the reader's order."""
        return self.trust, self.wrong, self.next_step


@dataclass(frozen=True)
class Prose:
    """Paragraphs.

    Attributes
    ----------
    paragraphs : tuple of str
    """

    paragraphs: tuple[str, ...]
    kind: str = field(default="prose", init=False)


@dataclass(frozen=True)
class Picture:
    """A picture for print.

    Attributes
    ----------
    name : str
        File name, without an ending, under which a reader saves it.
    svg : str
    caption : str
    drawn : DataFrame or None
        The points of its lines: panel, line, x, y; None of a picture of very many.
    """

    name: str
    svg: str
    caption: str
    drawn: pd.DataFrame | None = None
    kind: str = field(default="picture", init=False)


@dataclass(frozen=True)
class Table:
    """A table of texts.

    Attributes
    ----------
    caption : str
    columns : tuple of str
    rows : tuple of tuples of str
        The first cell of a row is its heading.
    numbers : str
        Name of the page's data that holds the numbers; "" where there are none.
    chooses : bool
        Whether a row's heading chooses the group of that name in the linked pictures.
    """

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: str = ""
    chooses: bool = False
    kind: str = field(default="table", init=False)


@dataclass(frozen=True)
class Checks:
    """A block of checks."""

    findings: tuple[Finding, ...]
    caption: str = ""
    kind: str = field(default="checks", init=False)


@dataclass(frozen=True)
class Linked:
    """A picture for looking: values under the pointer, one choice in all panels.

    Attributes
    ----------
    name : str
    spec : mapping
        Vega-Lite; its data are named, and `Page.data` holds them. Its parameter ``chosen``, where
        it has one, is the chosen group.
    description : str
        What a reader sees who cannot see it.
    caption : str
    numbers : str
        Name of the page's data that holds its values.
    """

    name: str
    spec: Mapping[str, Any]
    description: str
    caption: str
    numbers: str = ""
    kind: str = field(default="linked", init=False)


@dataclass(frozen=True)
class Printed:
    """Text as the command prints it, its columns kept.

    Attributes
    ----------
    text : str
    """

    text: str
    kind: str = field(default="printed", init=False)


Block = Prose | Printed | Picture | Table | Checks | Linked | Heat | Folds


@dataclass(frozen=True)
class Section:
    """A heading with its blocks.

    Attributes
    ----------
    title : str
    blocks : tuple of blocks
    """

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Methods:
    """The methods paragraph, ready for a paper.

    Attributes
    ----------
    paragraph : str
    references : tuple of str
    """

    paragraph: str
    references: tuple[str, ...] = ()


@dataclass(frozen=True)
class Page:
    """One result as a page.

    Attributes
    ----------
    title : str
    lead : str
        What was measured, one sentence.
    verdict : Verdict
    reader : tuple of Section
        What a reader wants: picture and table.
    reviewer : tuple of Section
        What a reviewer wants: fits, residuals, checks.
    methods : Methods
    made : tuple of (str, str)
        Versions, command, options, seed, hashes of the inputs.
    data : mapping from a name to a DataFrame
        The numbers behind pictures and tables, each held once.

    Raises
    ------
    InputError
        A block names data that the page does not hold.
    """

    title: str
    lead: str
    verdict: Verdict
    reader: tuple[Section, ...]
    reviewer: tuple[Section, ...]
    methods: Methods
    made: tuple[tuple[str, str], ...]
    data: Mapping[str, pd.DataFrame] = field(default_factory=dict)

    def __post_init__(self) -> None:
        named = {getattr(block, "numbers", "") for block in self.blocks} - {""}
        if missing := named - set(self.data):
            raise InputError(f"no data {', '.join(sorted(missing))}", expected="the page's own")

    @property
    def blocks(self) -> Sequence[Block]:
        """All blocks in the order of the page."""
        return [b for section in (*self.reader, *self.reviewer) for b in section.blocks]
