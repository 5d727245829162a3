"""What differs between groups of trials, and whether chance could have done it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from heapq import nsmallest
from math import isnan
from typing import Final

from armimpedance.core.program import software
from armimpedance.hand.comparison.groups import Pair
from armimpedance.hand.comparison.show.plot import plot_comparison
from armimpedance.hand.comparison.show.verb import Comparison, compare
from armimpedance.show.pages import (
    Asked,
    Page,
    Section,
    Table,
    Topic,
    methods_of,
    page_from,
    picture,
    reviewed,
    told_by,
)
from armimpedance.show.text import counted
from armimpedance.show.verbs.results import read_recording

#: Below this a difference is told from chance.
LEVEL: Final = 0.05
#: Rows of the table of tests, and pairs whose differences stand on the page; of more, the first.
_MOST_ROWS: Final = 200
_BASIS: Final = {
    "permutation": "exchanging trials between two groups within each direction of disturbance",
    "covariance": "the covariances of the estimates, since the sources hold no trials",
    "first order": "the covariances of the estimates, without exchanges or draws, since there are "
    "so many pairs",
}


def page_of(asked: Asked) -> Page:
    """The page of a comparison: of a session's groups, of sessions, or of results."""
    opened = None if asked.opened is None else read_recording(asked.opened)
    found = compare(
        list(asked.sources) if opened is None else opened,
        by=asked.by,
        method=asked.method,
        seed=asked.seed,
        force_by=asked.force_by,
        despite=asked.despite,
        progress=asked.progress,
    )
    told = told_by(found.warnings, (*asked.checks, *found.checks))
    drawn = plot_comparison(found.groups, found.pairs, "stiffness")
    count, step = _judged(found)
    return page_from(
        asked,
        told,
        title="Comparison",
        lead=f"{counted(len(found.groups), 'group')}, {counted(len(found.pairs), 'pair')}.",
        count=count,
        next_step=step,
        reader=(
            Section(
                "Ellipses",
                (picture(drawn, "comparison", "Stiffness of the groups with 95 % bands."),),
            ),
            Section("Tests", (_tests(found.pairs),)),
        ),
        reviewer=reviewed(told, str(found)),
        methods=methods_of(_sentences(asked, found)),
        options=[
            ("groups by", ", ".join(asked.by)),
            ("method", asked.method),
            ("seed", asked.seed),
        ],
        data={"differences": _first(found).to_frame()},
    )


def _judged(found: Comparison) -> tuple[str, str]:
    """How many pairs differ, and what to do next."""
    differ = [f"{p.first} and {p.second}" for p in found.pairs if _p(p) < LEVEL]
    count = f"{len(differ)} of {counted(len(found.pairs), 'pair')} differ"
    example = f" ({', '.join(differ[:3])})" if differ else ""
    step = (
        "Report the changes with their intervals: a small p alone says nothing of their size."
        if differ
        else "That no difference was found is no proof of none: read the intervals of the changes."
    )
    return count + example, step


def _first(found: Comparison) -> Comparison:
    """The comparison with as many pairs as a page can hold."""
    if len(found.pairs) <= _MOST_ROWS:
        return found
    return replace(found, pairs=tuple(nsmallest(_MOST_ROWS, found.pairs, key=_rank)))


def _p(pair: Pair) -> float:
    """Of all three matrices at once; the least of several would find differences by chance."""
    return next(test.p_t2_adjusted for test in pair.tests if test.matrix == "all")


def _rank(pair: Pair) -> float:
    """Smaller where more differs; a pair without p comes last."""
    p = _p(pair)
    return 2.0 if isnan(p) else p


def _tests(pairs: Sequence[Pair]) -> Table:
    shown = nsmallest(_MOST_ROWS, pairs, key=_rank) if len(pairs) > _MOST_ROWS else pairs
    rows = tuple(
        (f"{pair.first} | {pair.second}", *(f"{t.p_t2_adjusted:.2g}" for t in pair.tests))
        for pair in shown
    )
    heads = tuple(test.matrix for test in pairs[0].tests) if pairs else ()
    caption = "Adjusted p (Holm) that the matrices are the same, by Hotelling's T²"
    if len(pairs) > len(rows):
        caption += f"; of {len(pairs)} pairs the {len(rows)} of least p of all three matrices"
    return Table(caption, ("pair", *heads), rows, "differences")


def _sentences(asked: Asked, found: Comparison) -> list[str]:
    bases = dict.fromkeys(pair.basis for pair in found.pairs)
    return [
        f"Groups of trials were compared with {software()}, each with its own errors, by "
        "Hotelling's T2 of the elements of M, B and K",
        *(f"p values come from {_BASIS[basis]}, seed {asked.seed}" for basis in bases),
        f"They were adjusted after Holm over {counted(len(found.pairs), 'pair')}",
    ]


TOPIC = Topic("what differs between groups of trials", page_of)
