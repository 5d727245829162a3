"""Blocks of a page about many sessions: a table of marks, and lists that fold."""

from __future__ import annotations

from dataclasses import dataclass, field


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
