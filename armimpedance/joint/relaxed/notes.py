"""What a reader of a passive joint's parameters must know."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.joint.relaxed.hinge import harmonics_at
from armimpedance.joint.relaxed.linear import TwoFits
from armimpedance.joint.relaxed.samples import PassiveSamples

if TYPE_CHECKING:
    from armimpedance.joint.relaxed.result import PassiveFit

#: A scaled condition number above which the columns are hard to tell apart.
_HARD: Final = 30.0


def joint_notes(
    fitted: PassiveFit, samples: PassiveSamples, fits: TwoFits, elsewhere: str | None
) -> tuple[str, ...]:
    """Warnings on one joint, the samples' own first; `elsewhere` says where the data rest."""
    notes = [*samples.notes, *fits.classical.warnings, *([elsewhere] if elsewhere else [])]
    h = fitted.parameters["h"]
    f = fitted.parameters["f"].value if fitted.terms.friction else 0.0
    doubtless = fitted.terms.friction and fitted.parameters["f"].ci95[1] < 0
    condition = fitted.torque_fit.cond_scaled
    if condition > _HARD:
        notes.append(
            f"ill-conditioned: scaled condition number {condition:.0f}; the motion shows "
            "the terms together rather than each"
        )
    if doubtless:
        notes.append(_negative_friction(f, h.value, natural_frequency(fitted, samples)))
    if h.value < 0:
        notes.append(f"negative viscosity {h.value:.3g} N m s/rad: not dissipative")
    if fitted.parameters["k"].value < 0:
        doubt = "" if elsewhere else "; is the torque's sign right?"
        notes.append(f"negative stiffness: no passive joint has one{doubt}")
    if fitted.terms.free:
        notes.append("rest angle unknown and fitted: the interval of k may be several times wider")
    return tuple(notes)


def natural_frequency(fitted: PassiveFit, samples: PassiveSamples) -> float:
    """Angular frequency of the free joint, rad/s.

    ``sqrt((k + dg/dq) / I)`` at the mean angle where the limb's dynamics is known; otherwise that
    of the recorded swing, ``rms(qd) / sd(q)``.
    """
    q, qd = samples.q[:, 0], samples.qd[:, 0]
    seen = float(np.sqrt((qd**2).mean()) / np.std(q))
    if samples.hinges is None:
        return seen
    mean = np.concatenate(samples.hinges[0].coefficients).mean(axis=0)
    step, at = 1e-4, float(q.mean())
    slope = (harmonics_at(np.array(at + step)) - harmonics_at(np.array(at - step))) / (2 * step)
    stiffness = fitted.parameters["k"].value + float(mean[2:] @ slope)
    return float(np.sqrt(stiffness / mean[0])) if stiffness > 0 else seen


def limit_cycle_rad(f: float, h: float, omega: float) -> float:
    """Amplitude ``4 |f| / (pi h omega)`` of the swing that a negative friction keeps up, rad.

    Describing function of the sign, which gives as much per cycle as viscosity takes.
    """
    return 4 * abs(f) / (np.pi * h * omega)


def _negative_friction(f: float, h: float, omega: float) -> str:
    said = f"negative friction {f:.3g} N m: not dissipative"
    if h <= 0:
        return f"{said}; with h <= 0 nothing would end the swing that it drives"
    amplitude = limit_cycle_rad(f, h, omega)
    return f"{said}; a limit cycle of amplitude {amplitude:.3g} rad at {omega:.3g} rad/s"
