"""What an identification of a body says."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armimpedance.arrays import BoolArray, FloatArray, frozen_array
from armimpedance.body.angle_noise import NoiseShift
from armimpedance.body.base_parameters import BaseParameters
from armimpedance.body.exciting import MotionChoice
from armimpedance.body.validation import BodyValidation
from armimpedance.regression import FitSummary, NamedParameter


@dataclass(frozen=True)
class BodyFit:
    """Identified base parameters, and how far to trust them.

    Attributes
    ----------
    method : {"least_squares", "weighted", "consistent", "prior"}
    base : BaseParameters
        Names, units, texts and the map from all parameters.
    values : (b,)
        SI.
    covariance : (b, b)
        Classical: independent residuals (with a prior: of data and prior together).
    covariance_robust : (b, b)
        Clustered by blocks of time; with a prior the curvature's, inflated.
    dof : float
        Of the t distribution for intervals of `covariance_robust`.
    phi : (p,) or None
        All parameters, ten per segment and the joint terms; None for least squares, which cannot
        tell them apart.
    phi_sd : (p,) or None
        With a prior only.
    cond_raw, cond_scaled : float
        Of the base regressor of the motions that were fitted, rows as weighted.
    n_rows : int
    r2, vaf : float
        Of the weighted rows that were fitted, about zero and about each row's mean.
    choice : MotionChoice
        Which motions were fitted, and the conditions on the way.
    fitted, held_out : BodyValidation
        Direct and cross-validation; `held_out` is None if all motions were fitted.
    inflation : float
        Median ratio of robust to classical variance.
    noise : NoiseShift or None
        What noise of the coordinates had done to the values, which was taken off them.
    warnings : tuple of str
    """

    method: str
    base: BaseParameters
    values: FloatArray
    covariance: FloatArray
    covariance_robust: FloatArray
    dof: float
    phi: FloatArray | None
    phi_sd: FloatArray | None
    cond_raw: float
    cond_scaled: float
    n_rows: int
    r2: float
    vaf: float
    choice: MotionChoice
    fitted: BodyValidation
    held_out: BodyValidation | None
    inflation: float
    noise: NoiseShift | None = None
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put, b = object.__setattr__, self.base.rank
        put(self, "values", frozen_array(self.values, "values", (b,)))
        for name in ("covariance", "covariance_robust"):
            put(self, name, frozen_array(getattr(self, name), name, (b, b)))

    @property
    def sd(self) -> FloatArray:
        """Classical standard errors (b,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def sd_robust(self) -> FloatArray:
        """Robust standard errors (b,)."""
        return np.sqrt(np.diag(self.covariance_robust))

    @property
    def relative_sd_percent(self) -> FloatArray:
        """``100 sd_robust / |value|`` (b,); inf at zero."""
        size = np.abs(self.values)
        return np.where(size > 0, 100 * self.sd_robust / np.where(size > 0, size, 1.0), np.inf)

    @property
    def well_identified(self) -> BoolArray:
        """Whether twice the relative robust standard error stays below 10 %, (b,)."""
        return np.asarray(2 * self.relative_sd_percent < 10)

    def summary(self) -> FitSummary:
        """For FIT.json: parameters named after their leading symbol."""
        rows = zip(
            self.base.names, self.base.units, self.values, self.sd, self.sd_robust, strict=True
        )
        parameters = tuple(
            NamedParameter(name, float(value), float(sd), float(robust), unit, self.dof)
            for name, unit, value, sd, robust in rows
        )
        return FitSummary(
            method=f"body_{self.method}",
            n=self.n_rows,
            cond_raw=self.cond_raw,
            cond_scaled=self.cond_scaled,
            rank=self.base.rank,
            r2=self.r2,
            vaf=self.vaf,
            parameters=parameters,
            warnings=self.warnings,
        )

    def lines(self) -> tuple[str, ...]:
        """What a person reads first, a line each."""
        conditions = " -> ".join(f"{c:.3g}" for c in self.choice.conditions)
        found = [
            f"{self.base.rank} base parameters, {self.method.replace('_', ' ')}, "
            f"{int(self.well_identified.sum())} of them within 10 %",
            f"fitted: {_named(self.choice.motions)} (scaled condition {conditions})",
            f"fitted motions: {_residuals(self.fitted)}",
        ]
        if self.held_out is not None:
            found.append(f"held-out motions: {_residuals(self.held_out)}")
            found += [f"  {line}" for line in _by_motion(self.held_out)]
        if self.noise is not None:
            moved = int((np.abs(self.noise.shift) > self.sd_robust).sum())
            found.append(
                f"noise of the angles, {1e3 * self.noise.level:.2g} mrad: its bias was taken off, "
                f"more than a standard error for {moved} parameters"
            )
        if self.inflation > 2:
            found.append(
                "residuals are correlated: robust standard errors are "
                f"{np.sqrt(self.inflation):.1f} times the classical ones"
            )
        return tuple(found + [f"warning: {w}" for w in self.warnings])


def _named(motions: Sequence[str]) -> str:
    """The motions, each once with the number of its trials where there are several."""
    counts = Counter(motions).items()
    return ", ".join(name if n == 1 else f"{name} ({n} trials)" for name, n in counts)


def _residuals(validation: BodyValidation) -> str:
    parts = []
    for what, rows, unit in (
        ("forces", validation.forces, "N"),
        ("moments", validation.moments, "Nm"),
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
        f"{motion}: moments {value:.3g} Nm rms"
        for motion, value in zip(validation.motions, rms, strict=True)
    ]
