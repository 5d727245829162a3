"""K, B or torque as a linear law of EMG amplitudes: coefficients, predictions, intervals."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, IntArray
from armimpedance.core.described import Meaning
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.joint.elbow.elbow_result import ElbowFit
from armimpedance.joint.elbow.emg.curvature import Bend
from armimpedance.numerics.regression import FitSummary, Parameters, t_interval
from armimpedance.show.files import FittedResult

if TYPE_CHECKING:
    import pandas as pd

#: Symbol of a law -> letter of its coefficients, and the quantity that it predicts.
LAWS: Final = {
    "K": ("k", Meaning("stiffness", "N m/rad")),
    "B": ("b", Meaning("viscosity", "N m s/rad")),
    "torque": ("a", Meaning("torque", "N m")),
}
#: A prediction is an extrapolation beyond the measured amplitudes by this share of their range.
_BEYOND: Final = 0.05


@dataclass(frozen=True, eq=False)
class LawPrediction(FrozenRecord):
    """Prediction of a law at P amplitudes.

    `value`, `sd` (P,): value of the law and its standard error; single points scatter about it with
    sd `LinearLaw.scatter` in addition.
    `dof`: degrees of freedom of the t distribution.
    `outside` (P,) bool: True beyond the amplitudes that the law was fitted to.
    """

    value: Annotated[FloatArray, "p"]
    sd: Annotated[FloatArray, "p"]
    dof: float
    outside: Annotated[BoolArray, "p"]

    def interval(self, level: float = 0.95) -> FloatArray:
        """Confidence limits, (P, 2)."""
        return t_interval(self.value, self.sd, self.dof, level)


@dataclass(frozen=True, repr=False, eq=False)
class LinearLaw(FrozenRecord):
    """Law ``y = c_0 + sum_i c_i s_i`` over m amplitudes, fitted to L points.

    Attributes
    ----------
    symbol : str
        "K", "B" or "torque".
    muscles : tuple of m str
    parameters : Parameters
        The coefficients ``k0, k_<muscle>, ...`` (m + 1,), errors of the amplitudes accounted for;
        the plain covariance is that of least squares. Their intervals allow for a bend of the law
        that the points do not exclude, and for crosstalk that the amplitudes do not show.
    covariance : (m + 1, m + 1)
        Covariance of the straight law over these channels, without bend and crosstalk.
    bend : Bend
        Test of straightness, and the effect of a bend.
    naive : (m + 1,)
        Coefficients by plain (weighted) least squares.
    scatter : float
        Standard deviation of points about the law beyond their stated errors.
    r2 : float
        Share of the points' weighted variance that the law explains.
    cond_raw, cond_scaled : float
        Condition numbers of the columns [1, s], and of s about its means with unit lengths.
    reliability : float
        Share of the least certain combination of amplitudes that errors do not explain.
    lowest, highest : (m,)
        Range of the measured amplitudes.
    n : int
        Number of points L.
    warnings : tuple of str
    """

    symbol: str
    muscles: Annotated[tuple[str, ...], "m"]
    parameters: Parameters
    covariance: Annotated[FloatArray, "m+1 m+1"]
    bend: Bend
    naive: Annotated[FloatArray, "m+1"]
    scatter: float
    r2: float
    cond_raw: float
    cond_scaled: float
    reliability: float
    lowest: Annotated[FloatArray, "m"]
    highest: Annotated[FloatArray, "m"]
    n: int
    warnings: tuple[str, ...] = ()

    @property
    def checks(self) -> tuple[Finding, ...]:
        """Finding on whether the law is straight."""
        return (self.bend.finding,)

    @property
    def unit(self) -> str:
        """Unit of the predicted quantity and of all coefficients; amplitudes have no unit."""
        return LAWS[self.symbol][1].unit

    @property
    def slopes(self) -> FloatArray:
        """Coefficients of the muscles, (m,)."""
        return self.parameters.values[1:]

    @property
    def attenuation(self) -> FloatArray:
        """Ratio ``naive / corrected`` (m + 1,): the bias due to errors of the amplitudes."""
        own = self.parameters.values
        return np.divide(self.naive, own, out=np.ones_like(self.naive), where=own != 0)

    def predict(self, amplitude: ArrayLike, amplitude_sd: ArrayLike = 0.0) -> LawPrediction:
        """Evaluate the law at amplitudes (P, m); `amplitude_sd`: their standard errors, if known.

        Raises
        ------
        InputError
            The number of amplitudes differs from that of the muscles.
        """
        s = np.atleast_2d(np.asarray(amplitude, dtype=np.float64))
        m = len(self.muscles)
        if s.ndim != 2 or s.shape[1] != m:
            raise InputError(f"amplitudes of shape {s.shape}", expected=f"(points, {m})")
        errors = np.broadcast_to(np.asarray(amplitude_sd, dtype=np.float64), s.shape)
        W = constant_and(s)
        variance = np.einsum("pi,ij,pj->p", W, self.covariance, W) + self.bend.of_prediction(s)
        variance += ((errors * self.slopes) ** 2).sum(axis=1)
        slack = _BEYOND * (self.highest - self.lowest)
        beyond = (s < self.lowest - slack) | (s > self.highest + slack)
        value, dof = W @ self.parameters.values, self.parameters.dof
        return LawPrediction(value, np.sqrt(variance), dof, np.asarray(beyond.any(axis=1)))

    def widened_to(self, other: LinearLaw) -> LinearLaw:
        """Return the law with intervals widened by the distance to another's coefficients."""
        shift = other.parameters.values - self.parameters.values
        wider = self.parameters.covariance + np.outer(shift, shift)
        return replace(self, parameters=replace(self.parameters, covariance=wider))

    def with_crosstalk(self, sd: float) -> LinearLaw:
        """Return the law with intervals that allow for crosstalk between any two channels.

        `sd`: prior sd of the share of another muscle's amplitude in a channel.
        """
        k = self.slopes
        # s_seen = A s, A = 1 + C: k (m,) = A^T k_seen, c_ij ~ N(0, sd^2) off the diagonal
        wider = np.diag([0.0, *sd**2 * ((k**2).sum() - k**2)])
        covariance = self.parameters.covariance + wider
        return replace(self, parameters=replace(self.parameters, covariance=covariance))

    def to_frame(self) -> pd.DataFrame:
        """One row per coefficient: value, standard error, 95 % limits, unit, least squares."""
        return self.parameters.to_frame().assign(least_squares=self.naive)

    def to_dict(self) -> dict[str, Any]:
        """Fields of the law in FIT.json besides its coefficients."""
        return {
            "symbol": self.symbol,
            "least_squares": self.naive,
            "attenuation": self.attenuation,
            "scatter": self.scatter,
            "r2": self.r2,
            "reliability": self.reliability,
            "covariance": self.covariance,
            "amplitudes": {"lowest": self.lowest, "highest": self.highest},
        }

    def __repr__(self) -> str:
        return f"{self.symbol} over EMG, {self.n} points, R^2 {self.r2:.3f}\n{self.parameters!r}"

    def _repr_html_(self) -> str:
        return self.parameters._repr_html_()


@dataclass(frozen=True, eq=False)
class OperatingPoints(FrozenRecord):
    """I, B, K and EMG amplitudes of L trials, from which a law is fitted.

    `trials` (L,) int.
    `amplitude` (L, m): shares of the maximum contraction.
    `K`, `sd_K`, `B`, `sd_B` (L,): stiffness (N m/rad) and viscosity (N m s/rad) with their standard
    errors.
    `imcj`, `sd_imcj` (L,) or None: index of co-contraction, N m, and its standard error, if it
    was calibrated.
    """

    trials: Annotated[IntArray, "l"]
    muscles: Annotated[tuple[str, ...], "m"]
    amplitude: Annotated[FloatArray, "l m"]
    K: Annotated[FloatArray, "l"]
    sd_K: Annotated[FloatArray, "l"]
    B: Annotated[FloatArray, "l"]
    sd_B: Annotated[FloatArray, "l"]
    imcj: Annotated[FloatArray, "l"] | None = None
    sd_imcj: Annotated[FloatArray, "l"] | None = None

    @classmethod
    def of(
        cls,
        fits: Iterable[ElbowFit],
        trials: IntArray,
        muscles: tuple[str, ...],
        amplitude: FloatArray,
    ) -> OperatingPoints:
        """Points from one fit per trial, with their robust standard errors."""
        values = [(p.value, p.sd_robust) for fit in fits for p in (fit["K"], fit["B"])]
        # columns K, sd_K, B, sd_B
        columns = np.array(values).reshape(-1, 4).T
        return cls(trials, muscles, amplitude, *columns)

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping per trial, as in FIT.json."""
        names = {"K": self.K, "sd_K": self.sd_K, "B": self.B, "sd_B": self.sd_B}
        if self.imcj is not None and self.sd_imcj is not None:
            names |= {"imcj_Nm": self.imcj, "sd_imcj_Nm": self.sd_imcj}
        return [
            {
                "trial": int(trial),
                "amplitude": dict(zip(self.muscles, self.amplitude[row].tolist(), strict=True)),
                **{name: float(column[row]) for name, column in names.items()},
            }
            for row, trial in enumerate(self.trials)
        ]

    def to_frame(self) -> pd.DataFrame:
        """One row per trial; the amplitudes in columns ``amplitude_<muscle>``."""
        import pandas as pd

        rows = [
            {
                "trial": row.pop("trial"),
                **{f"amplitude_{name}": value for name, value in row.pop("amplitude").items()},
                **row,
            }
            for row in self.to_dict()
        ]
        return pd.DataFrame(rows)


@dataclass(frozen=True, repr=False, eq=False)
class EmgLaw(FittedResult, FrozenRecord):
    """The law of K and, if B was measured, that of B.

    Attributes
    ----------
    stiffness : LinearLaw
    viscosity : LinearLaw or None
    points : OperatingPoints or None
        Points that the laws were fitted to, if they come from a recording.
    notes : tuple of str
        Processing of the amplitudes, and trials that were left out.
    of_trials : tuple of Finding
        Findings on the trials: size of the inertia, crosstalk between the electrodes, and the
        muscles' names against the direction of their torque.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.elbow import simulate_elbow
    >>> session, _ = simulate_elbow("cocontraction", repetitions=1, duration_s=6.0)
    >>> law = ai.emg_law(session)
    >>> law.viscosity.parameters.names
    ('b0', 'b_biceps', 'b_triceps')
    """

    MEANINGS = {
        name: Meaning(f"{means.words} {what}", means.unit)
        for letter, means in LAWS.values()
        for name, what in (
            (f"{letter}0", "without muscle activity"),
            (f"{letter}_{{}}", "per amplitude of {}"),
        )
    }

    stiffness: LinearLaw
    viscosity: LinearLaw | None = None
    points: OperatingPoints | None = None
    notes: tuple[str, ...] = ()
    of_trials: tuple[Finding, ...] = ()

    @property
    def laws(self) -> tuple[LinearLaw, ...]:
        """The law of K, then that of B."""
        return tuple(law for law in (self.stiffness, self.viscosity) if law is not None)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of both laws."""
        own = (w for law in self.laws for w in law.warnings)
        return tuple(dict.fromkeys((*own, *warnings_of(self.checks))))

    def widened_to(self, other: EmgLaw) -> EmgLaw:
        """Return the laws with intervals widened by the distance to another's coefficients."""
        K = self.stiffness.widened_to(other.stiffness)
        if self.viscosity is None or other.viscosity is None:
            return replace(self, stiffness=K)
        return replace(self, stiffness=K, viscosity=self.viscosity.widened_to(other.viscosity))

    def with_crosstalk(self, sd: float) -> EmgLaw:
        """Return the laws with intervals that allow for crosstalk that the amplitudes do not
        show."""
        if sd == 0:
            return self
        B = self.viscosity
        text = (
            f"amplitudes do not show it: the intervals of single muscles allow for {100 * sd:g} % "
            "(sd) of the other muscle in each channel; what the law predicts for the same "
            "electrodes does not depend on it; record raw EMG"
        )
        return replace(
            self,
            stiffness=self.stiffness.with_crosstalk(sd),
            viscosity=None if B is None else B.with_crosstalk(sd),
            of_trials=(Finding("crosstalk", "cannot tell", text), *self.of_trials),
        )

    @property
    def checks(self) -> tuple[Finding, ...]:
        """Findings on the trials and their electrodes, then on whether each law is straight."""
        return (*self.of_trials, *(check for law in self.laws for check in law.checks))

    @property
    def summary(self) -> FitSummary:
        """Fields of every fit in FIT.json: ``k0, k_<flexor>, k_<extensor>``, then those of B."""
        law = self.stiffness
        return FitSummary(
            method="emg-law",
            n=law.n,
            cond_raw=law.cond_raw,
            cond_scaled=law.cond_scaled,
            rank=len(law.parameters),
            r2=law.r2,
            vaf=law.r2,
            parameters=tuple(p for each_law in self.laws for p in each_law.parameters),
            warnings=self.warnings,
            checks=self.checks,
        )

    def to_dict(self) -> dict[str, Any]:
        """Fields of FIT.json: those of every fit, both laws, their points, notes."""
        return {
            **self.summary.to_dict(),
            "laws": [law.to_dict() for law in self.laws],
            "points": [] if self.points is None else self.points.to_dict(),
            "notes": list(self.notes),
        }

    def __repr__(self) -> str:
        return repr(self.summary)


def constant_and(amplitude: FloatArray) -> FloatArray:
    """Regressors W (L, m + 1): a constant and the amplitudes (L, m)."""
    return np.column_stack([np.ones(len(amplitude)), amplitude])
