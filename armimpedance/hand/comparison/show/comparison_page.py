"""Page of a comparison: differences between groups of trials, and their significance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from heapq import nsmallest
from math import isnan
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.program import software
from armimpedance.hand.comparison.groups import Pair
from armimpedance.hand.comparison.show.plot import plot_comparison
from armimpedance.hand.comparison.show.text import shown_change, shown_p
from armimpedance.hand.comparison.show.verb import Comparison, compare
from armimpedance.hand.show import Estimates
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

#: Significance level of a difference.
LEVEL: Final = 0.05
#: Largest number of a session's groups whose pairs are all shown on its page.
_MOST_GROUPS: Final = 8
#: Number of draws for the distance, which is not shown there: the smallest possible.
_DRAWS: Final = 1
#: Quantity of an ellipse, and the head of its column.
_OF_ELLIPSES: Final = {
    "size": "size of K (ratio)",
    "shape": "shape of K (ratio)",
    "orientation": "orientation of K (deg)",
}
#: Most rows of the table of tests, and most pairs whose differences are on the page; the first ones
#: are shown.
_MOST_ROWS: Final = 200
_BASIS: Final = {
    "permutation": "exchanging trials between two groups within each direction of disturbance",
    "covariance": "the covariances of the estimates, since the sources hold no trials",
    "first order": "the covariances of the estimates, without exchanges or draws, since there are "
    "so many pairs",
}


def page_of(asked: Asked) -> Page:
    """Build the page of a comparison: of a session's groups, of sessions, or of results."""
    opened = None if asked.opened is None else read_recording(asked.opened)
    compared = compare(
        list(asked.sources) if opened is None else opened,
        by=asked.by,
        method=asked.method,
        seed=asked.seed,
        force_by=asked.force_by,
        despite=asked.despite,
        progress=asked.progress,
    )
    findings = told_by(compared.warnings, (*asked.checks, *compared.checks))
    drawn = plot_comparison(compared.groups, compared.pairs, "stiffness")
    count, step = _judged(compared)
    return page_from(
        asked,
        findings,
        title="Comparison",
        lead=f"{counted(len(compared.groups), 'group')}, {counted(len(compared.pairs), 'pair')}.",
        count=count,
        next_step=step,
        reader=(
            Section(
                "Ellipses",
                (picture(drawn, "comparison", "Stiffness of the groups with 95 % bands."),),
            ),
            Section("Tests", (_tests(compared.pairs),)),
        ),
        reviewer=reviewed(findings, str(compared)),
        methods=methods_of(_sentences(asked, compared)),
        options=[
            ("groups by", ", ".join(asked.by)),
            ("method", asked.method),
            ("seed", asked.seed),
        ],
        data={"differences": _first(compared).to_frame()},
    )


def _judged(compared: Comparison) -> tuple[str, str]:
    """Number of pairs that differ, and the next step, in words."""
    differ = [f"{p.first} and {p.second}" for p in compared.pairs if _p(p) < LEVEL]
    count = f"{len(differ)} of {counted(len(compared.pairs), 'pair')} differ"
    example = f" ({', '.join(differ[:3])})" if differ else ""
    step = (
        "Report the changes with their intervals: a small p alone says nothing of their size."
        if differ
        else "That no difference was found is no proof of none: read the intervals of the changes."
    )
    return count + example, step


def _first(comparison: Comparison) -> Comparison:
    """The comparison, limited to the pairs that a page can hold."""
    if len(comparison.pairs) <= _MOST_ROWS:
        return comparison
    return replace(comparison, pairs=tuple(nsmallest(_MOST_ROWS, comparison.pairs, key=_rank)))


def _p(pair: Pair) -> float:
    """Adjusted p of all three matrices together: the least of several would be too small."""
    return next(test.p_t2_adjusted for test in pair.tests if test.matrix == "all")


def _rank(pair: Pair) -> float:
    """Sort key: p; a pair without p comes last."""
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


def _sentences(asked: Asked, compared: Comparison) -> list[str]:
    bases = dict.fromkeys(pair.basis for pair in compared.pairs)
    return [
        f"Groups of trials were compared with {software()}, each with its own errors, by "
        "Hotelling's T2 of the elements of M, B and K",
        *(f"p values come from {_BASIS[basis]}, seed {asked.seed}" for basis in bases),
        f"They were adjusted after Holm over {counted(len(compared.pairs), 'pair')}",
    ]


# Differences on the page of a session's estimates.


def differences_of(estimates: Estimates, by: Sequence[str]) -> Section | None:
    """Build the section on differences in stiffness between the groups of a page of estimates.

    The tests use the estimates' covariances, which is fast; the page of a comparison exchanges
    trials.

    Parameters
    ----------
    estimates : Estimates
        Of the hand or of joints.
    by : sequence of str
        Columns that make the groups.

    Returns
    -------
    Section or None
        None for one group, more groups than a page's table can hold, or groups with equal names.
    """
    if not 2 <= len(estimates) <= _MOST_GROUPS:
        return None
    try:
        pairs = compare(estimates, by=by, permutations=_DRAWS).pairs
    except InputError:
        return None
    shown = [change.quantity for change in pairs[0].changes if change.matrix == "stiffness"]
    ellipse = [name for name in _OF_ELLIPSES if name in shown]
    rows = tuple(
        (f"{pair.first} | {pair.second}", *_p_values(pair), *_changed(pair, ellipse))
        for pair in pairs
    )
    heads = ("p, M, B and K", "p, K", *(_OF_ELLIPSES[name] for name in ellipse))
    caption = (
        "Each second group against the first: p that the matrices are the same (Hotelling's T² "
        "from the covariances, Holm over the pairs), and how the ellipse of K changes, with 95 % "
        "intervals: size and shape as ratios, orientation (from the line shoulder to hand) as "
        "a turn"
    )
    return Section("What differs", (Table(caption, ("pair", *heads), rows),))


def _p_values(pair: Pair) -> tuple[str, str]:
    of_stiffness = next(test for test in pair.tests if test.matrix == "stiffness")
    return shown_p(_p(pair)), shown_p(of_stiffness.p_t2_adjusted)


def _changed(pair: Pair, quantities: Sequence[str]) -> list[str]:
    by_quantity = {c.quantity: c.in_degrees() for c in pair.changes if c.matrix == "stiffness"}
    return [shown_change(by_quantity[name]) for name in quantities]


TOPIC = Topic("what differs between groups of trials", page_of)
