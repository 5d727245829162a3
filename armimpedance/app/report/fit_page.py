"""A FIT.json of any topic: parameters, intervals and checks, as the file holds them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.json_text import read_json
from armimpedance.core.program import software
from armimpedance.core.shown import PARAMETER_HEADS, parameter_row
from armimpedance.show.pages import (
    Asked,
    Page,
    Section,
    Table,
    Topic,
    methods_of,
    page_from,
    reviewed,
    told_by,
)
from armimpedance.show.text import counted


def page_of(asked: Asked) -> Page:
    """The page of a FIT.json."""
    content = read_json(asked.source, "a FIT.json")
    try:
        rows = [_row(one) for one in content["parameters"]]
        checks = tuple(
            Finding(str(c["check"]), c["verdict"], str(c["message"]), str(c["smallest"]))
            for c in content.get("checks", ())
        )
        warnings = [str(warning) for warning in content.get("warnings", ())]
        method = str(content["method"])
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        expected = "what a command wrote to --out"
        raise InputError("not a FIT.json", file=asked.source, expected=expected) from error
    notes = told_by(warnings, checks)
    caption = "Fitted parameters, ± half the 95 % interval"
    table = Table(caption, PARAMETER_HEADS, tuple(rows), "parameters")
    return page_from(
        asked,
        notes,
        title="Fit",
        lead=f"Method {method}; the file holds no samples, so that nothing is drawn.",
        count=counted(len(rows), "parameter"),
        next_step="Give the recording instead of this file to see pictures and residuals.",
        reader=[Section("Parameters", (table,))],
        reviewer=reviewed(notes),
        methods=methods_of([f"Fitted with {software()}, method {method}"], findings=notes),
        options=[("method", method)],
        data={"parameters": pd.DataFrame(rows, columns=list(PARAMETER_HEADS))},
    )


def _row(one: Mapping[str, Any]) -> tuple[str, ...]:
    joint = f" of joint {one['joint']}" if one.get("joint") is not None else ""
    low, high = (np.nan if limit is None else float(limit) for limit in one["ci95"])
    value = np.nan if one["value"] is None else float(one["value"])
    label = f"{one['name']}{joint}"
    return parameter_row(label, value, (low, high), str(one["unit"]), bool(one["well_identified"]))


TOPIC = Topic("a FIT.json of any topic, without its recording", page_of)
