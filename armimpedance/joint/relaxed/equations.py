"""The sampled equations ``Y = W X + rho`` of one joint (Venture elbow, eq. (8))."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen_array
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.joint.relaxed.terms import Terms
from armimpedance.numerics.regression import CovarianceKind, Fit, fit, ragged_factors
from armimpedance.numerics.signals import filtered_sign

#: Rows left out at both ends of a trial, in periods of the cut-off: the filter has no neighbours
#: there, and an acceleration that is wrong by its own size turns k by 1 % and h by half.
_END_PERIODS: Final = 1.5


@dataclass(frozen=True)
class Equations(FrozenRecord):
    """Rows of one joint, trial by trial.

    Attributes
    ----------
    columns : tuple of p str
    column_units : tuple of p str
        Units of the columns' parameters.
    W : tuple of T arrays (S_t, p)
    Y : tuple of T arrays (S_t, 1)
        N m.
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
        """Rows of all trials."""
        return sum(len(y) for y in self.Y)

    def fit(self, covariance: CovarianceKind = "classical", nuisance_per_trial: int = 0) -> Fit:
        """Least squares over all trials.

        Parameters
        ----------
        covariance : {"classical", "cr1", "cr3"}
            Clustered ones take a trial as one observation.
        nuisance_per_trial : int
            Parameters that were projected out of each trial's rows.

        Raises
        ------
        NotIdentifiableError
            W loses rank; names the parameters.
        InputError
            No more rows than parameters.
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
    """The rows of a single joint with every column filtered like Y.

    q is filtered once; H of the filtered motion is the filtered H to first order, so Y, q and qd
    have been through the filter once, and the sign goes through it once. The square of q - q_r
    is that of the filtered angle.
    """
    q, qd, y = samples.q[:, 0], samples.qd[:, 0], samples.torque
    cutoff, rate = samples.cutoff_hz, samples.sample_rate_hz
    sign = np.concatenate([filtered_sign(qd[s], cutoff, rate) for s in samples.slices()])
    W = terms.matrix(q, qd, sign)
    parts = [inner(s, samples) for s in samples.slices()]
    return _equations(parts, terms, W, y)


def inner(trial: slice, samples: PassiveSamples) -> slice:
    """The samples of a trial less `_END_PERIODS` periods of the cut-off at both ends.

    Raises
    ------
    InputError
        Nothing is left.
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

    Raises
    ------
    NotIdentifiableError
        The joint stands still, or moves one way only with a free rest angle.
    InputError
        Fewer rows than three times the parameters.
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
            f"{name} moves one way only: friction f cannot be told from the rest angle q_r "
            "(expected motion both ways, or a known rest angle)",
            parameters=("f", "q_r"),
        )


def _equations(parts: Sequence[slice], terms: Terms, W: FloatArray, Y: FloatArray) -> Equations:
    return Equations(
        terms.columns,
        terms.column_units,
        tuple(W[s] for s in parts),
        tuple(Y[s] for s in parts),
    )
