"""Compare two estimates of the same record: if they differ by more than chance, one is biased.

Both come from the same blocks of the same record, so most of their errors are common. The influence
of every block on each estimate is known; the differences of these influences give the covariance of
the difference (J. A. Hausman, Econometrica 46, 1978, with blocks for the variance). Two pairs are
compared:

- Output error against instruments from the device's perturbation or command. The device reacts to
  the subject's push, so this push is part of the measured torque, and output error treats it as a
  cause of the motion. Output error does not use the perturbation or command itself: it would then
  equal the instruments.
- Weights from the residual against weights from the sensors' noise or, if the angle is imposed,
  against a torque with white noise, since the subject's own torque is then noise of the torque. A
  joint of second order gives the same under both; one whose stiffness depends on the frequency does
  not. A restless subject also gives a difference by chance, more often than the blocks predict.
  The result is therefore a note and an interval that covers both; the tests in `doubts` name the
  cause if they detect one.
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

#: Significance level of a difference in I, B or K.
CHANCE: Final = 0.01
#: Relative differences below this do not matter, however significant.
SMALL: Final = 0.01


def difference(first: Estimate, second: Estimate) -> FloatArray | None:
    """Difference ``first - second`` of I, B, K (3,); None if it is not significant."""
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
    """Return the estimate, with a sentence and a wider interval if another method differs.

    `estimate`: of `method` with the weights of `band`.
    `floors`, `band`: with weights from the sensors' noise only, and as used in the fit.
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
        # arx has no weights: the comparison of its reference method is used.
        weighted = METHODS["iv"] if method.name == "arx" else method
        imposed = band.source == "angle"
        by = "white noise" if imposed else "the sensors' noise"
        alternative = _white(band) if imposed else floors
        estimate = _compared(
            estimate,
            lambda: estimate if weighted is method else weighted.identify(prepared, band),
            lambda: weighted.identify(prepared, alternative),
            f"weighed by {by} alone "
            "the record gives {}: a stiffness that depends on "
            "the frequency (a reflex), or the subject's answer in the torque; compare bands "
            "(lowest and cut-off frequency)",
            warns=False,
        )
    return estimate


def _white(band: Band) -> Band:
    """Return the band with white torque noise of the same mean power."""
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
    """Return the estimate, widened if the two ways differ significantly, with the sentence."""
    try:
        first, second = one_way(), other_way()
    except (EstimationError, NotIdentifiableError):
        return estimate
    d = difference(first, second)
    if d is None:
        return estimate
    values = second.parameters.values
    shown = ", ".join(f"{n} {v:.3g}" for n, v in zip(NAMES, values, strict=True))
    sentences = (f"{sentence.format(shown)}; the intervals allow for it",)
    return estimate.widened(d, sentences) if warns else estimate.widened(d, notes=sentences)
