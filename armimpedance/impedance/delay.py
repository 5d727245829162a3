"""Are the kinematics delayed against the force? One sample late makes B wrong by some percent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armimpedance.errors import ArmImpedanceError
from armimpedance.impedance.regressors import impedance_factors
from armimpedance.records import Recording
from armimpedance.regression.solve import fit
from armimpedance.signals.response import choose_span, respond
from armimpedance.signals.validity import Check
from armimpedance.signals.windows import cut_windows

#: Delays are looked for up to this much either way (s).
LONGEST_S = 0.01
#: Delays below one sample are told from noise only if the fit is this good.
LOWEST_VAF = 0.8


def check_delay(recording: Recording) -> tuple[Check, ...]:
    """Shift the force against the motion and look where the model explains most.

    Uses the condition with the most trials. The residual's least squares over the shift is a
    parabola near its minimum; its vertex is the delay.
    """
    if recording.perturbation != "returning":
        return ()
    counts = recording.trials["condition"].value_counts()
    rows = (recording.trials["condition"] == counts.index[0]).to_numpy()
    try:
        return (_delay_of(recording.select(rows)),)
    except ArmImpedanceError as error:
        return (Check("delay", "warning", f"cannot be judged: {error}"),)


def _delay_of(recording: Recording) -> Check:
    window = cut_windows(recording)
    span = choose_span(window)
    rate = window.sample_rate_hz
    shifts = np.arange(-round(LONGEST_S * rate), round(LONGEST_S * rate) + 1)
    unexplained = []
    for shift in shifts:
        # Positive shift: the force as it is `shift` samples later, for a force that comes late.
        moved = replace(window, force=np.roll(window.force, -shift, axis=1))
        factors = impedance_factors(respond(moved, span), recording.kind)
        unexplained.append(1 - fit(factors, covariance="classical").vaf)
    best = int(np.argmin(unexplained))
    if 1 - unexplained[best] < LOWEST_VAF:
        return Check("delay", "warning", "cannot be judged: the model explains too little")
    if best in (0, len(shifts) - 1):
        late = "force" if shifts[best] > 0 else "kinematics"
        text = f"{late} at least {abs(shifts[best]) / rate * 1e3:.0f} ms late"
        return Check("delay", "warning", text)
    left, middle, right = unexplained[best - 1 : best + 2]
    vertex = shifts[best] + 0.5 * (left - right) / (left - 2 * middle + right)
    if abs(vertex) < 0.5:
        return Check("delay", "ok", f"{vertex / rate * 1e3:+.2f} ms, less than half a sample")
    late = "force" if vertex > 0 else "kinematics"
    text = f"{late} {abs(vertex) / rate * 1e3:.2f} ms late: B is wrong by percents"
    return Check("delay", "warning", text)
