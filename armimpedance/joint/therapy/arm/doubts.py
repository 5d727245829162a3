"""Checks of the assumptions about passive movements: no effort, no viscosity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import pandas as pd

from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording, Subject
from armimpedance.joint.therapy.arm.axis_stiffness import AxisFit
from armimpedance.joint.therapy.arm.passive_arm import ArmSegment
from armimpedance.limb.arm import WINTER
from armimpedance.numerics.regression import NamedParameter
from armimpedance.numerics.signals import emg_gate, recorded_emg

#: Sd of the viscosity of a relaxed arm, N m s/rad. Relaxed elbows have .03 to .05 (Venture) with an
#: inertia of .07 kg m^2: a twentieth of critical damping. From that, an outstretched arm of .4
#: kg m^2 with 1 to 5 N m/rad has .06 to .14; a spastic one has several times as much.
VISCOSITY_SD: Final = 0.3
#: Largest fraction of its weight by which an arm's own tissue lifts it, if its rest angle is beyond
#: the middle of the movement.
_CARRIED: Final = 0.25
#: Largest relative difference of equal masses.
_SAME_MASS: Final = 0.02
#: Relative sd of the arm's inertia about the table's: 3 % of masses, and the squared distances.
_INERTIA_SD: Final = 0.07
#: Largest uncertainty of the relative inertia with which its check can show a wrong encoder zero:
#: the inertia of a raised arm about the vertical changes by a tenth over some six degrees.
_TELLS: Final = 0.1
#: Standard errors above which an effect counts as seen.
_SEEN: Final = 3.0


def viscosity_sd(fitted: AxisFit) -> float:
    """Sd of the viscosity for which an interval must allow, N m s/rad."""
    return fitted.viscosity if _is_seen(fitted) else VISCOSITY_SD


def _is_seen(fitted: AxisFit) -> bool:
    """True if the viscosity is above the usual; less could also be slightly wrong masses."""
    return fitted.viscosity > max(_SEEN * fitted.viscosity_sd, VISCOSITY_SD)


def viscosity_finding(
    axis: str, fitted: AxisFit, rest: NamedParameter, direction: NamedParameter | None
) -> Finding:
    """Check that the arm's viscous resistance is separate from the rest angle.

    `axis`: name of the axis.
    `rest`: q_0 of the axis.
    `direction`: half the difference between both directions; None with one direction only.
    """
    if direction is not None:
        both_ways = (
            f"axis {axis} was moved both ways: {direction.value:.2g} N m that turn round with it"
        )
        half = (direction.ci95[1] - direction.ci95[0]) / 2
        return Finding(
            "viscosity", "ok", f"{both_ways} are apart from q_0", smallest=f"{half:.2g} N m"
        )
    seen = f"{max(_SEEN * fitted.viscosity_sd, VISCOSITY_SD):.2g} N m s/rad"
    back = "record the movement back too"
    sd = viscosity_sd(fitted)
    moved = abs(sd * float(np.array([rest.value, 1.0]) @ fitted.speed_gradient))
    stiffness = float(fitted.fit.parameters[0])
    shift = f"q_0 by {moved / stiffness:.2g} rad" if np.isfinite(rest.value) else "the offset"
    if _is_seen(fitted):
        return Finding(
            "viscosity",
            "warning",
            f"axis {axis} resists its speed by some {fitted.viscosity:.2g} N m s/rad; moved one "
            f"way only, that moves {shift}, which the interval allows for; {back}",
            smallest=seen,
        )
    return Finding(
        "viscosity",
        "cannot tell",
        f"axis {axis} was moved one way only, where an arm that resists its speed looks like one "
        f"of another rest angle: {sd:.2g} N m s/rad move {shift}, which the interval allows for; "
        f"{back}",
        smallest=seen,
    )


def zero_finding(fits: Mapping[str, AxisFit]) -> Finding:
    """Check that the inertia about axes without weight agrees with the encoder angles.

    The inertia about one axis depends on the angles of the others: it differs if an arm is raised
    by ten degrees more than its encoder shows, for any stiffness.
    """
    name = "encoder zero"
    sds = {k: float(np.hypot(f.inertia_sd, _INERTIA_SD * f.arm_inertia)) for k, f in fits.items()}
    axis = min(sds, key=sds.__getitem__)
    if not np.isfinite(sds[axis]):
        text = (
            "no movement about an upright axis, whose inertia goes with the other axes' angles: an "
            "encoder whose zero is off moves k_s and q_0; check the zeros at the mechanical stops"
        )
        return Finding(name, "cannot tell", text)
    off, sd = fits[axis].inertia, sds[axis]
    smallest = f"{100 * _SEEN * sd:.0f} % of the inertia about axis {axis}"
    text = f"the inertia about axis {axis} is {100 * off:+.0f} % off what angles and masses make it"
    if abs(off) <= _SEEN * sd:
        if _SEEN * sd <= _TELLS:
            return Finding(name, "ok", text, smallest=smallest)
        text += ", which is too little known to show an encoder's zero: move faster about that axis"
        return Finding(name, "cannot tell", text, smallest=smallest)
    text += (
        ": the zero of another axis' encoder is off, and k_s and q_0 are wrong; check the zeros at "
        "the mechanical stops, and if they are right the masses and lengths that were told"
    )
    return Finding(name, "warning", text, smallest=smallest)


def silence_finding(
    recording: Recording, limit_percent: float | None, fits: Mapping[str, AxisFit]
) -> Finding:
    """Check that the muscles were silent while the arm was moved passively.

    `recording`: the passive trials.
    `limit_percent`: limit of the EMG, in % of the maximum; None for no limit.
    Returns: a warning if somebody other than the robot carries the arm.
    Raises InputError: a muscle is above the limit; the message names it and the trial.
    """
    emg = recorded_emg(recording)
    is_gated = emg is not None and limit_percent is not None
    if emg is not None and limit_percent is not None:
        level = emg_gate(emg, pd.DataFrame(recording.trials), limit_percent=limit_percent)
    for axis, fitted in fits.items():
        carried = fitted.carried
        if carried > _CARRIED:
            why = (
                "its masses are too large"
                if is_gated
                else "somebody carries it, or masses are too large"
            )
            return Finding(
                "mass" if is_gated else "muscles silent",
                "warning",
                f"axis {axis} needs {100 * carried:.0f} % less than the arm's weight: {why}",
                smallest=f"{100 * _CARRIED:.0f} % of the weight",
            )
    if is_gated:
        return Finding("muscles silent", "ok", str(level), smallest=f"{limit_percent:g} %")
    why = "no EMG was recorded" if emg is None else "the gate on the EMG is off"
    return Finding(
        "muscles silent",
        "cannot tell",
        f"{why}: a steady effort of the person would pass for stiffness and rest angle",
        smallest=f"{100 * _CARRIED:.0f} % of the arm's weight",
    )


def mass_finding(
    subject: Subject, segments: Sequence[ArmSegment], mass_sd: float
) -> tuple[Finding, ...]:
    """Check that the segments have the masses of the table for the recording's subject.

    `subject`: of the recording.
    `segments`: stated, or computed from a stated body mass.
    `mass_sd`: relative sd of the masses.
    Returns: empty if the recording has no mass.
    """
    if subject.mass_kg is None:
        return ()
    table = WINTER.upper_arm.mass + WINTER.forearm.mass + WINTER.hand.mass
    off = sum(s.mass_kg for s in segments) / (table * subject.mass_kg) - 1
    most = max(_SEEN * mass_sd, _SAME_MASS)
    smallest = f"{100 * most:.0f} %"
    text = (
        f"the arm was given {100 * off:+.0f} % of the mass that the table says for the "
        f"recording's subject of {subject.mass_kg:g} kg"
    )
    if abs(off) <= most:
        return (Finding("mass", "ok", text, smallest=smallest),)
    text += ": one of the two is wrong, and k_s and q_0 with it"
    return (Finding("mass", "warning", text, smallest=smallest),)
