"""A plan as text for a terminal of 100 columns."""

from __future__ import annotations

import textwrap

import numpy as np

from armimpedance.hand.planning.candidate import Candidate
from armimpedance.hand.planning.plan import Plan
from armimpedance.show.text import aligned_table

_WIDTH = 100
#: Larger relative half-widths are not printed.
_LARGEST_PART = 10.0
_HEADER = ("shape", "s", "mm", "m/s^2", "M, %", "B, %", "K, %", "size, %", "angle, deg", "trials")
_SHAPE = {
    2: "size and angle: half the interval of the stiffness ellipse's area and orientation.",
    3: "size: half the interval of the stiffness ellipsoid's volume; angle: how far its longest "
    "axis may turn.",
}
_REFLEX_HEADER = ("shape", "s", "K too large, %", "K, %", "K and R apart: K, %", "R, % of K")


def plan_text(plan: Plan, trials: int = 40) -> str:
    """Predicted precision with so many trials, trials needed, the effect of a reflex, advice.

    If the requirements cannot be met, `plan.obstacle` says why.

    Parameters
    ----------
    plan : Plan
    trials : int
        Number of trials for the precision.

    Returns
    -------
    str
        Lines of at most 100 characters.
    """
    about = (
        f"{plan.setting.arm.name}, noise {plan.setting.noise.name}, {_servo(plan)}, "
        f"{plan.setting.directions} directions; half-widths of 95 % intervals with {trials} trials"
    )
    parts = [
        textwrap.fill(about, _WIDTH),
        aligned_table(_HEADER, [_row(c, trials) for c in plan.candidates]),
        _reflex_table(plan, trials),
        _legend(plan),
        *_notes(plan),
        _advice(plan),
    ]
    return "\n\n".join(part for part in parts if part)


def _servo(plan: Plan) -> str:
    servo = plan.setting.servo
    if np.isinf(servo.stiffness):
        return "ideal servo"
    return f"servo of {servo.stiffness:,.0f} N/m ({servo.natural_hz:.3g} Hz)"


def _row(candidate: Candidate, trials: int) -> list[str]:
    cells = _place(candidate)
    precision = candidate.precision
    if precision is None:
        return [*cells, *["-"] * 6]
    needed = "millions" if candidate.trials is None else f"{candidate.trials:,}"
    M, B, K = (precision.diagonal_part(trials, matrix) for matrix in range(3))
    return [
        *cells,
        *(_percent(part) for part in (M, B, K, precision.size_part(trials))),
        f"{np.rad2deg(precision.orientation(trials)):.1f}",
        needed,
    ]


def _place(candidate: Candidate) -> list[str]:
    profile = candidate.profile
    return [
        candidate.name,
        f"{candidate.duration_s:.3g}",
        f"{1e3 * candidate.amplitude_m:.3g}",
        "-" if profile is None else f"{profile.peak_acceleration:.3g}",
    ]


def _reflex_table(plan: Plan, trials: int) -> str:
    rows = []
    for candidate in plan.candidates:
        if candidate.precision is None or candidate.profile is None:
            continue
        apart = ["-", "-"]
        if candidate.apart is not None:
            apart = [_percent(candidate.apart.diagonal_part(trials, m)) for m in (2, 3)]
        alone = _percent(candidate.precision.diagonal_part(trials, 2))
        rows.append([*_place(candidate)[:2], _range(candidate.bias), alone, *apart])
    if not rows:
        return ""
    title = (
        f"With a reflex of 25 % of K, {1e3 * plan.delay_s:g} ms late (+-5): ignored; or fitted as "
        "R x(t - delay)"
    )
    return f"{title}\n{aligned_table(_REFLEX_HEADER, rows)}"


def _range(bias: tuple[float, float]) -> str:
    low, high = (f"{100 * value:+.0f}" for value in bias)
    return low if low == high else f"{low} to {high}"


def _percent(part: float) -> str:
    if part > _LARGEST_PART:
        return f"> {100 * _LARGEST_PART:g}"
    return f"{100 * part:.2f}" if part < 0.1 else f"{100 * part:.1f}"


def _legend(plan: Plan) -> str:
    return textwrap.fill(
        "M, B, K: the largest of the diagonal elements' half-widths, in % of the element (M with "
        f"the handle). {_SHAPE[plan.setting.arm.axes]} trials: in whole sets of "
        f"{plan.setting.directions}, for {plan.wish.text}. m/s^2: peak acceleration of the "
        "command.",
        _WIDTH,
    )


def _notes(plan: Plan) -> list[str]:
    notes = list(dict.fromkeys(note for c in plan.candidates for note in c.notes))
    problems = list(dict.fromkeys(c.problem for c in plan.candidates if c.problem))
    return [textwrap.fill(f"Note: {text}", _WIDTH) for text in (*plan.warnings, *notes, *problems)]


def _advice(plan: Plan) -> str:
    best = plan.best
    if plan.obstacle or best is None:
        return ""
    fewest = f"Fewest trials: {best.trials:,} with {best.name} of {best.duration_s:.3g} s."
    return textwrap.fill(f"{fewest} But {best.doubt}.", _WIDTH) if best.doubt else fewest
