"""Tsuji (1997), Table 1: R and E of joint impedance over posture, and what they are worth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.errors import ArmImpedanceError
from armimpedance.muscles.models import ElementQuality, JointRows, PostureModel, fit_posture_model
from armimpedance.show.plots import DrawnRow, TableBlock, plot_table
from armimpedance_figures.source_figure import SourceFigure, design, script
from armimpedance_figures.table_cells import number, quality_rows
from armimpedance_figures.tsuji1997.printed import (
    TABLE_1_E,
    TABLE_1_ELEMENTS,
    TABLE_1_POSTURES,
    TABLE_1_R,
)
from armimpedance_figures.tsuji1997.rows import by_element, rows_of, without_errors
from armimpedance_figures.tsuji1997.study import StudiedExperiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Order L of the moment arms -> coefficients of each element.
COEFFICIENTS = {0: 1, 1: 6, 2: 15}
HEADER = (
    *("model", "L", "element", "R", "E", "adjusted_R2", "leave_one_out_R", "null_R"),
    *("printed_R", "printed_E", "printed_adjusted_R2"),
)


@dataclass(frozen=True)
class PostureFits:
    """What the table shows.

    Attributes
    ----------
    studied : StudiedExperiment
    rows : JointRows
    source : mapping of int to PostureModel
        The source's least squares, by order L.
    default : PostureModel or None
        Sum of squares, L = 2, weighted.
    left_out : tuple of str
        Why a model is not there.
    true_part : float
        Part of the variance of K's elements over postures that is the simulated plant's own.
    """

    studied: StudiedExperiment
    rows: JointRows
    source: Mapping[int, PostureModel]
    default: PostureModel | None
    left_out: tuple[str, ...]
    true_part: float


def fit(studied: StudiedExperiment) -> PostureFits:
    """Fit what the number of postures allows."""
    rows = rows_of(studied, symmetric=False)
    source, left_out = {}, []
    for order in COEFFICIENTS:
        try:
            source[order] = fit_posture_model(without_errors(rows), order=order, model="polynomial")
        except ArmImpedanceError as error:
            left_out.append(f"L = {order}: {error}")
    default = None
    if 2 in source:
        default = fit_posture_model(rows, order=2)
    return PostureFits(studied, rows, source, default, tuple(left_out), _true_part(studied, rows))


def _true_part(studied: StudiedExperiment, rows: JointRows) -> float:
    truth = studied.truth
    true = np.array([truth.K_j[truth.index(label)] for label in rows.labels])
    found = np.var(rows.stiffness, axis=0).sum()
    return float(np.var(true, axis=0).sum() / found) if found > 0 else float("nan")


def printed_adjusted_r2(order: int, element: str) -> float:
    """``1 - (E_L/(P - p)) / (E_0/(P - 1))`` of the printed E."""
    i = TABLE_1_ELEMENTS.index(element)
    spare = TABLE_1_POSTURES - COEFFICIENTS[order]
    return 1 - (TABLE_1_E[order][i] / spare) / (TABLE_1_E[0][i] / (TABLE_1_POSTURES - 1))


def draw(fits: PostureFits) -> Figure:
    """One block per order, and one for the default model."""
    blocks = [_block(order, model) for order, model in fits.source.items()]
    if fits.default is not None:
        heading = f"L = 2, {fits.default.name}: positive semidefinite, weighted (default)"
        found = by_element(fits.default.quality)
        blocks.append(TableBlock(heading, quality_rows(found, TABLE_1_ELEMENTS)))
    return plot_table(_columns(), blocks).figure  # type: ignore[return-value]


def _columns() -> list[str]:
    return list(TABLE_1_ELEMENTS)


def _block(order: int, model: PostureModel) -> TableBlock:
    p = COEFFICIENTS[order]
    heading = f"L = {order}, least squares: {p} coefficient{'s' if p > 1 else ''} per element"
    adjusted = [printed_adjusted_r2(order, e) for e in TABLE_1_ELEMENTS]
    printed = (
        DrawnRow("R printed", tuple(f"{v:.3f}" for v in TABLE_1_R[order])),
        DrawnRow("E printed", tuple(f"{v:.3f}" for v in TABLE_1_E[order])),
        DrawnRow("adj. R² from E printed", tuple(f"{v:.2f}" for v in adjusted)),
    )
    ours = quality_rows(by_element(model.quality), TABLE_1_ELEMENTS)
    if order == 0:
        # a constant: nothing to adjust for, and nothing to predict with
        return TableBlock(heading, (*printed[:2], *ours[:2]))
    return TableBlock(heading, (*printed, *ours))


def table(fits: PostureFits) -> list[list[str]]:
    """One row per model and element."""
    rows = [list(HEADER)]
    for order, model in fits.source.items():
        rows += _table_rows("least squares", order, by_element(model.quality))
    if fits.default is not None:
        rows += _table_rows(fits.default.name, 2, by_element(fits.default.quality))
    return rows


def _table_rows(name: str, order: int, found: Mapping[str, ElementQuality]) -> Iterator[list[str]]:
    for i, element in enumerate(TABLE_1_ELEMENTS):
        q = found[element]
        ours = [q.r, q.e, q.adjusted_r2, q.leave_one_out_r, q.null_r]
        printed = ["", "", ""]
        if name == "least squares":
            adjusted = printed_adjusted_r2(order, element)
            printed = [
                f"{TABLE_1_R[order][i]:.3f}",
                f"{TABLE_1_E[order][i]:.3f}",
                f"{adjusted:.3f}",
            ]
        yield [name, str(order), element, *map(number, ours), *printed]


def caption(fits: PostureFits) -> str:
    """What is shown, what the printed table can support, what differs."""
    n = fits.rows.n_rows
    missing = " ".join(f"Not fitted: {sentence}." for sentence in fits.left_out)
    return (
        "After Tsuji (1997), Table 1: correlation R and sum of squared errors E (K in (N m/rad)², "
        "B in (N m s/rad)²) of models of joint impedance over posture, moment arms of order L, eqs "
        f"(33)-(37); printed values beside those of {n} simulated postures. Left out: R of "
        "predictions of postures that the fit has not seen. Noise: R of the same fit to shuffled "
        "postures. What the printed table supports: 15 coefficients for 20 postures reach R of .86 "
        "on pure noise. Adjusted for that, the printed E favour L = 2 in the diagonal elements, in "
        "none of them at 5 % (F tests against L = 1, p .06 to .21), and speak against it in K_se "
        "and K_es. These were fitted with one common polynomial (so they are here): their printed "
        "R is not sqrt(1 - E_L/E_0), as it is for the diagonal ones. Ours differ in scale, because "
        "the subject's K and B do; and of the variance of its measured K over posture "
        f"{100 * fits.true_part:.0f} % is the arm's own, the rest error of measurement: R says so "
        f"only beside R of noise. {design(fits.studied)}. {missing} Differs "
        "from the source: simulated; one estimate over all disturbances, where the source averages "
        "ten."
    ).replace("  ", " ")


FIGURE = SourceFigure(
    "tsuji1997_table1_posture_fits", ("postures",), "A", draw, caption, table=table, fit=fit
)

if __name__ == "__main__":
    script(FIGURE)
