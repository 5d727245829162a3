"""Passive joints as text for a terminal, and what FIT.json says of them beside the contract."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from armimpedance.passive import EmgLevel, PassiveFit
from armimpedance.regression import Validation
from armimpedance.report.numbers import aligned_table, fixed, numbered_notes, percent
from armimpedance.report.parameter_table import parameter_table

_TORQUE_HEADER = ("torque", "rms (Nm)", "R^2", "variance accounted for")
_LEGEND = (
    "Source's sd: independent residuals (Venture, eqs. 9-11); well identified: twice that below "
    "10 %. Intervals are made of the robust sd, which counts that residuals are correlated."
)


def passive_text(
    fits: Sequence[PassiveFit],
    notes: Sequence[str] = (),
    other: Sequence[Validation] | None = None,
) -> str:
    """A table per joint, how well it predicts, then notes."""
    blocks = list(notes)
    for i, fit in enumerate(fits):
        blocks += ["", *_joint_lines(fit, None if other is None else other[i])]
    warnings = list(dict.fromkeys(w for fit in fits for w in fit.warnings))
    return "\n".join([*blocks, "", *numbered_notes([*warnings, _LEGEND])])


def _joint_lines(fit: PassiveFit, other: Validation | None) -> list[str]:
    cutoff = "no filter" if fit.cutoff_hz is None else f"filter {fit.cutoff_hz:g} Hz"
    return [
        f"{fit.joint}: {fit.method}, {fit.n} rows, {cutoff}, condition "
        f"{fixed(fit.cond_raw, 2)} (columns scaled {fixed(fit.cond_scaled, 2)})",
        parameter_table(fit.parameters, "source's sd"),
        "",
        aligned_table(_TORQUE_HEADER, _torque_rows(fit, other)),
        f"friction makes {percent(fit.friction_share_percent)} of the torque",
    ]


def _torque_rows(fit: PassiveFit, other: Validation | None) -> list[list[str]]:
    rows = [["fitted", *_quality(fit.direct)]]
    for part in fit.cross:
        name = part.left_out if "trial" in part.left_out else f"trial {part.left_out}"
        rows.append([f"{name}, left out", *_quality(part.validation)])
    return rows if other is None else [*rows, ["other recording", *_quality(other)]]


def _quality(validation: Validation) -> list[str]:
    rms, vaf = float(validation.rms[0]), 100 * validation.vaf
    return [f"{rms:.3g}", f"{validation.r2:.4f}", f"{vaf:.2f} %"]


def emg_text(level: EmgLevel) -> str:
    """The mean activity of every muscle, in one line."""
    shown = ", ".join(
        f"{muscle} {mean:.1f} %"
        for muscle, mean in zip(level.muscles, level.mean_percent.mean(axis=0), strict=True)
    )
    return f"EMG: {shown} of the maximum, below the gate of {level.limit_percent:g} %"


def passive_object(fits: Sequence[PassiveFit]) -> list[dict[str, Any]]:
    """One entry a joint, for FIT.json."""
    return [
        {
            "joint": fit.number,
            "name": fit.joint,
            "n": fit.n,
            "cond_raw": fit.cond_raw,
            "cond_scaled": fit.cond_scaled,
            "rest_angle": fit.terms.rest_angle,
            "cutoff_hz": fit.cutoff_hz,
            "friction_share_percent": fit.friction_share_percent,
            "direct_validation": _quality_object(fit.direct),
            "cross_validation": [
                {"left_out": c.left_out, **_quality_object(c.validation)} for c in fit.cross
            ],
            "warnings": list(fit.warnings),
        }
        for fit in fits
    ]


def _quality_object(validation: Validation) -> dict[str, float]:
    return {"rms_Nm": float(validation.rms[0]), "r2": validation.r2, "vaf": validation.vaf}


def emg_object(level: EmgLevel | None) -> dict[str, Any] | None:
    """How active the muscles were; None where that is not known."""
    if level is None:
        return None
    return {
        "muscles": list(level.muscles),
        "mean_percent": level.mean_percent.tolist(),
        "highest_percent": level.highest_percent.tolist(),
        "limit_percent": level.limit_percent,
    }
