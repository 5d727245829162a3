"""Are the kinematics delayed against the force? One sample late makes B wrong by some percent."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.errors import ArmImpedanceError, InputError
from armimpedance.findings import Finding
from armimpedance.impedance.regressors import impedance_factors
from armimpedance.records import Recording
from armimpedance.regression import fit
from armimpedance.signals import choose_span, cut_windows, respond

#: Delays are looked for up to this much either way (s).
LONGEST_S = 0.01
#: A delay is judged only if the model explains at least this much.
LOWEST_VAF = 0.8
#: The delay's standard error is a jackknife over this many groups of trials.
GROUPS = 8


def check_delay(recording: Recording) -> tuple[Finding, ...]:
    """Shift the force against the motion and look where the model explains most.

    Uses the condition with the most trials. The unexplained part over the shift is a parabola near
    its minimum; its vertex is the delay, with a standard error, so that noise is not taken for one.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    tuple of Finding
        One check of the delay between force and motion; empty where it does not apply.
    """
    if recording.perturbation != "returning":
        return ()
    counts = recording.trials["condition"].value_counts()
    rows = (recording.trials["condition"] == counts.index[0]).to_numpy()
    try:
        return (_delay_of(recording.select(rows)),)
    except ArmImpedanceError as error:
        return (Finding("delay", "warning", f"cannot be judged: {error}"),)


def _delay_of(recording: Recording) -> Finding:
    curve = _curve(recording)
    if 1 - curve.unexplained[0].min() < LOWEST_VAF:
        return Finding("delay", "warning", "cannot be judged: the model explains too little")
    delay, error = curve.delay_s(0), curve.standard_error_s()
    text = f"{delay * 1e3:+.2f} ms (standard error {error * 1e3:.2f} ms), + is a late force"
    if abs(delay) < max(0.5 / recording.sample_rate_hz, 3 * error):
        return Finding("delay", "ok", text)
    late = "force" if delay > 0 else "kinematics"
    return Finding("delay", "warning", f"{late} late, B is wrong by percents: {text}")


@dataclass(frozen=True)
class _Curve:
    """Unexplained part of the force over its shift against the motion.

    Attributes
    ----------
    shift_s : (n,)
    unexplained : (1 + groups, n)
        Unexplained part of all trials, then without each group of trials.
    """

    shift_s: FloatArray
    unexplained: FloatArray

    def delay_s(self, row: int) -> float:
        """Vertex of the parabola through the lowest point and its neighbours."""
        values = self.unexplained[row]
        best = int(np.clip(np.argmin(values), 1, len(values) - 2))
        left, middle, right = values[best - 1 : best + 2]
        bend = left - 2 * middle + right
        vertex = 0.5 * (left - right) / bend if bend > 0 else 0.0
        step = self.shift_s[1] - self.shift_s[0]
        return float(self.shift_s[best] + np.clip(vertex, -1.5, 1.5) * step)

    def standard_error_s(self) -> float:
        """Jackknife over groups of trials."""
        left_out = np.array([self.delay_s(row) for row in range(1, len(self.unexplained))])
        groups = len(left_out)
        return float(np.sqrt((groups - 1) / groups * ((left_out - left_out.mean()) ** 2).sum()))


def _curve(recording: Recording) -> _Curve:
    window = cut_windows(recording)
    span = choose_span(window)
    rate = window.sample_rate_hz
    shifts = np.arange(-round(LONGEST_S * rate), round(LONGEST_S * rate) + 1)
    usable = int(window.usable.sum())
    if usable < 2:
        raise InputError("one usable trial", expected="several, for a standard error")
    group = np.arange(usable) % GROUPS
    rows = []
    for shift in shifts:
        # Positive shift: the force as it is `shift` samples later, for a force that comes late.
        moved = replace(window, force=np.roll(window.force, -shift, axis=1))
        factors = impedance_factors(respond(moved, span), recording.kind)
        kept = [factors] + [factors.subset(group != g) for g in range(GROUPS)]
        rows.append([1 - fit(each, covariance="classical").vaf for each in kept])
    return _Curve(shifts / rate, np.array(rows).T)
