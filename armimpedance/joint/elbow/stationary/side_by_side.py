"""The same record another way: where two estimates differ by more than chance, one is biased.

Both come from the same blocks of the same record, so most of their errors are common. Each tells
what every block moved it by; the difference of these has the covariance of the difference (J. A.
Hausman, Econometrica 46, 1978, with blocks for the variance). Two pairs are compared:

- Output error against instruments from the device's perturbation or command. The device reacts to
  what the subject pushes, so the measured torque holds it, and output error takes it for a cause of
  the motion. It is not made to use what the device was told: it would then be the instruments once
  more.
- Weights of the residual against weights of the sensors' floors, or, where the angle is imposed,
  against a torque whose noise is white: the subject's own torque is there by nature. A joint of
  second order gives the same under both; one whose stiffness depends on the frequency does not. A
  person who is never quite still differs too, by chance more often than blocks tell, so this is a
  note on an interval that holds both; the doubts name the cause where there is one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, NotIdentifiableError
from armimpedance.joint.elbow.elbow_result import NAMES
from armimpedance.joint.elbow.stationary.band import Band
from armimpedance.joint.elbow.stationary.estimate import Estimate
from armimpedance.joint.elbow.stationary.methods import METHODS, ElbowMethod
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples
from armimpedance.numerics.regression import t_factor

#: Chance alone finds a difference in I, B or K this often.
CHANCE: Final = 0.01
#: Differences below this part of a value are of no consequence, however sure.
SMALL: Final = 0.01


def difference(first: Estimate, second: Estimate) -> FloatArray | None:
    """``first - second`` of I, B, K (3,); None where chance explains it."""
    d = first.parameters.values - second.parameters.values
    if first.moved is None or second.moved is None or first.moved.shape != second.moved.shape:
        return None
    # C (3, 3) = (m1 - m2)^T (3, T) (m1 - m2) (T, 3)
    sd = np.sqrt(((first.moved - second.moved) ** 2).sum(axis=0))
    beyond = np.abs(d) > t_factor(first.parameters.dof, 1 - CHANCE / len(NAMES)) * sd
    large = np.abs(d) > SMALL * np.abs(second.parameters.values)
    return d if (beyond & large).any() else None


def with_comparisons(
    estimate: Estimate, method: ElbowMethod, prepared: PreparedSamples, floors: Band, band: Band
) -> Estimate:
    """The estimate with a word, and a wider interval, where another way differs.

    `estimate`: of `method` with the weights of `band`.
    `floors`, `band`: weights of the sensors alone, and those used.
    """
    if method.name == "output-error" and band.source in ("perturbation", "command"):
        estimate = _compared(
            estimate,
            lambda: estimate,
            lambda: METHODS["iv"].identify(prepared, band),
            "method iv, from what the device was told, finds {}: the measured torque reacts to "
            "what the subject pushes, which biases output error; take iv",
            warns=True,
        )
    if band is not floors:
        # arx weighs nothing: what its reference finds holds for it too.
        weighs = METHODS["iv"] if method.name == "arx" else method
        imposed = band.source == "angle"
        by = "white noise" if imposed else "the sensors' noise"
        other = _white(band) if imposed else floors
        estimate = _compared(
            estimate,
            lambda: estimate if weighs is method else weighs.identify(prepared, band),
            lambda: weighs.identify(prepared, other),
            f"weighed by {by} alone "
            "the record gives {}: a stiffness that depends on "
            "the frequency (a reflex), or the subject's answer in the torque; compare bands "
            "(lowest and cut-off frequency)",
            warns=False,
        )
    return estimate


def _white(band: Band) -> Band:
    """The band whose torque has as much noise, white."""
    level = float(np.concatenate([bins.torque_noise for bins in band.trials]).mean())
    whites = (replace(b, torque_noise=np.full(len(b.s), level)) for b in band.trials)
    return replace(band, trials=tuple(whites))


def _compared(
    estimate: Estimate,
    one_way: Callable[[], Estimate],
    other_way: Callable[[], Estimate],
    sentence: str,
    *,
    warns: bool,
) -> Estimate:
    """The estimate, wider where one way and another differ beyond chance, and why."""
    try:
        one, other = one_way(), other_way()
    except (EstimationError, NotIdentifiableError):
        return estimate
    d = difference(one, other)
    if d is None:
        return estimate
    values = other.parameters.values
    shown = ", ".join(f"{n} {v:.3g}" for n, v in zip(NAMES, values, strict=True))
    said = (f"{sentence.format(shown)}; the intervals allow for it",)
    return estimate.widened(d, said) if warns else estimate.widened(d, notes=said)
