"""Passive joints as text for a terminal."""

from __future__ import annotations

from armimpedance.core.shown import fixed, percent
from armimpedance.joint.relaxed.passive_fit import PassiveFit, PassiveFits
from armimpedance.numerics.regression import Validation
from armimpedance.show.text import aligned_table, checks_lines, numbered_notes, parameter_table

_TORQUE_HEADER = ("torque", "rms (N m)", "R^2", "variance accounted for")
_LEGEND = (
    "Source's sd: independent residuals (Venture, eqs. 9-11); well identified: twice the larger "
    "below 10 %. Intervals are made of the robust sd, which counts that residuals are correlated."
)


def passive_text(fits: PassiveFits) -> str:
    """Notes, a table per joint, the quality of each prediction, then warnings.

    Returns: lines of at most 100 characters.
    """
    blocks = list(fits.notes)
    for i, fit in enumerate(fits):
        blocks += ["", *_joint_lines(fit, fits.validations[i] if fits.validations else None)]
    blocks += checks_lines(fits.summary.checks)
    warnings = list(dict.fromkeys(w for fit in fits for w in fit.warnings))
    return "\n".join([*blocks, "", *numbered_notes([*warnings, _LEGEND])])


def _joint_lines(fit: PassiveFit, other: Validation | None) -> list[str]:
    cutoff = "no filter" if fit.cutoff_hz is None else f"filter {fit.cutoff_hz:g} Hz"
    torques = fit.torque_fit
    return [
        f"{fit.joint}: {fit.method}, {torques.n_rows} rows, {cutoff}, condition "
        f"{fixed(torques.cond_raw, 2)} (columns scaled {fixed(torques.cond_scaled, 2)})",
        parameter_table(list(fit.reported), "source's sd"),
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
