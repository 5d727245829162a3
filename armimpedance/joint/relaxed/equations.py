"""The sampled equations ``Y = W X + rho`` of one joint (Venture elbow, eq. (8))."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen_array
from armimpedance.core.described import Meaning
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.numerics.regression import (
    CovarianceKind,
    Derived,
    Fit,
    Parameters,
    fit,
    ragged_factors,
)
from armimpedance.numerics.signals import filtered_sign

# The terms of a passive joint's torque, and k, h, f, q_r, K from the fitted columns.
#
# Venture elbow, eqs. (3)-(6): ``k (q - q_r) + h qd + f sign(qd)``; with the poster's quadratic term
# ``+ K (q - q_r)^2``. With a free rest angle the columns are q, qd, sign(qd), 1 [, q^2], and their
# parameters are ``b = k - 2 K q_r`` and ``c = K q_r^2 - k q_r`` in place of k and q_r.

RestAngle = float | Literal["free"]

#: Meaning of the parameters.
PASSIVE_PARAMETERS: Final = {
    "k": Meaning("stiffness", "N m/rad"),
    "h": Meaning("viscosity", "N m s/rad"),
    "f": Meaning("dry friction", "N m"),
    "q_r": Meaning("rest angle", "rad"),
    "K": Meaning("quadratic stiffness", "N m/rad^2"),
    "C": Meaning("cubic stiffness", "N m/rad^3"),
}
#: Numbers derived from them, one per line: ``"tau": Derived(Meaning(...), lambda p: ...)``.
PASSIVE_DERIVED: Final[Mapping[str, Derived]] = {}
UNITS: Final = {name: means.unit for name, means in PASSIVE_PARAMETERS.items()}


@dataclass(frozen=True)
class Terms:
    """Selection of the fitted terms.

    `rest_angle`: q_r in rad if it is known, else "free".
    `quadratic`: True to fit ``K (q - q_r)^2`` too.
    `friction`: True to fit ``f sign(qd)``; False: the joint is known to have no dry friction.
    `cubic`: True to fit ``C (q - q_r)^3`` too; only as a column, to test for it.
    """

    rest_angle: RestAngle
    quadratic: bool = False
    friction: bool = True
    cubic: bool = False

    def __post_init__(self) -> None:
        if self.rest_angle == "free":
            return
        if not np.isfinite(self.rest_angle):
            raise InputError(f"rest angle {self.rest_angle}", expected="rad, or 'free'")
        if abs(self.rest_angle) > 2 * np.pi:
            raise InputError(
                f"a rest angle of {self.rest_angle:g} looks like degrees",
                expected="radians within a turn of zero",
            )

    @property
    def free(self) -> bool:
        """True if the rest angle is fitted."""
        return self.rest_angle == "free"

    @property
    def reference(self) -> float:
        """Angle that is subtracted from q in the columns, rad."""
        return 0.0 if self.rest_angle == "free" else float(self.rest_angle)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the p columns, by their parameters."""
        dry = ("f",) if self.friction else ()
        offset = ("offset",) if self.free else ()
        return (
            "k",
            "h",
            *dry,
            *offset,
            *(("K",) if self.quadratic else ()),
            *(("C",) if self.cubic else ()),
        )

    @property
    def column_units(self) -> tuple[str, ...]:
        """Units of the columns' parameters."""
        return tuple({**UNITS, "offset": "N m"}[name] for name in self.columns)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters: k, h [, f] [, q_r] [, K]."""
        return tuple("q_r" if name == "offset" else name for name in self.columns)

    def matrix(self, q: FloatArray, qd: FloatArray, sign: FloatArray) -> FloatArray:
        """Columns (..., p) from angles, velocities and signs (...)."""
        about = q - self.reference
        more = [sign] if self.friction else []
        more += [np.ones_like(q)] if self.free else []
        more += [about**2] if self.quadratic else []
        more += [about**3] if self.cubic else []
        return np.stack([about, qd, *more], axis=-1)

    def parameters(self, fit: Fit) -> Parameters:
        """Parameters k, h [, f] [, q_r] [, K] with their covariance, from the columns' fit.

        Raises EstimationError: there is no angle at which the elastic torque vanishes.
        """
        return fit.transform(self._from_columns(), self.names, tuple(UNITS[n] for n in self.names))

    def _from_columns(self) -> Callable[[FloatArray], FloatArray]:
        if not self.free:
            return lambda x: x
        if not self.quadratic:
            return lambda x: np.array([*x[:-1], -x[-1] / x[0]])

        def curved(x: FloatArray) -> FloatArray:
            b, c, K = x[0], x[-2], x[-1]
            # the root of K q^2 + b q + c = 0 that is finite as K goes to zero
            root = b**2 - 4 * K * c
            rest = -2 * c / (b + np.sign(b) * np.sqrt(root)) if root >= 0 else np.nan
            return np.array([b + 2 * K * rest, *x[1:-2], rest, K])

        return curved


#: Rows left out at both ends of a trial, in periods of the cut-off. The filter is wrong there, and
#: an acceleration with an error of its own size changes k by 1 % and h by half.
_END_PERIODS: Final = 1.5


@dataclass(frozen=True)
class Equations(FrozenRecord):
    """Rows of one joint, trial by trial.

    `W` tuple of T (S_t, p).
    `column_units`: units of the columns' parameters.
    `Y` tuple of T (S_t, 1): N m.
    """

    columns: Annotated[tuple[str, ...], "p"]
    column_units: Annotated[tuple[str, ...], "p"]
    W: tuple[FloatArray, ...]
    Y: tuple[FloatArray, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        W = tuple(frozen_array(w, "W", (None, len(self.columns))) for w in self.W)
        Y = tuple(frozen_array(y, "Y", (len(w), 1)) for w, y in zip(W, self.Y, strict=True))
        object.__setattr__(self, "W", W)
        object.__setattr__(self, "Y", Y)

    @property
    def n_rows(self) -> int:
        """Number of rows of all trials."""
        return sum(len(y) for y in self.Y)

    def fit(self, covariance: CovarianceKind = "classical", nuisance_per_trial: int = 0) -> Fit:
        """Least squares over all trials.

        `covariance`: a clustered one treats a trial as one observation.
        `nuisance_per_trial`: number of parameters projected out of each trial's rows.
        Raises NotIdentifiableError: W loses rank; names the parameters.
        Raises InputError: no more rows than parameters.
        """
        factors = ragged_factors(
            self.W,
            self.Y,
            regressors=self.columns,
            outputs=("torque",),
            nuisance_per_trial=nuisance_per_trial,
        )
        return fit(
            factors,
            covariance=covariance,
            parameter_names=self.columns,
            parameter_units=self.column_units,
        )

    def stacked(self) -> tuple[FloatArray, FloatArray]:
        """W (N, p) and Y (N, 1) of all trials."""
        return np.concatenate(self.W), np.concatenate(self.Y)


def plain_equations(samples: PassiveSamples, terms: Terms) -> Equations:
    """The source's rows of a single joint: sign(qd) of the smoothed velocity, unfiltered."""
    q, qd, y = samples.q[:, 0], samples.qd[:, 0], samples.torque
    return _equations(samples.slices(), terms, terms.matrix(q, qd, np.sign(qd)), y)


def parallel_equations(samples: PassiveSamples, terms: Terms) -> Equations:
    """Rows of a single joint with every column filtered like Y.

    q is filtered once. H of the filtered motion is the filtered H to first order, so Y, q and qd
    have passed the filter once; the sign is filtered once too. The square of q - q_r is that of the
    filtered angle.
    """
    q, qd, y = samples.q[:, 0], samples.qd[:, 0], samples.torque
    cutoff, rate = samples.cutoff_hz, samples.sample_rate_hz
    sign = np.concatenate([filtered_sign(qd[s], cutoff, rate) for s in samples.slices()])
    W = terms.matrix(q, qd, sign)
    parts = [inner(s, samples) for s in samples.slices()]
    return _equations(parts, terms, W, y)


def inner(trial: slice, samples: PassiveSamples) -> slice:
    """Samples of a trial without `_END_PERIODS` periods of the cut-off at both ends.

    Raises InputError: no samples remain.
    """
    if samples.cutoff_hz is None:
        return trial
    end = int(np.ceil(_END_PERIODS * samples.sample_rate_hz / samples.cutoff_hz))
    if trial.stop - trial.start <= 2 * end:
        raise InputError(
            f"a trial of {trial.stop - trial.start} samples",
            expected=f"more than {2 * end}, the ends that a {samples.cutoff_hz:g} Hz filter spoils",
        )
    return slice(trial.start + end, trial.stop - end)


def check_excitation(samples: PassiveSamples, terms: Terms) -> None:
    """Refuse motion of a single joint that cannot show its parameters.

    Raises NotIdentifiableError: the joint stands still, or moves one way only with a free rest
    angle.
    Raises InputError: fewer rows than three times the parameters.
    """
    name, q, qd = samples.joints[0], samples.q[:, 0], samples.qd[:, 0]
    if len(q) < 3 * len(terms.columns):
        raise InputError(
            f"{len(q)} samples of {name} for {len(terms.columns)} parameters",
            expected=f"{3 * len(terms.columns)} or more",
        )
    if np.ptp(q) < 1e-6:
        lost = tuple(n for n in terms.names if n != "k" or terms.free)
        raise NotIdentifiableError(
            f"{name} stands still: {', '.join(lost)} cannot be seen (expected motion both ways)",
            parameters=lost,
        )
    if terms.free and (np.all(qd > 0) or np.all(qd < 0)):
        raise NotIdentifiableError(
            f"{name} moves one way only: friction f cannot be distinguished from the rest angle "
            "q_r (expected motion both ways, or a known rest angle)",
            parameters=("f", "q_r"),
        )


def _equations(parts: Sequence[slice], terms: Terms, W: FloatArray, Y: FloatArray) -> Equations:
    return Equations(
        terms.columns,
        terms.column_units,
        tuple(W[s] for s in parts),
        tuple(Y[s] for s in parts),
    )
