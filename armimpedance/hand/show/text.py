"""One estimate in full, as text."""

from __future__ import annotations

import textwrap

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import FORCE_UNIT, MATRICES, POSITION_UNIT, UNITS
from armimpedance.core.records import ImpedanceEstimate
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
from armimpedance.show.text import aligned_table, fixed, with_half_width, with_interval

_WIDTH = 100


def estimate_text(estimate: ImpedanceEstimate) -> str:
    """The matrices with their 95 % half-widths, their parts and ellipses, quality and warnings.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        The estimate to describe.

    Returns
    -------
    str
        Blocks of text, separated by empty lines.
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
    known = [f"{name} {v:.4g}" for name, v in measures.items() if v is not None and np.isfinite(v)]
    dof = "normal" if np.isinf(estimate.dof) else f"t, {estimate.dof:.4g} degrees of freedom"
    lines = [
        f"{condition_of(estimate)}: {estimate.level} impedance, method {estimate.method}",
        ", ".join([f"{q.n_trials} trials", *known]),
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
    found = [
        f"{name} ({', '.join(fixed(v, 3) for v in values)}) {unit}"
        for name, values, unit in places
        if values is not None
    ]
    return ["at the onset: " + ", ".join(found)] if found else []


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
