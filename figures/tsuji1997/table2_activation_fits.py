"""Tsuji (1997), Table 2: R and E of joint impedance over activation, and what they are worth."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from armimpedance.muscles.models import ActivationModel, ElementQuality
from armimpedance.show.plots import DrawnRow, TableBlock, plot_table
from armimpedance_figures.source_figure import SourceFigure, design, script
from armimpedance_figures.table_cells import correlation_text, error_text, number
from armimpedance_figures.tsuji1997.over_activation import EXPERIMENTS, OverActivation, fit
from armimpedance_figures.tsuji1997.printed import TABLE_2_E, TABLE_2_ELEMENTS, TABLE_2_R
from armimpedance_figures.tsuji1997.rows import by_element

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADER = (
    *("model", "N", "element", "R", "E", "adjusted_R2", "leave_one_out_R", "null_R"),
    *("rank", "coefficients", "condition", "printed_R", "printed_E"),
)


def draw(fits: OverActivation) -> Figure:
    """One block per order."""
    blocks = [_block(order, fits.source[order], fits.ours[order]) for order in fits.ours]
    columns = list(TABLE_2_ELEMENTS)
    return plot_table(columns, blocks).figure  # type: ignore[return-value]


def _block(order: int, source: tuple[ElementQuality, ...], ours: ActivationModel) -> TableBlock:
    a, b = ([by_element(q)[e] for e in TABLE_2_ELEMENTS] for q in (source, ours.quality))
    s = ours.summary
    heading = (
        f"N = {order}: rank {s.rank} of {len(ours.stiffness)}, condition {s.cond_scaled:.3g} "
        "(columns scaled)"
    )
    rows = (
        DrawnRow("R printed", tuple(f"{v:.3f}" for v in TABLE_2_R[order])),
        DrawnRow("R as the source", tuple(correlation_text(q.r) for q in a)),
        DrawnRow("R shared", tuple(correlation_text(q.r) for q in b), strong=True),
        DrawnRow("   left out", tuple(correlation_text(q.leave_one_out_r) for q in b)),
        DrawnRow("   of noise", tuple(correlation_text(q.null_r) for q in b)),
        DrawnRow("E printed", tuple(f"{v:.2f}" for v in TABLE_2_E[order])),
        DrawnRow("E as the source", tuple(error_text(q.e) for q in a)),
        DrawnRow("E shared", tuple(error_text(q.e) for q in b), strong=True),
    )
    return TableBlock(heading, rows)


def table(fits: OverActivation) -> list[list[str]]:
    """One row per model, order and element."""
    rows = [list(HEADER)]
    for order in fits.ours:
        rows += _table_rows("as the source", order, fits.source[order])
        rows += _table_rows(
            "shared coefficients", order, fits.ours[order].quality, fits.ours[order]
        )
    return rows


def _table_rows(
    name: str,
    order: int,
    quality: tuple[ElementQuality, ...],
    model: ActivationModel | None = None,
) -> Iterator[list[str]]:
    """Rank and condition only of a model whose elements share their coefficients."""
    found, state = by_element(quality), ["", "", ""]
    if model is not None:
        s = model.summary
        state = [str(s.rank), str(len(model.stiffness)), number(s.cond_scaled)]
    for i, element in enumerate(TABLE_2_ELEMENTS):
        q = found[element]
        ours = [q.r, q.e, q.adjusted_r2, q.leave_one_out_r, q.null_r]
        printed = [f"{TABLE_2_R[order][i]:.3f}", f"{TABLE_2_E[order][i]:.2f}"]
        yield [name, str(order), element, *map(number, ours), *state, *printed]


def caption(fits: OverActivation) -> str:
    """What is shown, what the terms do, what differs."""
    return (
        "After Tsuji (1997), Table 2: correlation R and sum of squared errors E (K in (N m/rad)², "
        "B in (N m s/rad)²) of models of joint impedance over muscle activation of order N, eqs "
        "(33)-(35), (38), experiments 2 and 3 together. As the source: each element fitted by "
        "itself (all printed entries obey R = sqrt(1 - E/E_0), which coefficients shared by the "
        "elements do not), K_j = J'K_e J. Shared: one set of muscles for all three elements, with "
        "what the hand force adds over the posture and the tensions over the curvature of the "
        "muscles' paths, weighted rows, errors of the activation; rank and condition are its. Left "
        "out: R of predictions of conditions that the fit has not seen; noise: R of the same fit "
        "to shuffled conditions. Without the force term K_se, which two muscles alone make, fits "
        "worst; but the printed R of B_se, which has no such term, is as low. E of the source may "
        f"sum over single data sets, here each condition counts once. {design(*fits.studied)}, "
        f"moment arms of Selen et al. (2009). {' '.join(fits.left_out)} Differs from the source: "
        f"simulated; pooled disturbances; {fits.ours[1].order * 6 + 3} to "
        f"{max(fits.ours) * 6 + 3} coefficients, because the six constants of the muscles reach "
        "the joints through three sums only."
    ).replace("  ", " ")


FIGURE = SourceFigure(
    "tsuji1997_table2_activation_fits", EXPERIMENTS, "B", draw, caption, table=table, fit=fit
)

if __name__ == "__main__":
    script(FIGURE)
