"""Results of one joint under a random perturbation as text."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence

import numpy as np

from armimpedance.core.shown import fixed, with_half_width, with_interval
from armimpedance.joint.elbow.elbow_result import NAMES, ElbowFit, VaryingImpedance
from armimpedance.joint.elbow.emg.law_result import EmgLaw, LinearLaw, OperatingPoints
from armimpedance.show.text import (
    TABLE_WIDTH,
    aligned_table,
    checks_lines,
    counted,
    numbered_notes,
    parameter_table,
    short,
)

_LEGEND = (
    "Intervals are made of the robust sd, which counts that residuals are correlated; the textbook "
    "sd takes them as independent. "
    "Well identified: twice the larger of the two below 10 %."
)
_LABEL_WIDTH = 30
#: Ratio of interval widths from which those that allow for undetected effects are shown.
_NO_WIDER = 1.1


def elbow_text(fit: ElbowFit) -> str:
    """Table of I, B and K, how the data were prepared, then parts of the recording.

    Parameters
    ----------
    fit : ElbowFit

    Returns
    -------
    str
    """
    s = fit.summary
    blocks = [
        f"{s.method}: {s.n} rows, condition of the scaled columns {s.cond_scaled:.3g}, "
        f"variance accounted for {100 * s.vaf:.2f} %",
        *_filled(fit.preparation),
        _snr_line(fit),
        _whiteness_line(fit),
        "",
        parameter_table(s.parameters, "textbook sd"),
        *_filled(_allowing(fit)),
    ]
    if fit.parts:
        blocks += ["", _parts_table(fit.parts)]
    blocks += checks_lines(fit.checks)
    return "\n".join([*blocks, "", *numbered_notes([*s.warnings, _LEGEND])])


def _allowing(fit: ElbowFit) -> list[str]:
    """I, B, K when undetected effects are allowed for, if their intervals differ."""
    if fit.allowing is None or fit.allowing is fit.parameters:
        return []
    own, wide = (np.diff(p.interval(), axis=1) for p in (fit.parameters, fit.allowing))
    if (wide <= _NO_WIDER * own).all():
        return []
    limits = ", ".join(
        f"{p.name} {p.ci95[0]:.3g} to {p.ci95[1]:.3g}" for p in map(fit.allowing.__getitem__, NAMES)
    )
    return [
        f"Were there a late answer (reflex) or a skew that the record does not exclude: {limits}."
    ]


def _snr_line(result: ElbowFit | VaryingImpedance) -> str:
    """Line such as ``signal to noise: torque 31 dB, angle 40 dB``."""
    snr = result.snr
    shown = {
        name: "no noise seen" if value is None else f"{value:.0f} dB"
        for name, value in (("torque", snr.torque_db), ("angle", snr.angle_db))
    }
    return f"signal to noise: torque {shown['torque']}, angle {shown['angle']}"


def _whiteness_line(fit: ElbowFit) -> str:
    """Line on the whiteness of the residuals."""
    w = fit.whiteness
    verdict = "white" if w.p >= 0.05 else "correlated"
    return (
        f"residuals: {verdict} (Ljung-Box over {counted(w.lags, 'lag')}: {w.probability}; "
        f"largest correlation {w.largest_correlation:.2f})"
    )


def _parts_table(parts: Mapping[str, ElbowFit]) -> str:
    rows = [
        [
            short(label, _LABEL_WIDTH),
            *(with_interval(p.value, *p.ci95) for p in f.summary.parameters),
        ]
        for label, f in parts.items()
    ]
    if len(parts) > 1:
        values = np.array([f.parameters.values for f in parts.values()])
        mean, sd = values.mean(axis=0), values.std(axis=0, ddof=1)
        rows.append(["mean ± sd", *(f"{m:.3g} ± {s:.2g}" for m, s in zip(mean, sd, strict=True))])
    return aligned_table(("part", "I", "B", "K"), rows)


def varying_text(varying: VaryingImpedance) -> str:
    """I, the range of B and K, the mean width of their bands, then notes, as text.

    Parameters
    ----------
    varying : VaryingImpedance

    Returns
    -------
    str
    """
    rows = []
    for name in "BK" if varying.reflex is None else "BKG":
        source = varying.reflex if name == "G" else varying
        value, band = getattr(source, name), varying.band(name)
        half = (band[:, 1] - band[:, 0]) / 2
        cells = (value.mean(), value.min(), value.max(), np.median(half))
        rows.append([name, *(f"{c:.3g}" for c in cells)])
    points = f"{counted(len(varying.time_s), 'point')} of {counted(len(varying.trials), 'trial')}"
    blocks = [
        *_filled(varying.notes),
        f"{varying.method}: {points}",
        *_filled(varying.preparation),
        _snr_line(varying),
        f"I {with_interval(varying.inertia.value, *varying.inertia.ci95)} {varying.inertia.unit}",
        "",
        aligned_table(("", "mean", "lowest", "highest", "± (median half-width)"), rows),
        *checks_lines(varying.checks),
        "",
    ]
    return "\n".join([*blocks, *numbered_notes(varying.warnings)]).rstrip()


def _filled(sentences: Sequence[str]) -> list[str]:
    return [textwrap.fill(s, TABLE_WIDTH, subsequent_indent="  ") for s in sentences]


# Laws of stiffness and viscosity over EMG as text.

_HEADER = ("", "value (95 % interval)", "unit", "least squares", "attenuation")
_LAW_LEGEND = (
    "Errors of the amplitudes are accounted for; least squares, beside it, takes them as exact and "
    "flattens the slopes by the attenuation. Amplitudes are parts of the maximum contraction."
)


def law_text(law: EmgLaw) -> str:
    """Notes, the points, a table of each law, and warnings, as text.

    Parameters
    ----------
    law : EmgLaw

    Returns
    -------
    str
    """
    blocks = [textwrap.fill(n, TABLE_WIDTH, subsequent_indent="  ") for n in law.notes]
    if law.points is not None:
        blocks += ["", _points_table(law.points)]
    for linear in law.laws:
        blocks += ["", _law_table(linear)]
    blocks += checks_lines(law.checks)
    return "\n".join([*blocks, "", *numbered_notes([*law.warnings, _LAW_LEGEND])])


def _law_table(law: LinearLaw) -> str:
    rows = [
        [p.name, with_interval(p.value, *p.ci95), p.unit, f"{naive:.4g}", fixed(part, 2)]
        for p, naive, part in zip(law.parameters, law.naive, law.attenuation, strict=True)
    ]
    head = (
        f"{law.symbol} over EMG: {law.n} points, R^2 {law.r2:.3f}, scatter beyond the stated "
        f"errors {law.scatter:.2g} {law.unit}, condition {law.cond_scaled:.3g}"
    )
    return f"{head}\n{aligned_table(_HEADER, rows)}"


def _points_table(source: OperatingPoints) -> str:
    points, muscles, indexed = source.to_dict(), source.muscles, source.imcj is not None
    header = ["trial", *(f"{m} (%)" for m in muscles), "K", "B"] + ["IMCJ (N m)"] * indexed
    rows = []
    for p in points:
        cells = [fixed(100 * p["amplitude"][m], 1) for m in muscles]
        cells += [with_half_width(p[s], 2 * p[f"sd_{s}"]) for s in "KB"]
        if indexed:
            cells.append(with_half_width(p["imcj_Nm"], 2 * p["sd_imcj_Nm"]))
        rows.append([str(p["trial"]), *cells])
    return aligned_table(header, rows)
