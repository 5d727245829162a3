"""What repeats in each disturbance beyond the fit, beside what differs between repeats."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy.special import fdtrc

from armimpedance.core.findings import Finding
from armimpedance.hand.still.doubts.model import Model

#: Lack of fit has no size to weigh, and one recording has few: chance must do much less.
LEVEL_OF_REPEATS: Final = 0.003
#: What repeats unexplained is told from this part of the response on.
LEAST_REPEATED: Final = 0.03


def lack_of_fit(models: Sequence[Model], *, explained: bool) -> tuple[Finding, ...]:
    """The finding "lack of fit", ok where a departure explains it; empty without repeats."""
    found = [one for model in models if (one := _repeated(model)) is not None]
    if not found:
        return ()
    part, p_value, least = (float(np.median(column)) for column in np.transpose(found))
    told = part > LEAST_REPEATED and p_value < LEVEL_OF_REPEATS and not explained
    text = (
        f"{100 * part:.1f} % of the response repeats in each direction and is not explained by "
        "M, B and K" + ("; look at it (`--method all`, `reflex`)" if told else "")
    )
    smallest = f"{100 * max(least, LEAST_REPEATED):.2g} % of the response"
    return (Finding("lack of fit", "warning" if told else "ok", text, smallest=smallest),)


def _repeated(model: Model) -> tuple[float, float, float] | None:
    """Repeated part of the response, p of none, and the least part seen; None without repeats."""
    labels = model.equation.disturbance
    if labels is None:
        return None
    root = np.linalg.cholesky(model.weight)
    # white residuals r_t^T L (d n,), V = L L^T
    white = model.equation.residual(model.parameters) @ root
    counts = np.bincount(labels)
    chosen = counts[labels] > 1
    if not chosen.any():
        return None
    sums = np.zeros((len(counts), white.shape[1]))
    np.add.at(sums, labels, white)
    mean = (sums / np.maximum(counts, 1)[:, None])[labels]
    groups, rows = int((counts > 1).sum()), white.shape[1]
    between, within = (mean[chosen] ** 2).sum(), ((white - mean)[chosen] ** 2).sum()
    free = groups * rows - len(model.parameters), (int(chosen.sum()) - groups) * rows
    if free[0] <= 0:
        return None
    noise = within / free[1]
    response = float(((model.equation.force.reshape(len(white), -1) @ root)[chosen] ** 2).sum())
    part = float(np.sqrt(max(between - free[0] * noise, 0.0) / response))
    p_value = float(fdtrc(free[0], free[1], between / free[0] / noise))
    least = float(np.sqrt(3 * np.sqrt(2 * free[0]) * noise / response))
    return part, p_value, least
