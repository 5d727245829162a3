"""Result of the fit of one passive joint, or of several."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.joint.relaxed.doubts.checks import TABLE_MASS_SD, mass_finding
from armimpedance.joint.relaxed.equations import (
    PASSIVE_DERIVED,
    PASSIVE_PARAMETERS,
    Equations,
    Terms,
)
from armimpedance.joint.relaxed.methods import METHODS
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.numerics.regression import (
    Fit,
    FitSummary,
    NamedParameter,
    Parameters,
    Validation,
    with_derived,
)
from armimpedance.numerics.signals import EmgLevel
from armimpedance.show.files import FittedResult

#: Meaning of the reported numbers.
_REPORTED: Final = {
    **PASSIVE_PARAMETERS,
    **{name: one.means for name, one in PASSIVE_DERIVED.items()},
}


@dataclass(frozen=True)
class CrossValidation:
    """A part that was left out of the fit, and the quality of its prediction from the rest."""

    left_out: str
    validation: Validation


@dataclass(frozen=True, repr=False)
class PassiveFit(FittedResult, FrozenRecord):
    """Parameters of one passive joint, with the tests of the model.

    Attributes
    ----------
    joint : str
    number : int
        Number of the joint among those of the analysis, from 1.
    method : str
    terms : Terms
    parameters : Parameters
        k, h, f [, q_r] [, K]: `plain_sd` is the source's (10) (denominator: rows less parameters);
        `sd` and the intervals allow for correlated residuals.
    torque_fit : Fit
        The torque equations with this joint's parameters, for prediction and validation. Its
        condition numbers are those of W; the source does not state which of the two it prints.
    direct : Validation
        Validation on the rows of the fit, torque in N m.
    cross : tuple of CrossValidation
        Validation with one trial left out at a time, or a third of a single trial.
    friction_share_percent : float
        Root mean square of the friction torque over that of the joint torque.
    cutoff_hz : float or None
        Cut-off of the samples' filter.
    warnings : tuple of str
        Warnings, including those of `checks`.
    checks : tuple of Finding
        Assumptions that were tested on the data.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.passive import simulate_passive
    >>> markers, _ = simulate_passive("release", trials=1, duration_s=4.0)
    >>> fit = ai.passive(markers, rest_angle=1.5)["right_elbow_flexion"]
    >>> fit.parameters["h"].unit
    'N m s/rad'
    """

    MEANINGS = _REPORTED

    joint: str
    number: int
    method: str
    terms: Terms
    parameters: Parameters
    torque_fit: Fit
    direct: Validation
    cross: tuple[CrossValidation, ...]
    friction_share_percent: float
    cutoff_hz: float | None
    warnings: tuple[str, ...] = ()
    checks: tuple[Finding, ...] = ()

    def doubted(self, *findings: Finding) -> PassiveFit:
        """Return the fit with more checks, and their sentences among its warnings."""
        warnings = (*self.warnings, *warnings_of(findings))
        return replace(self, checks=(*self.checks, *findings), warnings=warnings)

    def with_mass_sd(self, told: float | None) -> PassiveFit:
        """Return the fit with intervals that allow for the uncertainty of the limb's mass.

        Every torque of a free limb is proportional to its mass, and so are the parameters. The
        covariance becomes ``C + s^2 x x^T`` with x the parameters (zero for an angle) and s the sd
        of the mass as a fraction.

        Parameters
        ----------
        told : float or None
            The sd as a fraction; None: not stated, the sd between tables is used.

        Raises
        ------
        InputError
            Not a fraction below a half.
        """
        if told is not None and not 0 <= told < 0.5:
            raise InputError(
                f"a mass known to {100 * told:g} %", expected="0 or more, less than 50 %"
            )
        sd = TABLE_MASS_SD if told is None else told
        own = self.parameters
        x = np.where([name == "q_r" for name in own.names], 0.0, own.values)
        wider = replace(own, covariance=own.covariance + sd**2 * np.outer(x, x))
        return replace(self, parameters=wider).doubted(mass_finding(told))

    @property
    def rms_Nm(self) -> float:
        """Root mean square of the residual torque, N m."""
        return float(self.direct.rms[0])

    @property
    def reported(self) -> Parameters:
        """The parameters, followed by the numbers derived from them."""
        return with_derived(self.parameters, PASSIVE_DERIVED)

    @property
    def named(self) -> tuple[NamedParameter, ...]:
        """The parameters and the derived numbers, each with the joint's number."""
        return tuple(replace(parameter, joint=self.number) for parameter in self.reported)

    @property
    def summary(self) -> FitSummary:
        """Method, size, condition and parameters."""
        return summary_of([self])

    def equations(self, samples: PassiveSamples) -> Equations:
        """Torque equations of this joint by the fit's method, from any samples of it.

        Raises
        ------
        InputError
            The samples do not hold this joint.
        """
        own = samples.only(samples.joint(self.joint))
        return METHODS.named(self.method).equations(own, self.terms)

    def validate(self, samples: PassiveSamples) -> Validation:
        """Quality of the prediction of the torque in another recording of this joint.

        Raises
        ------
        InputError
            The samples do not hold this joint.
        """
        return self.torque_fit.validate(*self.equations(samples).stacked())

    def to_dict(self) -> dict[str, Any]:
        """Plain values: the summary, and the details of the joint."""
        return {**self.summary.to_dict(), "joints": [joint_object(self)]}

    def __repr__(self) -> str:
        number = len(self.warnings)
        more = [counted(number, "warning")] if number else []
        head = f"{self.joint}: {self.method}, R^2 {self.direct.r2:.4f}"
        return "\n".join([head, *map(repr, self.reported), *more])


def _method_of(fits: Sequence[PassiveFit]) -> str:
    if len({f.method for f in fits}) != 1:
        raise InputError("no joints, or joints of different methods", expected="one method")
    return fits[0].method


def _prefixes(fits: Sequence[PassiveFit]) -> list[str]:
    """Prefix of a joint's own sentences: its name, if there are several joints."""
    return [f"{fit.joint}: " if len(fits) > 1 else "" for fit in fits]


def _named(check: Finding, prefix: str) -> Finding:
    return replace(check, message=prefix + check.message)


def summary_of(fits: Sequence[PassiveFit]) -> FitSummary:
    """One summary of all joints: rows added up, the worst condition, r2 and vaf of all torques.

    Raises InputError: no joints, or joints fitted by different methods.
    """
    method = _method_of(fits)
    torques = [f.torque_fit for f in fits]
    rows = np.array([item.n_rows for item in torques], dtype=float)
    squares = rows * [f.rms_Nm**2 for f in fits]
    about_zero, about_mean = np.array([(1 - f.direct.r2, 1 - f.direct.vaf) for f in fits]).T
    of = list(zip(_prefixes(fits), fits, strict=True))
    return FitSummary(
        method=method,
        n=int(rows.sum()),
        cond_raw=max(item.cond_raw for item in torques),
        cond_scaled=max(item.cond_scaled for item in torques),
        rank=sum(item.rank for item in torques),
        r2=_together(squares, about_zero),
        vaf=_together(squares, about_mean),
        parameters=tuple(item for f in fits for item in f.named),
        warnings=tuple(name + w for name, f in of for w in f.warnings),
        checks=tuple(_named(item, name) for name, f in of for item in f.checks),
    )


def counted(number: int, what: str) -> str:
    """Number and noun, in the plural unless the number is one."""
    return f"{number} {what}" + ("" if number == 1 else "s")


def _together(residual: np.ndarray, unexplained: np.ndarray) -> float:
    """Pool ``1 - sum residual / sum whole``, each whole being ``residual / unexplained``."""
    if len(residual) == 1 or not (unexplained > 0).all():
        return float(1 - unexplained.mean())
    return float(1 - residual.sum() / (residual / unexplained).sum())


def joint_object(fit: PassiveFit) -> dict[str, Any]:
    """Fields of a joint in FIT.json besides its parameters."""
    return {
        "joint": fit.number,
        "name": fit.joint,
        "n": fit.torque_fit.n_rows,
        "cond_raw": fit.torque_fit.cond_raw,
        "cond_scaled": fit.torque_fit.cond_scaled,
        "rest_angle": fit.terms.rest_angle,
        "cutoff_hz": fit.cutoff_hz,
        "friction_share_percent": fit.friction_share_percent,
        "direct_validation": quality_object(fit.direct),
        "cross_validation": [
            {"left_out": c.left_out, **quality_object(c.validation)} for c in fit.cross
        ],
        "warnings": list(fit.warnings),
    }


def quality_object(validation: Validation) -> dict[str, float]:
    """Fields of a validation in FIT.json."""
    return {"rms_Nm": float(validation.rms[0]), "r2": validation.r2, "vaf": validation.vaf}


# Result for several passive joints of one recording.

#: Largest number of joints in a short text.
_MOST_SHOWN: Final = 8


@dataclass(frozen=True, repr=False, eq=False)
class PassiveFits(FittedResult, FrozenRecord, Sequence[PassiveFit]):
    """Fits of several joints of one recording: a sequence, also indexed by a joint's name.

    Attributes
    ----------
    fits : tuple of PassiveFit
    samples : PassiveSamples
        Samples to which the models were fitted.
    notes : tuple of str
        Notes on the recording for a reader of the result.
    emg : EmgLevel or None
        Activity of the muscles; None if it is not known.
    validations : tuple of Validation
        Quality of the prediction of each joint's torque in another recording; else empty.
    validated_on : str
        Name of that recording.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.passive import simulate_passive
    >>> markers, _ = simulate_passive("release", trials=1, duration_s=4.0)
    >>> fits = ai.passive(markers, rest_angle=1.5)
    >>> len(fits)
    1
    """

    MEANINGS = _REPORTED

    fits: tuple[PassiveFit, ...]
    samples: PassiveSamples
    notes: tuple[str, ...] = ()
    emg: EmgLevel | None = None
    validations: tuple[Validation, ...] = ()
    validated_on: str = ""

    def __len__(self) -> int:
        return len(self.fits)

    def __iter__(self) -> Iterator[PassiveFit]:
        return iter(self.fits)

    def __getitem__(self, which: Any) -> Any:
        """Fit by its number from 0 or its joint's name; a slice gives a tuple.

        Raises InputError: no joint of this name was fitted.
        """
        return self.fits[self.samples.joint(which) if isinstance(which, str) else which]

    @property
    def summary(self) -> FitSummary:
        """One summary of all joints."""
        return summary_of(self.fits)

    def each(self, change: Callable[[PassiveFit], PassiveFit]) -> PassiveFits:
        """Apply a function to every joint's fit."""
        return replace(self, fits=tuple(change(fit) for fit in self.fits))

    def predicting(self, samples: PassiveSamples, name: str) -> PassiveFits:
        """Return the fits with the validation on another recording of these joints.

        Raises
        ------
        InputError
            The samples do not hold one of the joints.
        """
        validations = tuple(fit.validate(samples) for fit in self.fits)
        return replace(self, validations=validations, validated_on=name)

    def to_dict(self) -> dict[str, Any]:
        """Content of FIT.json."""
        content = self.summary.to_dict()
        content["joints"] = [joint_object(fit) for fit in self.fits]
        content["emg"] = None if self.emg is None else self.emg.to_dict()
        if self.validations:
            judged = zip(self.fits, self.validations, strict=True)
            joints = [{"joint": fit.joint, **quality_object(v)} for fit, v in judged]
            content["validated_on"] = {"recording": self.validated_on, "joints": joints}
        return content

    def __repr__(self) -> str:
        lines = []
        for fit in self.fits[:_MOST_SHOWN]:
            shown = ", ".join(f"{p.name} {p.value:.4g} {p.unit}" for p in fit.reported)
            lines.append(f"{fit.joint}: {shown}; R^2 {fit.direct.r2:.4f}")
        further, number = len(self) - len(lines), sum(len(fit.warnings) for fit in self.fits)
        more = [f"... and {further} more"] if further else []
        more += [counted(number, "warning")] if number else []
        head = f"{self.fits[0].method}, {counted(len(self), 'passive joint')}"
        return "\n".join([head, *lines, *more])
