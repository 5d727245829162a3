"""One joint under a random perturbation as text, and what FIT.json adds to the contract."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from armimpedance.elbow import NAMES, ChannelSnr, ElbowFit, VaryingImpedance, probability
from armimpedance.report.numbers import (
    TABLE_WIDTH,
    aligned_table,
    counted,
    numbered_notes,
    short,
    with_interval,
)
from armimpedance.report.parameter_table import parameter_table

_LEGEND = (
    "Intervals are made of the robust sd, which counts that residuals are correlated; the textbook "
    "sd takes them as independent. Well identified: twice the textbook sd below 10 %."
)
_LABEL_WIDTH = 30


def elbow_text(
    fit: ElbowFit, parts: Mapping[str, ElbowFit] | None = None, notes: Sequence[str] = ()
) -> str:
    """A table of I, B and K, how the data were prepared, then parts of the recording.

    Parameters
    ----------
    fit : ElbowFit
    parts : mapping label -> ElbowFit, optional
        The same of single conditions or trials.
    notes : sequence of str
        Printed first.
    """
    s = fit.summary
    blocks = [
        *_filled(notes),
        f"{s.method}: {s.n} rows, condition of the scaled columns {s.cond_scaled:.3g}, "
        f"variance accounted for {100 * s.vaf:.2f} %",
        *_filled(fit.preparation),
        snr_line(fit.snr),
        whiteness_line(fit),
        "",
        parameter_table(s.parameters, "textbook sd"),
    ]
    if parts:
        blocks += ["", _parts_table(parts)]
    return "\n".join([*blocks, "", *numbered_notes([*s.warnings, _LEGEND])])


def snr_line(snr: ChannelSnr) -> str:
    """``signal to noise: torque 31 dB, angle 40 dB``."""
    shown = {
        name: "no noise seen" if value is None else f"{value:.0f} dB"
        for name, value in (("torque", snr.torque_db), ("angle", snr.angle_db))
    }
    return f"signal to noise: torque {shown['torque']}, angle {shown['angle']}"


def whiteness_line(fit: ElbowFit) -> str:
    """What is left in the residuals."""
    w = fit.whiteness
    said = "white" if w.p >= 0.05 else "correlated"
    return (
        f"residuals: {said} (Ljung-Box over {counted(w.lags, 'lag')}: {probability(w.p)}; "
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
        values = np.array([f.values for f in parts.values()])
        mean, sd = values.mean(axis=0), values.std(axis=0, ddof=1)
        rows.append(["mean ± sd", *(f"{m:.3g} ± {s:.2g}" for m, s in zip(mean, sd, strict=True))])
    return aligned_table(("part", *NAMES), rows)


def varying_text(varying: VaryingImpedance, notes: Sequence[str] = ()) -> str:
    """I, the range of B and K, the mean width of their bands, then notes."""
    rows = []
    for name in "BK":
        value, band = getattr(varying, name), varying.band(name)
        half = (band[:, 1] - band[:, 0]) / 2
        cells = (value.mean(), value.min(), value.max(), np.median(half))
        rows.append([name, *(f"{c:.3g}" for c in cells)])
    points = f"{counted(len(varying.time_s), 'point')} of {counted(len(varying.trials), 'trial')}"
    blocks = [
        *_filled(notes),
        f"{varying.method}: {points}",
        *_filled(varying.preparation),
        snr_line(varying.snr),
        f"I {with_interval(varying.inertia.value, *varying.inertia.ci95)} {varying.inertia.unit}",
        "",
        aligned_table(("", "mean", "lowest", "highest", "± (median half-width)"), rows),
        "",
    ]
    return "\n".join([*blocks, *numbered_notes(varying.warnings)]).rstrip()


def elbow_object(fit: ElbowFit, parts: Mapping[str, ElbowFit] | None = None) -> dict[str, Any]:
    """What stands in FIT.json beside the contract's fields."""
    return {
        "covariance": fit.covariance,
        "snr_db": {"torque": fit.snr.torque_db, "angle": fit.snr.angle_db},
        "residual_whiteness": vars(fit.whiteness),
        "preparation": list(fit.preparation),
        "details": {name: _plain(value) for name, value in fit.details.items()},
        "parts": [
            {"part": label, **part.summary.to_dict()} for label, part in (parts or {}).items()
        ],
    }


def _plain(value: Any) -> Any:
    """Records as mappings, for JSON."""
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
    return [_plain(v) for v in value] if isinstance(value, (list, tuple)) else value


def _filled(sentences: Sequence[str]) -> list[str]:
    return [textwrap.fill(s, TABLE_WIDTH, subsequent_indent="  ") for s in sentences]
