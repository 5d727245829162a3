"""Triangular factors per trial and row, which replace the samples in the identification.

For trial t and row c (a component of the root's wrench, or a joint) the upper triangle of
``[W_tc w_tc]`` is kept. Any choice of motions, weights of rows and set of columns can then be
fitted and validated without the samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MotionRecording
from armimpedance.core.progress import Progress
from armimpedance.joint.body.rows import RowChoice, each_trial
from armimpedance.numerics.regression import TrialFactors

# Quality of the prediction of the contact wrench (or the torques), motion by motion.
#
# R^2 of the vertical force about zero is always near 1, since a weight at rest explains it. Here
# R^2 is about each row's mean in each motion, and moments are reported separately from forces.


@dataclass(frozen=True)
class BodyValidation(FrozenRecord):
    """Residuals per motion and row.

    Attributes
    ----------
    motions : tuple of T str
    rows, row_units : tuples of R str
    samples : (T,) int
    residual_squares, squares : (T, R)
        Sums of squares over samples: of the residual, and of the measurement about its mean in that
        motion.
    """

    motions: Annotated[tuple[str, ...], "T"]
    rows: Annotated[tuple[str, ...], "R"]
    row_units: Annotated[tuple[str, ...], "R"]
    samples: Annotated[IntArray, "T"]
    residual_squares: Annotated[FloatArray, "T R"]
    squares: Annotated[FloatArray, "T R"]

    @property
    def rms(self) -> FloatArray:
        """Root mean square residual (T, R), N or N m."""
        return np.sqrt(self.residual_squares / self.samples[:, None])

    @property
    def r2(self) -> FloatArray:
        """R^2, ``1 - residual / variation`` (T, R); nan if there is no variation."""
        return _r2(self.residual_squares, self.squares)

    def pooled_rms(self, rows: Sequence[str] | None = None) -> float:
        """Root mean square residual over all motions and these rows."""
        at = self._at(rows)
        count = self.samples.sum() * len(at)
        return float(np.sqrt(self.residual_squares[:, at].sum() / count))

    def pooled_r2(self, rows: Sequence[str] | None = None) -> float:
        """R^2 over all motions and these rows."""
        at = self._at(rows)
        return float(_r2(self.residual_squares[:, at].sum(), self.squares[:, at].sum()))

    @property
    def moments(self) -> tuple[str, ...]:
        """Names of the rows in N m."""
        pairs = zip(self.rows, self.row_units, strict=True)
        return tuple(row for row, unit in pairs if unit == "N m")

    @property
    def forces(self) -> tuple[str, ...]:
        """Names of the rows in N."""
        return tuple(row for row in self.rows if row not in self.moments)

    def to_list(self) -> list[dict[str, Any]]:
        """Plain values, one mapping per motion, as in FIT.json."""
        return [
            {
                "motion": motion,
                "samples": int(self.samples[t]),
                "rms": dict(zip(self.rows, self.rms[t].tolist(), strict=True)),
                "r2": dict(zip(self.rows, self.r2[t].tolist(), strict=True)),
            }
            for t, motion in enumerate(self.motions)
        ]

    def _at(self, rows: Sequence[str] | None) -> list[int]:
        return [self.rows.index(row) for row in (self.rows if rows is None else rows)]


def _r2(residual: FloatArray, total: FloatArray) -> FloatArray:
    some = total > 0
    return np.where(some, 1 - residual / np.where(some, total, 1.0), np.nan)


@dataclass(frozen=True, eq=False)
class BodyEquations(FrozenRecord):
    """Triangles of ``w = W phi`` per trial and row, k = p + 1.

    Attributes
    ----------
    r : (T, R, k, k)
        Upper triangles of ``[W w]``.
    samples : (T,) int
    mean : (T, R)
        Mean of w, to separate variation from the constant part.
    motions : tuple of T str
        The trials' conditions.
    rows, row_units : tuples of R str
    columns, column_units : tuples of p str
        The inertial parameters (ten per segment), then the joint terms.
    n_inertial : int
        Number of columns that are inertial parameters.
    """

    r: Annotated[FloatArray, "T R p+1 p+1"]
    samples: Annotated[IntArray, "T"]
    mean: Annotated[FloatArray, "T R"]
    motions: Annotated[tuple[str, ...], "T"]
    rows: Annotated[tuple[str, ...], "R"]
    row_units: Annotated[tuple[str, ...], "R"]
    columns: Annotated[tuple[str, ...], "p"]
    column_units: Annotated[tuple[str, ...], "p"]
    n_inertial: int

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.r)

    def subset(self, trials: ArrayLike) -> BodyEquations:
        """Equations of these trials only (row numbers from 0, or a mask)."""
        chosen = np.arange(self.n_trials)[np.asarray(trials)]
        if len(chosen) == 0:
            raise InputError("no motions to identify from")
        motions = tuple(self.motions[t] for t in chosen)
        return replace(
            self,
            r=self.r[chosen],
            samples=self.samples[chosen],
            mean=self.mean[chosen],
            motions=motions,
        )

    def stacked(self, weights: FloatArray | None = None) -> FloatArray:
        """One triangle (k, k) of all trials and rows, each row times its weight (R,)."""
        scale = np.ones(len(self.rows)) if weights is None else weights
        k = self.r.shape[-1]
        return np.asarray(np.linalg.qr((self.r * scale[:, None, None]).reshape(-1, k), mode="r"))

    def squares(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sums of squares (T, R) of the residual ``w - W phi`` and of w about its mean."""
        p = len(self.columns)
        residual = self.r[..., p] - self.r[..., :p] @ phi
        varying = (self.r[..., p] ** 2).sum(axis=2) - self.samples[:, None] * self.mean**2
        return (residual**2).sum(axis=2), varying

    def validate(self, phi: FloatArray) -> BodyValidation:
        """Validate the prediction ``W phi`` of parameters (p,), of all segments and joint terms.

        A base solution is used by its `BaseParameters.lift`.
        """
        residual, varying = self.squares(phi)
        return BodyValidation(
            self.motions, self.rows, self.row_units, self.samples, residual, varying
        )


def body_equations(
    recording: MotionRecording,
    choice: RowChoice,
    progress: Progress | None = None,
) -> BodyEquations:
    """Reduce a recording to its triangles, one trial after another.

    Parameters
    ----------
    recording : MotionRecording
    choice : RowChoice
    progress : function, optional
        Called with the number of trials that are done and their total.

    Returns
    -------
    BodyEquations

    Raises
    ------
    InputError
        As `each_trial`.
    """
    skeleton = recording.skeleton
    triangles, means, samples, motions = [], [], [], []
    for trial in each_trial(recording, choice):
        k = trial.W.shape[2] + 1
        table = np.concatenate([trial.W, trial.w[:, :, None]], axis=2).swapaxes(0, 1)
        r = np.zeros((table.shape[0], k, k))
        # [W_c w_c] (S, k) = Q (S, k) r_c (k, k), for all rows c
        r[:, : min(table.shape[1], k)] = np.linalg.qr(table, mode="r")
        triangles.append(r)
        means.append(trial.w.mean(axis=0))
        samples.append(len(trial.w))
        motions.append(trial.condition)
        if progress is not None:
            progress(len(motions), recording.n_trials)
    return BodyEquations(
        r=np.stack(triangles),
        samples=np.array(samples),
        mean=np.stack(means),
        motions=tuple(motions),
        rows=choice.row_names(skeleton),
        row_units=choice.row_units(skeleton),
        columns=choice.column_names(skeleton),
        column_units=choice.column_units(skeleton),
        n_inertial=len(choice.column_names(skeleton)) - len(choice.terms),
    )


def trial_factors_of(
    equations: BodyEquations,
    columns: IntArray,
    names: tuple[str, ...],
    units: tuple[str, ...],
    weights: FloatArray,
) -> TrialFactors:
    """Factors of selected columns for the regression, rows weighted by (R,), clustered by trial."""
    p = len(equations.columns)
    take = np.append(columns, p)
    scaled = equations.r[..., take] * weights[:, None, None]
    T, k = equations.n_trials, len(take)
    # rows of all R triangles of a trial below one another
    r = np.asarray(np.linalg.qr(scaled.reshape(T, -1, k), mode="r"))
    return TrialFactors(
        r=r,
        rows=equations.samples * len(equations.rows),
        regressors=names,
        outputs=("wrench",),
        regressor_units=units,
        output_units=("",),
    )
