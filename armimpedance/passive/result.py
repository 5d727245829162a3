"""What is said of one passive joint, and of several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from armimpedance.errors import InputError
from armimpedance.passive.methods import method_named
from armimpedance.passive.samples import PassiveSamples
from armimpedance.passive.terms import Terms
from armimpedance.regression import Fit, FitSummary, NamedParameter, Validation


@dataclass(frozen=True)
class CrossValidation:
    """A part that was left out of the fit, and how well the rest predicts it."""

    left_out: str
    validation: Validation


@dataclass(frozen=True)
class PassiveFit:
    """The parameters of one passive joint and how far to trust them.

    Attributes
    ----------
    joint : str
    number : int
        Of the joint among those of the analysis, from 1.
    method : str
    terms : Terms
    parameters : tuple of NamedParameter
        k, h, f [, q_r] [, K]: `sd` is the source's (10) (denominator: rows less parameters),
        `sd_robust` and `ci95` are robust.
    torque_fit : Fit
        The torque equations with this joint's parameters: predicts and validates.
    n : int
        Rows of the torque equations.
    cond_raw, cond_scaled : float
        Of the torque equations' W; the source does not say which of the two it prints.
    rank : int
    direct : Validation
        On the rows of the fit, torque in Nm.
    cross : tuple of CrossValidation
        One trial left out at a time; thirds of a single trial.
    friction_share_percent : float
        Root mean square of the friction torque over that of the joint torque.
    cutoff_hz : float or None
    warnings : tuple of str
    """

    joint: str
    number: int
    method: str
    terms: Terms
    parameters: tuple[NamedParameter, ...]
    torque_fit: Fit
    n: int
    cond_raw: float
    cond_scaled: float
    rank: int
    direct: Validation
    cross: tuple[CrossValidation, ...]
    friction_share_percent: float
    cutoff_hz: float | None
    warnings: tuple[str, ...] = ()

    def parameter(self, name: str) -> NamedParameter:
        """The parameter of this name.

        Raises
        ------
        InputError
            It was not fitted.
        """
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        known = ", ".join(p.name for p in self.parameters)
        raise InputError(f"no parameter {name!r}", expected=f"one of {known}")

    @property
    def rms_Nm(self) -> float:
        """Root mean square of the torque that the fit leaves."""
        return float(self.direct.rms[0])

    def validate(self, samples: PassiveSamples) -> Validation:
        """How well the parameters predict the torque of another recording of this joint.

        Raises
        ------
        InputError
            It does not hold this joint.
        """
        one = samples.only(samples.joint(self.joint))
        W, Y = method_named(self.method).equations(one, self.terms).stacked()
        return self.torque_fit.validate(W, Y)

    def summary(self) -> FitSummary:
        """For FIT.json."""
        return summarise([self])


def summarise(fits: Sequence[PassiveFit]) -> FitSummary:
    """One summary of all joints: rows added up, the worst condition, r2 and vaf of all torques.

    Raises
    ------
    InputError
        No joints, or joints fitted by different methods.
    """
    if len({f.method for f in fits}) != 1:
        raise InputError("no joints, or joints of different methods", expected="one method")
    rows = np.array([f.n for f in fits], dtype=float)
    left = rows * [f.rms_Nm**2 for f in fits]
    about_zero = np.array([1 - f.direct.r2 for f in fits])
    about_mean = np.array([1 - f.direct.vaf for f in fits])
    several = len(fits) > 1
    return FitSummary(
        method=fits[0].method,
        n=int(rows.sum()),
        cond_raw=max(f.cond_raw for f in fits),
        cond_scaled=max(f.cond_scaled for f in fits),
        rank=sum(f.rank for f in fits),
        r2=_together(left, about_zero),
        vaf=_together(left, about_mean),
        parameters=tuple(replace(p, joint=f.number) for f in fits for p in f.parameters),
        warnings=tuple(f"{f.joint}: {w}" if several else w for f in fits for w in f.warnings),
    )


def _together(left: np.ndarray, unexplained: np.ndarray) -> float:
    """``1 - sum left / sum whole``, each whole being ``left / unexplained``."""
    if len(left) == 1 or not (unexplained > 0).all():
        return float(1 - unexplained.mean())
    return float(1 - left.sum() / (left / unexplained).sum())
