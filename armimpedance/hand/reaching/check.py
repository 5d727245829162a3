"""What `inspect` says of pushed reaches."""

from __future__ import annotations

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.hand.reaching.pushes import pushes_of
from armimpedance.hand.reaching.windows import LEAST_FREE, LEAST_PUSHED


def check_pushes(recording: Recording) -> list[Finding]:
    """How many reaches are free, how many are pushed at each phase, and in which directions.

    Parameters
    ----------
    recording : Recording
        Whose ``perturbation`` is "moving".

    Returns
    -------
    list of Finding
        "pushes" and one for each phase.
    """
    try:
        pushes = pushes_of(recording)
    except InputError as error:
        return [Finding("pushes", "unusable", str(error))]
    free = int((~pushes.pushed).sum())
    few = free < LEAST_FREE
    text = f"{free} reaches are free" + (f": {LEAST_FREE} are the least" if few else "")
    found = [Finding("pushes", "unusable" if few else "ok", text)]
    for phase in pushes.phases:
        rows = pushes.rows(phase)
        mean = np.hypot(*pushes.direction[rows].mean(axis=0))
        text = f"{int(rows.sum())} reaches are pushed"
        if rows.sum() < LEAST_PUSHED:
            found.append(Finding(f"phase {phase}", "unusable", f"{text}, {LEAST_PUSHED} are few"))
        elif pushes.throughout(phase):
            found.append(Finding(f"phase {phase}", "ok", f"{text} throughout"))
        elif mean > 0.3:
            text += " more to one side than to the other: push back and forth alike"
            found.append(Finding(f"phase {phase}", "warning", text))
        else:
            found.append(Finding(f"phase {phase}", "ok", f"{text}, to all sides alike"))
    return found
