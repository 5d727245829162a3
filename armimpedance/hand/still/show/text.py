"""The reflex guard's verdicts and all methods side by side, as text for a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import MATRICES, UNITS, element_names, group_name
from armimpedance.core.described import Column, beside, cells
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.core.shown import fixed, with_half_width
from armimpedance.hand.ellipses import FIELDS
from armimpedance.hand.levels import symmetric_part
from armimpedance.hand.show.quantities import condition_of, half_widths, principal_values
from armimpedance.hand.still.reflex_verdict import ReflexVerdict, Share
from armimpedance.hand.still.side_by_side import SideBySide
from armimpedance.numerics.regression import t_factor
from armimpedance.show.text import aligned_table

_WIDTH = 100
_REMEDY = (
    "Shorter disturbances tell K and reflex apart, and so does the shape reflex_separating of the "
    "simulator (armimpedance plan writes it for a robot)."
)
_LEGEND = (
    "Overstated and reflex: along the intrinsic K, as part of it. ± and limits: 95 %; with the "
    "delay scanned its uncertainty is in them. R answers a displacement one delay late; K + R is "
    "what a slow displacement meets. p: how often trials without a reflex give as much evidence."
)


def verdict_text(verdicts: Sequence[ReflexVerdict]) -> str:
    """The verdict in words, its evidence and the matrices of every group; then an explanation.

    `verdicts`: one verdict per group of trials.
    Returns: a block of text per group, and an explanation at the end.
    """
    blocks = [f"{_title(v)}\n{_filled(sentences(v))}\n{_matrices(v)}" for v in verdicts]
    return "\n\n".join([*blocks, textwrap.fill(_LEGEND, _WIDTH)])


def headline(verdict: ReflexVerdict) -> str:
    """The verdict in one sentence.

    `verdict`: the verdict on one group of trials.
    Returns: a sentence that names the outcome and the p value.
    """
    p = _p(verdict.p_value)
    if verdict.outcome == "none" and verdict.p_value <= verdict.NAMED_AT_P:
        return f"No reflex that matters ({p}, but below {100 * verdict.LEAST_SHARE:g} % of K)."
    if verdict.outcome == "none":
        return f"No sign of a reflex ({p}); {_would_be_seen(verdict)}."
    if verdict.outcome == "unknown":
        return f"It cannot be told: no sign of a reflex ({p}), but {_would_hide(verdict)}."
    return f"Contaminated by a reflex from {_delay(verdict)} after the onset ({p})."


def sentences(verdict: ReflexVerdict) -> list[str]:
    """Sentences on the verdict and its evidence."""
    lines = [headline(verdict)]
    if verdict.outcome == "contaminated":
        share = f"The reflex is {_percent(verdict.share)} of the intrinsic K"
        lines.append(f"{share}. {_misstated(verdict.overstated)}")
    elif verdict.scanned:
        others = (
            f"{1e3 * d:.0f} ms: {_part(s)}" for d, s in verdict.visible if d != verdict.TELLING_S
        )
        lines.append(f"Smallest reflex that would be seen at other delays, {', '.join(others)}.")
    if verdict.outcome == "unknown":
        lines.append(_REMEDY)
    if verdict.ends is not None:
        lines.append(_ends(verdict))
    return lines


def verdict_rows(verdicts: Sequence[ReflexVerdict]) -> list[dict[str, Any]]:
    """One row of a table per group; values that do not exist are None.

    Returns: one row per verdict: name of the column -> value.
    """
    return [_row(verdict) for verdict in verdicts]


def _title(verdict: ReflexVerdict) -> str:
    return f"{group_name(verdict.keys)}, {verdict.n_trials} trials"


def _filled(lines: Sequence[str]) -> str:
    wrap = {"width": _WIDTH, "initial_indent": "  ", "subsequent_indent": "  "}
    return "\n".join(textwrap.fill(line, **wrap) for line in lines)  # type: ignore[arg-type]


def _p(value: float) -> str:
    return f"p = {value:.4f}" if value < 0.01 else f"p = {value:.2f}"


def _delay(verdict: ReflexVerdict) -> str:
    if not verdict.scanned:
        return f"{1e3 * verdict.delay_s:g} ms (as given)"
    low, high = 1e3 * verdict.delay_low_s, 1e3 * verdict.delay_high_s
    return f"about {1e3 * verdict.delay_s:.0f} ms ({low:.0f} to {high:.0f})"


def _part(share: float) -> str:
    return f"{100 * share:.0f} % of K" if np.isfinite(share) else "none"


def _percent(share: Share, sign: float = 1.0) -> str:
    low, high = sorted((sign * share.low, sign * share.high))
    return f"{100 * sign * share.value:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def _would_be_seen(verdict: ReflexVerdict) -> str:
    delay = verdict.TELLING_S if verdict.scanned else verdict.delay_s
    seen = _part(verdict.seen_from(delay))
    return f"one of more than {seen}, {1e3 * delay:g} ms late, would have been seen"


def _would_hide(verdict: ReflexVerdict) -> str:
    delay = verdict.TELLING_S if verdict.scanned else verdict.delay_s
    seen = verdict.seen_from(delay)
    size = f"of {_part(seen)}" if np.isfinite(seen) else "of any size"
    return f"one {size}, {1e3 * delay:g} ms late, could go unseen"


def _misstated(overstated: Share) -> str:
    if overstated.low > 0:
        return f"Without it in the model K is overstated by {_percent(overstated)}."
    if overstated.high < 0:
        return f"Without it in the model K is understated by {_percent(overstated, -1.0)}."
    return (
        f"Whether K is misstated without it in the model cannot be told: by {_percent(overstated)}."
    )


def _ends(verdict: ReflexVerdict) -> str:
    ends = verdict.ends
    assert ends is not None  # noqa: S101 - the caller asked
    change, error = ends.along(verdict.without)
    half = t_factor(ends.dof) * error[-1]
    first, last = 1e3 * ends.end_s[ends.early], 1e3 * ends.end_s[-1]
    limits = f"{100 * (change[-1] - half):+.0f} to {100 * (change[-1] + half):+.0f}"
    return (
        f"Windows that end at {first:.0f} and at {last:.0f} ms: K changes by "
        f"{100 * change[-1]:+.0f} % ({limits}; the same trials)."
    )


def _matrices(verdict: ReflexVerdict) -> str:
    d, factor = len(verdict.intrinsic), t_factor(verdict.dof)
    unit = UNITS[verdict.kind]["K"]
    header = [f"  {unit}", *(name[1:].lstrip("_") for name in element_names("K", d))]
    parts = zip(
        ("K, no reflex in the model", "K intrinsic", "R reflex"),
        (verdict.without, verdict.intrinsic, verdict.reflex),
        verdict.sd,
        strict=True,
    )
    rows = [[f"  {name}", *_elements(value, factor * sd)] for name, value, sd in parts]
    rows.append(["  K + R", *_elements(verdict.total, factor * verdict.total_sd)])
    return aligned_table(header, rows)


def _elements(matrix: FloatArray, half: FloatArray) -> list[str]:
    return [with_half_width(v, h) for v, h in zip(matrix.ravel(), half.ravel(), strict=True)]


def _visible_percent(verdict: ReflexVerdict) -> float | None:
    seen = verdict.seen_from(verdict.TELLING_S) if verdict.visible else float("nan")
    return 100 * seen if np.isfinite(seen) else None


def _share_columns(
    name: str, words: str, share: Callable[[ReflexVerdict], Share]
) -> tuple[Column[ReflexVerdict], ...]:
    """Columns of a share of K and its limits."""
    part: Column[ReflexVerdict] = Column(
        f"{name}_percent", words, "%", lambda v: 100 * share(v).value
    )
    return (
        part,
        beside("ci_low_", part, lambda v: 100 * share(v).low),
        beside("ci_high_", part, lambda v: 100 * share(v).high),
    )


_DELAY: Final[Column[ReflexVerdict]] = Column(
    "delay_ms", "delay of the reflex", "ms", lambda v: 1e3 * v.delay_s
)
#: Columns of ``armimpedance reflex --out`` after the group's; K, R and K_without follow.
VERDICT: Final[tuple[Column[ReflexVerdict], ...]] = (
    Column("n_trials", "number of trials", "1"),
    Column("outcome", "whether a reflex stands in the stiffness"),
    Column("verdict", "the same in words", value=headline),
    Column("p", "p value of no reflex", "1", lambda v: v.p_value),
    _DELAY,
    beside("ci_low_", _DELAY, lambda v: 1e3 * v.delay_low_s),
    beside("ci_high_", _DELAY, lambda v: 1e3 * v.delay_high_s),
    Column("delay_scanned", "whether the delay was searched", value=lambda v: v.scanned),
    Column(
        "visible_percent", "smallest reflex that would be seen, part of K", "%", _visible_percent
    ),
    *_share_columns(
        "overstated", "part by which K is overstated without a reflex", lambda v: v.overstated
    ),
    *_share_columns("reflex", "the reflex, part of K", lambda v: v.share),
)


def _row(verdict: ReflexVerdict) -> dict[str, Any]:
    row: dict[str, Any] = {**verdict.keys, **cells(VERDICT, verdict)}
    d = len(verdict.intrinsic)
    matrices = (verdict.without, verdict.intrinsic, verdict.reflex)
    for symbol, matrix, sd in zip(("K_without", "K", "R"), matrices, verdict.sd, strict=True):
        names = element_names(symbol, d)
        row |= dict(zip(names, matrix.ravel().tolist(), strict=True))
        row |= {f"sd_{n}": v for n, v in zip(names, sd.ravel().tolist(), strict=True)}
    return row


# Every method on one recording, side by side, as text for a terminal of 100 columns.

_MOST = 1000.0
_METHODS_LEGEND = (
    "Symmetric parts; ± is the half-width of the 95 % interval. 'apart' is the distance from {0} "
    "(Frobenius norm) in % of {0}'s matrix; 'in se' the same in standard errors of the difference, "
    "from leaving out each trial in both methods, so that the noise they share cancels. Time is of "
    "one estimate with its standard errors."
)


def methods_table(compared: Sequence[SideBySide], reference: str) -> str:
    """M, B and K of every method in every group, methods that cannot run, and disagreements.

    `reference`: the method that the others are compared with.
    Returns: a block of text per group, and an explanation of the columns at the end.
    """
    blocks = [block for side in compared for block in _group(side, reference)]
    return "\n\n".join([*blocks, textwrap.fill(_METHODS_LEGEND.format(reference), _WIDTH)])


def _group(side: SideBySide, reference: str) -> list[str]:
    first = side.estimates[0]
    blocks = [f"{condition_of(first)}: {first.quality.n_trials} trials"]
    for i, (field, (symbol, _)) in enumerate(MATRICES.items()):
        title = f"{field.capitalize()} {symbol} ({UNITS[first.level][symbol]})"
        blocks.append(f"{title}\n{_table(side, i)}")
    refused = [f"{r.method} cannot run: {r.reason}" for r in side.results if r.estimate is None]
    differences = [sentence for d in side.disagreements for sentence in d.sentences]
    if not differences and side.disagreements:
        differences = [f"no method differs from {reference} by more than chance and a few percent"]
    notes = [
        textwrap.fill(note, _WIDTH, initial_indent="- ", subsequent_indent="  ")
        for note in (*differences, *refused)
    ]
    return [*blocks, "\n".join(notes)] if notes else blocks


def _table(side: SideBySide, i: int) -> str:
    apart, rows = {d.method: d for d in side.disagreements}, []
    for result in side.results:
        if result.estimate is None:
            continue
        disagreement = apart.get(result.method)
        distance = ["-", "-"]
        if disagreement is not None:
            distance = [_number(disagreement.percent[i]), _number(disagreement.standard_errors[i])]
        time = fixed(1e3 * result.seconds, 1)
        rows.append([result.method, *_cells(result.estimate, i), *distance, time])
    headings = _headings(side.estimates[0].k, i)
    return aligned_table(["method", *headings, "apart (%)", "in se", "time (ms)"], rows)


def _number(value: float) -> str:
    if not np.isfinite(value):
        return "?"
    # without noise any difference is many standard errors
    return fixed(float(value), 1) if value < _MOST else f">{_MOST:g}"


def _headings(k: int, i: int) -> list[str]:
    symbol = "MBK"[i]
    if k > 2:
        return [f"principal {n + 1}" for n in range(k)]
    return [f"{symbol}_{a + 1}{b + 1}" for a in range(k) for b in range(a, k)]


def _cells(estimate: ImpedanceEstimate, i: int) -> list[str]:
    """Elements of the symmetric part with one or two axes, principal values with more."""
    if estimate.k > 2:
        values, half = principal_values(estimate, FIELDS[i])
        return [with_half_width(v, h) for v, h in zip(values, half, strict=True)]
    part = symmetric_part(estimate)
    matrix, width = getattr(part, FIELDS[i]), half_widths(part)[i]
    upper = np.triu_indices(estimate.k)
    return [with_half_width(v, h) for v, h in zip(matrix[upper], width[upper], strict=True)]
