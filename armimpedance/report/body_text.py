"""Identified bodies as text for a terminal, and what FIT.json says of them beside the contract."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np

from armimpedance.body import PARAMETERS, BodyFit, BodyValidation, moving_segments
from armimpedance.report.numbers import TABLE_WIDTH, aligned_table, percent, short, with_interval
from armimpedance.skeleton import Skeleton

#: Parameters shown on a screen; all stand in FIT.json.
_SHOWN = 12


def body_text(fit: BodyFit) -> str:
    """What a person reads first, then the best known base parameters."""
    order = np.argsort(fit.relative_sd_percent)[:_SHOWN]
    parameters = fit.summary().parameters
    rows = [
        [
            short(fit.base.expressions[i], 44),
            with_interval(parameters[i].value, *parameters[i].ci95),
            fit.base.units[i],
            percent(float(fit.relative_sd_percent[i])),
        ]
        for i in order
    ]
    table = aligned_table(("base parameter", "value (95 % interval)", "unit", "robust sd"), rows)
    more = fit.base.rank - len(rows)
    tail = f"\n(the best known; {more} more in FIT.json)" if more > 0 else ""
    lines = [textwrap.fill(t, TABLE_WIDTH, subsequent_indent="  ") for t in fit.lines()]
    return "\n".join([*lines, "", table]) + tail


def body_object(fit: BodyFit, skeleton: Skeleton) -> dict[str, Any]:
    """Expressions, motions, validation, and the segments' parameters where the method has them."""
    names = fit.choice.motions
    found: dict[str, Any] = {
        "expressions": dict(zip(fit.base.names, fit.base.expressions, strict=True)),
        "motions_fitted": list(names),
        "condition_after_each": list(fit.choice.conditions),
        "condition_alone": fit.choice.alone.tolist(),
        "direct_validation": _validation(fit.fitted),
        "cross_validation": None if fit.held_out is None else _validation(fit.held_out),
    }
    if fit.noise is not None:
        shift = dict(zip(fit.base.names, fit.noise.shift.tolist(), strict=True))
        found["angle_noise"] = {"level_rad": fit.noise.level, "bias_taken_off": shift}
    if fit.phi is not None:
        found["segments"] = _segments(fit, skeleton)
    return found


def _segments(fit: BodyFit, skeleton: Skeleton) -> dict[str, dict[str, float]]:
    segments = moving_segments(skeleton)
    phi = np.asarray(fit.phi)[: 10 * len(segments)].reshape(len(segments), 10)
    return {
        s.name: dict(zip(PARAMETERS, row.tolist(), strict=True))
        for s, row in zip(segments, phi, strict=True)
    }


def _validation(validation: BodyValidation) -> list[dict[str, Any]]:
    return [
        {
            "motion": motion,
            "samples": int(validation.samples[t]),
            "rms": dict(zip(validation.rows, validation.rms[t].tolist(), strict=True)),
            "r2": dict(zip(validation.rows, validation.r2[t].tolist(), strict=True)),
        }
        for t, motion in enumerate(validation.motions)
    ]
