"""Result of an identification of a body."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord
from armimpedance.core.described import Meaning
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body.angle_noise import NoiseShift
from armimpedance.joint.body.base_parameters import BaseParameters, MotionChoice
from armimpedance.joint.body.equations import BodyValidation
from armimpedance.joint.body.methods import METHODS
from armimpedance.joint.body.regressor import (
    INERTIAL,
    TERMS,
    segment_parameters,
    with_inertial_parameters,
)
from armimpedance.joint.body.rows import RowChoice
from armimpedance.numerics.regression import Fit, FitSummary, Parameters
from armimpedance.show.files import FittedResult

if TYPE_CHECKING:
    import pandas as pd

#: Meanings of the base parameters (sums named after their leading term) and of joint terms.
_BASE_PARAMETERS: Final = {
    **{
        f"{name}_{{}}": Meaning(f"base parameter of {{}}: {means.words}", means.unit)
        for name, means in INERTIAL.items()
    },
    **{
        f"{name}_{{}}": Meaning(f"{means.words} of {{}}", means.unit)
        for name, means in TERMS.values()
    },
}
#: Largest number of lines and parameters in a short text.
_MOST_LINES: Final = 10


@dataclass(frozen=True, repr=False, eq=False)
class BodyFit(FittedResult, FrozenRecord):
    """Identified base parameters, with the tests of the model.

    Attributes
    ----------
    method : {"weighted", "consistent", "ls", "prior"}
    base : BaseParameters
        Names, units, texts and the mapping from all parameters.
    parameters : Parameters
        The b base values and their covariances. Intervals use the robust covariance, clustered by
        blocks of time; the plain one is for independent residuals. With a prior both come from
        data and prior together.
    phi : (p,) or None
        All parameters, ten per segment and the joint terms; None for least squares, which cannot
        separate them.
    phi_sd : (p,) or None
        Standard errors of phi, with a prior only.
    least : Fit
        Least-squares fit of the fitted motions with weighted rows: its condition, rows and R^2.
    vaf : float
        Variance accounted for in the weighted, fitted rows, about each row's mean in each motion.
    recording : MotionRecording
        The joint motion that was fitted.
    rows : RowChoice
        Its rows and columns, and the filter.
    choice : MotionChoice
        The fitted motions, and the conditions during the choice.
    fitted, held_out : BodyValidation
        Direct and cross-validation; `held_out` is None if all motions were fitted.
    inflation : float
        Median ratio of robust to classical variance.
    noise : NoiseShift or None
        Bias of the values from noise of the coordinates, which was removed.
    notes : tuple of str
        Notes on the recording for a reader of the result.
    warnings : tuple of str
    checks : tuple of Finding
        Tests of the method's assumptions.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.body import simulate_body
    >>> recording, _ = simulate_body(("all_joints",))
    >>> ai.body(recording, method="ls", noise_draws=0).base.rank
    128
    """

    MEANINGS = _BASE_PARAMETERS

    method: str
    base: BaseParameters
    parameters: Parameters
    phi: Annotated[FloatArray, "p"] | None
    phi_sd: Annotated[FloatArray, "p"] | None
    least: Fit
    vaf: float
    recording: MotionRecording
    rows: RowChoice
    choice: MotionChoice
    fitted: BodyValidation
    held_out: BodyValidation | None
    inflation: float
    noise: NoiseShift | None = None
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    checks: tuple[Finding, ...] = ()

    @property
    def relative_sd_percent(self) -> FloatArray:
        """Relative robust standard errors ``100 sd / |value|`` (b,); inf at zero."""
        size, sd = np.abs(self.parameters.values), self.parameters.sd
        return np.where(size > 0, 100 * sd / np.where(size > 0, size, 1.0), np.inf)

    @property
    def well_identified(self) -> BoolArray:
        """Mask (b,): True if twice the relative robust standard error is below 10 %."""
        return np.asarray(2 * self.relative_sd_percent < 10)

    @property
    def summary(self) -> FitSummary:
        """Method, size, condition and parameters, named after their leading symbol."""
        return FitSummary(
            method=f"body_{METHODS[self.method].label}",
            n=self.least.n_rows,
            cond_raw=self.least.cond_raw,
            cond_scaled=self.least.cond_scaled,
            rank=self.base.rank,
            r2=self.least.r2,
            vaf=self.vaf,
            parameters=tuple(self.parameters),
            warnings=self.warnings,
            checks=self.checks,
        )

    @property
    def predicting_phi(self) -> FloatArray:
        """Parameters (p,) for predictions: `phi`, or any that agree with the base parameters."""
        return self.base.lift(self.parameters.values) if self.phi is None else self.phi

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton with the identified masses, centres and inertias.

        Raises
        ------
        InputError
            The method does not separate the segments' own parameters.
        """
        if self.phi is None:
            raise InputError(
                f"method {self.method!r} finds sums of segments' parameters only",
                expected="method 'consistent' or 'prior'",
            )
        return with_inertial_parameters(self.recording.skeleton, self.phi)

    def to_frame(self) -> pd.DataFrame:
        """One row per base parameter: value, standard error, 95 % limits, unit, expression."""
        return self.parameters.to_frame().assign(expression=list(self.base.expressions))

    def to_dict(self) -> dict[str, Any]:
        """Content of FIT.json: summary, expressions, motions, validation, segments."""
        names = self.base.names
        content = {
            **self.summary.to_dict(),
            "expressions": dict(zip(names, self.base.expressions, strict=True)),
            "motions_fitted": list(self.choice.motions),
            "condition_after_each": list(self.choice.conditions),
            "condition_alone": self.choice.alone.tolist(),
            "direct_validation": self.fitted.to_list(),
            "cross_validation": None if self.held_out is None else self.held_out.to_list(),
        }
        if self.noise is not None:
            shift = dict(zip(names, self.noise.shift.tolist(), strict=True))
            content["angle_noise"] = {"level_rad": self.noise.level, "bias_taken_off": shift}
        if self.phi is not None:
            content["segments"] = segment_parameters(self.recording.skeleton, self.phi)
        return content

    @property
    def lines(self) -> tuple[str, ...]:
        """The most important results, as lines of text."""
        conditions = " -> ".join(f"{c:.3g}" for c in self.choice.conditions)
        sentences = [
            f"{self.base.rank} base parameters, {METHODS[self.method].label.replace('_', ' ')}, "
            f"{int(self.well_identified.sum())} of them within 10 %",
            f"fitted: {_named(self.choice.motions)} (scaled condition {conditions})",
            f"fitted motions: {_residuals(self.fitted)}",
        ]
        if self.held_out is not None:
            sentences.append(f"held-out motions: {_residuals(self.held_out)}")
            sentences += [f"  {line}" for line in _by_motion(self.held_out)]
        if self.noise is not None:
            moved = int((np.abs(self.noise.shift) > self.parameters.sd).sum())
            sentences.append(
                f"noise of the angles, {1e3 * self.noise.level:.2g} mrad: its bias was taken off, "
                f"more than a standard error for {moved} parameters"
            )
        if self.inflation > 2:
            sentences.append(
                "residuals are correlated: robust standard errors are "
                f"{np.sqrt(self.inflation):.1f} times the classical ones"
            )
        return tuple(sentences + [f"warning: {w}" for w in self.warnings])

    def __repr__(self) -> str:
        short = [line for line in self.lines if not line.startswith("  ")]
        number = len(short) - _MOST_LINES
        more = [f"... and {number} more lines"] if number > 0 else []
        return "\n".join([*short[:_MOST_LINES], *more])

    def _repr_html_(self) -> str:
        items = [line for line in self.lines if not line.startswith("warning: ")]
        order = np.argsort(self.relative_sd_percent)[:_MOST_LINES]
        best = replace(self.summary, parameters=tuple(self.parameters[int(i)] for i in order))
        return (
            f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in items)}</ul>{best._repr_html_()}"
        )


def _named(motions: Sequence[str]) -> str:
    """Names of the motions, each once, with the number of its trials if there are several."""
    counts = Counter(motions).items()
    return ", ".join(name if n == 1 else f"{name} ({n} trials)" for name, n in counts)


def _residuals(validation: BodyValidation) -> str:
    parts = []
    for what, rows, unit in (
        ("forces", validation.forces, "N"),
        ("moments", validation.moments, "N m"),
    ):
        if rows:
            rms, r2 = validation.pooled_rms(rows), validation.pooled_r2(rows)
            shown = f", R^2 {r2:.3f}" if np.isfinite(r2) else ""
            parts.append(f"{what} {rms:.3g} {unit} rms{shown}")
    return "; ".join(parts)


def _by_motion(validation: BodyValidation) -> Sequence[str]:
    moments = [validation.rows.index(row) for row in validation.moments]
    squares = validation.rms[:, moments] ** 2
    rms = np.sqrt(squares.mean(axis=1))
    return [
        f"{motion}: moments {value:.3g} N m rms"
        for motion, value in zip(validation.motions, rms, strict=True)
    ]
