"""Estimates as text for a terminal: one in full, many as a table."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import FORCE_UNIT, MATRICES, POSITION_UNIT, UNITS
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.core.shown import fixed, with_half_width, with_interval
from armimpedance.hand.ellipses import FIELDS, Which
from armimpedance.hand.show.quantities import (
    antisymmetric,
    condition_of,
    ellipse_values,
    half_widths,
    is_recording_of_joints,
    principal_values,
)
from armimpedance.numerics.regression import t_factor
from armimpedance.show.text import (
    TABLE_WIDTH,
    aligned_table,
    note_numbers,
    numbered_notes,
    table_by_condition,
)

_WIDTH = 100


def estimate_text(estimate: ImpedanceEstimate) -> str:
    """The matrices with their 95 % half-widths, their parts and ellipses, quality and warnings.

    `estimate`: the estimate to describe.
    Returns: blocks of text, separated by empty lines.
    """
    blocks = [_head(estimate)]
    half = half_widths(estimate)
    for i, field in enumerate(FIELDS):
        blocks.append(_matrix_block(estimate, field, half[i]))
    notes = [f"warning: {text}" for text in estimate.warnings]
    notes += [f"done: {text}" for text in estimate.provenance]
    blocks.append([textwrap.fill(note, _WIDTH, subsequent_indent="  ") for note in notes])
    return "\n\n".join("\n".join(lines) for lines in blocks if lines)


def _head(estimate: ImpedanceEstimate) -> list[str]:
    q = estimate.quality
    measures = {
        "R": q.multiple_correlation,
        "VAF": q.vaf,
        "coherence": q.coherence,
        "scaled condition number": q.cond_scaled,
    }
    measured = [
        f"{name} {v:.4g}" for name, v in measures.items() if v is not None and np.isfinite(v)
    ]
    dof = "normal" if np.isinf(estimate.dof) else f"t, {estimate.dof:.4g} degrees of freedom"
    lines = [
        f"{condition_of(estimate)}: {estimate.level} impedance, method {estimate.method}",
        ", ".join([f"{q.n_trials} trials", *measured]),
        *_places(estimate),
        f"± is the half-width of the 95 % interval ({dof})",
    ]
    return [textwrap.fill(line, _WIDTH, subsequent_indent="  ") for line in lines]


def _places(estimate: ImpedanceEstimate) -> list[str]:
    kind = "joint" if is_recording_of_joints(estimate) else "hand"
    places = (
        ("position", estimate.position, POSITION_UNIT[kind]),
        ("force", estimate.force, FORCE_UNIT[kind]),
        ("joint angles", estimate.joint_angles, "rad"),
        ("shoulder", estimate.shoulder_m, "m"),
    )
    parts = [
        f"{name} ({', '.join(fixed(v, 3) for v in values)}) {unit}"
        for name, values, unit in places
        if values is not None
    ]
    return ["at the onset: " + ", ".join(parts)] if parts else []


def _matrix_block(estimate: ImpedanceEstimate, field: Which, half: FloatArray) -> list[str]:
    symbol = MATRICES[field][0]
    unit = UNITS[estimate.level][symbol]
    lines = [f"{field} {symbol} ({unit})", *_matrix_lines(getattr(estimate, field), half)]
    if estimate.k > 1:
        values, widths = principal_values(estimate, field)
        cells = [with_half_width(v, h) for v, h in zip(values, widths, strict=True)]
        lines.append(f"  symmetric part, principal values: {', '.join(cells)}")
    if estimate.k == 2:
        lines.append(_ellipse_line(estimate, field, unit))
        value, sd = antisymmetric(estimate, symbol)
        cell = with_half_width(value, t_factor(estimate.dof) * sd)
        lines.append(f"  antisymmetric part, ({symbol}_12 - {symbol}_21)/2: {cell}")
    handle = estimate.inertia_with_handle
    if field == "inertia" and handle is not None and (handle != estimate.inertia).any():
        lines += [f"inertia with the handle ({unit})", *_matrix_lines(handle, half)]
        if estimate.k == 2:
            lines.append(_ellipse_line(estimate, field, unit, with_handle=True))
    return lines


def _matrix_lines(matrix: FloatArray, half: FloatArray) -> list[str]:
    cells = [
        ["", *(with_half_width(v, h) for v, h in zip(*row, strict=True))]
        for row in zip(matrix, half, strict=True)
    ]
    return aligned_table(cells[0], cells[1:], gap="   ").splitlines()


def _ellipse_line(
    estimate: ImpedanceEstimate, field: Which, unit: str, with_handle: bool = False
) -> str:
    ellipse = ellipse_values(estimate, field, with_handle)
    if not ellipse:
        return "  ellipse: none, the symmetric part is not positive definite"
    size, turn, shape = (
        with_interval(*ellipse[name]) for name in ("size", "orientation_deg", "shape")
    )
    text = f"  ellipse: size {size} ({unit})^2, orientation {turn} deg, shape {shape}"
    return textwrap.fill(text, _WIDTH, subsequent_indent="    ")


# Results as text for a terminal of 100 columns.

_LEGEND = (
    "± is the half-width of the 95 % interval (t distribution). R is the multiple correlation of "
    "measured and predicted force; it cannot see a reflex or a wrong model. VAF is the variance "
    "accounted for. eff. is the Cramer-Rao bound for this motion and noise over the variance, "
    "itself uncertain by some 20 % at 40 trials."
)
_ELLIPSE_LEGEND = (
    "Ellipses are of the symmetric part: largest and smallest are its principal values, size = pi "
    "largest smallest, shape = smallest / largest, orientation is counter-clockwise from the line "
    "shoulder to hand (of joint matrices: from the first axis) to the major axis. Intervals of the "
    "ellipse need not be symmetric: ± is half their length."
)
_PRINCIPAL_LEGEND = "Principal values are those of the symmetric part, the largest first."


def summary_table(estimates: Sequence[ImpedanceEstimate]) -> str:
    """Tables of all estimates: quality first, then one for each of M, B and K.

    Estimates of different levels or numbers of axes are in separate parts. Warnings are numbered
    and listed at the end.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        One row each.

    Returns
    -------
    str
        The tables, the meaning of their columns, then the numbered warnings.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from armimpedance.hand.show import summary_table
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> summary_table(ai.estimate(recording)).split()[:2]
    ['Hand', 'impedance']
    """
    warnings = list(dict.fromkeys(w for e in estimates for w in e.warnings))
    parts: dict[tuple[str, int], list[ImpedanceEstimate]] = {}
    for estimate in estimates:
        parts.setdefault((estimate.level, estimate.k), []).append(estimate)
    blocks = [_part(level, k, members, warnings) for (level, k), members in parts.items()]
    legend = [_LEGEND]
    legend += [_ELLIPSE_LEGEND] if any(k == 2 for _, k in parts) else []
    legend += [_PRINCIPAL_LEGEND] if any(k > 2 for _, k in parts) else []
    text = textwrap.fill(" ".join(legend), TABLE_WIDTH)
    return "\n\n".join([*blocks, text, *numbered_notes(warnings)])


def _part(level: str, k: int, estimates: Sequence[ImpedanceEstimate], warnings: list[str]) -> str:
    header = ["trials", "R", "VAF", "eff. M/B/K", *_place_header(estimates), "notes"]
    rows = [[*_quality(e), note_numbers(e.warnings, warnings)] for e in estimates]
    blocks = [(f"{level.capitalize()} impedance", header, rows)]
    for field, symbol in zip(FIELDS, "MBK", strict=True):
        title = f"{field.capitalize()} {symbol} ({UNITS[level][symbol]})"
        blocks.append((title, _headings(k), [_values(e, field) for e in estimates]))
    names = [condition_of(estimate) for estimate in estimates]
    tables = [(title, table_by_condition(names, heads, cells)) for title, heads, cells in blocks]
    return "\n\n".join(f"{title}\n{table}" for title, table in tables)


def _place_header(estimates: Sequence[ImpedanceEstimate]) -> list[str]:
    joints = is_recording_of_joints(estimates[0])
    level = "joint" if joints else "hand"
    return [f"position ({POSITION_UNIT[level]})", f"force ({FORCE_UNIT[level]})"]


def _quality(estimate: ImpedanceEstimate) -> list[str]:
    q = estimate.quality
    return [
        str(q.n_trials),
        _or_dash(q.multiple_correlation, 3),
        _or_dash(q.vaf, 3),
        _efficiency(estimate),
        _vector(estimate.position, 3),
        _vector(estimate.force, 2),
    ]


def _efficiency(estimate: ImpedanceEstimate) -> str:
    """Ratio of the bound's variance to the estimate's, summed over the elements of M, B and K."""
    if estimate.bound is None:
        return "-"
    p = estimate.k**2
    least = np.diag(estimate.bound).reshape(3, p).sum(axis=1)
    own = np.diag(estimate.covariance).reshape(3, p).sum(axis=1)
    return "/".join(fixed(v, 1) if np.isfinite(v) else "-" for v in least / np.maximum(own, 1e-300))


def _or_dash(value: float, decimals: int) -> str:
    return fixed(value, decimals) if np.isfinite(value) else "-"


def _vector(values: FloatArray | None, decimals: int) -> str:
    return "-" if values is None else ", ".join(fixed(v, decimals) for v in values)


def _headings(k: int) -> list[str]:
    if k == 1:
        return ["value"]
    if k == 2:
        return ["largest", "smallest", "orientation (deg)", "shape", "size"]
    return [f"principal {i}" for i in range(1, k + 1)]


def _values(estimate: ImpedanceEstimate, field: Which) -> list[str]:
    values, half = principal_values(estimate, field)
    cells = [with_half_width(v, h) for v, h in zip(values, half, strict=True)]
    if estimate.k == 2:
        ellipse = ellipse_values(estimate, field)
        for name in ("orientation_deg", "shape", "size"):
            value, low, high = ellipse.get(name, (np.nan,) * 3)
            cells.append(with_half_width(value, (high - low) / 2))
    return cells
