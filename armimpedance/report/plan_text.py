"""A plan as text for a terminal of 100 columns."""

from __future__ import annotations

import textwrap

import numpy as np

from armimpedance.planning.plan import Candidate, Plan
from armimpedance.planning.precision import Precision
from armimpedance.report.numbers import aligned_table

_WIDTH = 100
_HEADER = ("shape", "s", "mm", "m/s^2", "M, %", "B, %", "K, %", "size, %", "angle, deg", "trials")
_REFLEX_HEADER = ("shape", "s", "K too large, %", "K, %", "K and R apart: K, %", "R, % of K")


def plan_text(plan: Plan, trials: int = 40) -> str:
    """Expected precision with so many trials, trials needed, what a reflex does, advice.

    Parameters
    ----------
    plan : Plan
    trials : int
        Of the columns of precision.
    """
    about = (
        f"{plan.setting.arm.name}, noise {plan.setting.noise.name}, {_servo(plan)}, "
        f"8 directions; half-widths of 95 % intervals with {trials} trials"
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
    return f"servo of {servo.stiffness:.4g} N/m ({servo.natural_hz:.3g} Hz)"


def _row(candidate: Candidate, trials: int) -> list[str]:
    cells = _place(candidate)
    if candidate.found is None:
        return [*cells, *["-"] * 6]
    found = candidate.found
    needed = "millions" if candidate.trials is None else f"{candidate.trials:,}"
    M, B, K = (diagonal_part(found, trials, matrix) for matrix in range(3))
    return [
        *cells,
        *(_percent(part) for part in (M, B, K, found.size_part(trials))),
        f"{np.rad2deg(found.orientation(trials)):.1f}",
        needed,
    ]


def diagonal_part(found: Precision, trials: int, matrix: int) -> float:
    """Half-width of a matrix' diagonal elements, the largest part of its element."""
    half = np.diag(found.half_widths(trials)[matrix])
    return float((half / np.diag(found.parameters[min(matrix, 2)])).max())


def _place(candidate: Candidate) -> list[str]:
    profile = candidate.profile
    if profile is None:
        return [candidate.name, "-", "-", "-"]
    return [
        candidate.name,
        f"{profile.duration_s:g}",
        f"{1e3 * profile.amplitude_m:.3g}",
        f"{profile.peak_acceleration:.3g}",
    ]


def _reflex_table(plan: Plan, trials: int) -> str:
    rows = []
    for candidate in plan.candidates:
        if candidate.found is None or candidate.profile is None:
            continue
        apart = ["-", "-"]
        if candidate.apart is not None:
            apart = [_percent(diagonal_part(candidate.apart, trials, m)) for m in (2, 3)]
        alone = _percent(diagonal_part(candidate.found, trials, 2))
        rows.append([*_place(candidate)[:2], f"{100 * candidate.bias:+.0f}", alone, *apart])
    if not rows:
        return ""
    title = (
        f"With a reflex {1e3 * plan.delay_s:g} ms late of 25 % of K: ignored, and fitted as R "
        "x(t - delay) beside K"
    )
    return f"{title}\n{aligned_table(_REFLEX_HEADER, rows)}"


def _percent(part: float) -> str:
    return f"{100 * part:.2f}" if part < 0.1 else f"{100 * part:.1f}"


def _legend(plan: Plan) -> str:
    wish, wishes = plan.wish, []
    if wish.k_part is not None:
        wishes.append(f"K within {100 * wish.k_part:g} %")
    if wish.orientation_rad is not None:
        wishes.append(f"the orientation within {np.rad2deg(wish.orientation_rad):.3g} degrees")
    asked = f" for {' and '.join(wishes)}" if wishes else ""
    return textwrap.fill(
        "M, B, K: the larger of both diagonal elements' half-widths, in % of the element (M with "
        "the handle). size and angle: half the interval of the stiffness ellipse's area and "
        f"orientation. trials: in whole sets of 8{asked}. m/s^2: peak acceleration of the command.",
        _WIDTH,
    )


def _notes(plan: Plan) -> list[str]:
    notes = list(dict.fromkeys(note for c in plan.candidates for note in c.notes))
    problems = list(dict.fromkeys(c.problem for c in plan.candidates if c.problem))
    return [textwrap.fill(f"Note: {text}", _WIDTH) for text in (*notes, *problems)]


def _advice(plan: Plan) -> str:
    best, wish = plan.best, plan.wish
    if plan.obstacle:
        return textwrap.fill(f"Cannot be met: {plan.obstacle}.", _WIDTH)
    if best is None or (wish.k_part is None and wish.orientation_rad is None):
        return ""
    where = "" if best.profile is None else f" of {best.profile.duration_s:g} s"
    return f"Fewest trials: {best.trials:,} with {best.name}{where}."
