"""Per-trial triangular factors: all that a regression needs from the samples.

For every cluster t (a trial, or a block of a long trial) the upper triangle r_t of
``[W_t Y_t] = Q_t r_t`` is stored. Any set of clusters can then be fitted, weighted or left out
without the samples, at the accuracy of an orthogonal factorisation of the samples themselves.
Normal equations would square the condition number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, IntArray, frozen_array
from armimpedance.core.errors import InputError

#: A column whose relative range is below this is the intercept.
_CONSTANT_TOLERANCE = 1e-12

#: Numbers factored at once: a small work space can be reused, while allocating a large one takes
#: longer than the factorisation itself.
_BATCH_NUMBERS = 60_000


@dataclass(frozen=True, eq=False)
class TrialFactors:
    """Triangular factors of ``[W_t Y_t]``, one per cluster.

    Attributes
    ----------
    r : (T, k, k)
        Upper triangular, ``k = p + q``; ``r_t^T r_t = [W_t Y_t]^T [W_t Y_t]``.
    rows : (T,) int
        Rows in each cluster.
    regressors, outputs : tuple of str
        The p columns of W and the q columns of Y.
    regressor_units, output_units : tuple of str
        SI units; empty strings where unknown.
    nuisance_per_trial : int
        Parameters per output projected out of each cluster before (an offset and a ramp: 2); they
        reduce the degrees of freedom.
    intercept : str or None
        The regressor that is the same in every row, if there is one: sums of squares are then
        taken about the mean, otherwise about zero.
    """

    r: FloatArray
    rows: IntArray
    regressors: tuple[str, ...]
    outputs: tuple[str, ...]
    regressor_units: tuple[str, ...] = ()
    output_units: tuple[str, ...] = ()
    nuisance_per_trial: int = 0
    intercept: str | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("regressors", "outputs"):
            labels = tuple(getattr(self, name))
            if not labels or len(set(labels)) != len(labels):
                raise InputError(f"{name} are {labels}", expected="one or more different names")
            put(self, name, labels)
            units = tuple(getattr(self, f"{name[:-1]}_units")) or ("",) * len(labels)
            if len(units) != len(labels):
                raise InputError(f"{len(units)} units for {len(labels)} {name}")
            put(self, f"{name[:-1]}_units", units)
        k = len(self.regressors) + len(self.outputs)
        put(self, "r", frozen_array(self.r, "r", (None, k, k)))
        put(self, "rows", frozen_array(self.rows, "rows", (len(self.r),), np.int64))
        if len(self.r) == 0:
            raise InputError("nothing to fit", expected="one usable trial or more")
        if self.intercept is not None and self.intercept not in self.regressors:
            raise InputError(f"no regressor {self.intercept!r} to serve as the intercept")

    @property
    def n_clusters(self) -> int:
        """Number of clusters T."""
        return len(self.r)

    @property
    def n_regressors(self) -> int:
        """Number of columns p of W."""
        return len(self.regressors)

    @property
    def n_outputs(self) -> int:
        """Number of columns q of Y."""
        return len(self.outputs)

    @property
    def effective_rows(self) -> int:
        """Rows of all clusters less the nuisance parameters projected out before."""
        return int(self.rows.sum()) - self.nuisance_per_trial * self.n_clusters

    def subset(self, clusters: ArrayLike) -> TrialFactors:
        """Return the factors of these clusters only (a mask or indices, which may repeat)."""
        chosen = np.arange(self.n_clusters)[np.asarray(clusters)]
        return replace(self, r=self.r[chosen], rows=self.rows[chosen])

    def prediction_quality(self, coefficients: FloatArray) -> tuple[float, float]:
        """Variance accounted for and correlation of the prediction ``W Theta`` with Y.

        ``1 - |Y - W Theta|^2 / |Y|^2`` and ``sum Y Yhat / sqrt(sum Y^2 sum Yhat^2)``, about zero,
        for any Theta (p, q); for the least-squares one they are `Fit.vaf` and `Fit.correlation`
        of a model without intercept.
        """
        p = self.n_regressors
        predicted = self.r[:, :, :p] @ coefficients
        measured = self.r[:, :, p:]
        y2, yhat2 = float((measured**2).sum()), float((predicted**2).sum())
        if y2 == 0 or yhat2 == 0:
            return 0.0, 0.0
        residual = float(((measured - predicted) ** 2).sum())
        return 1 - residual / y2, float((measured * predicted).sum()) / float(np.sqrt(y2 * yhat2))


def trial_factors(
    W: ArrayLike,
    Y: ArrayLike,
    *,
    regressors: Sequence[str],
    outputs: Sequence[str],
    regressor_units: Sequence[str] | None = None,
    output_units: Sequence[str] | None = None,
    usable: ArrayLike | None = None,
    nuisance_per_trial: int = 0,
) -> TrialFactors:
    """Factor trials of equal length, all at once.

    Parameters
    ----------
    W : (T, S, p)
        Regressors, SI.
    Y : (T, S, q)
        Outputs, SI.
    regressors, outputs, regressor_units, output_units : sequences of str
    usable : (T,) bool, optional
        Trials to keep; the others are dropped.
    nuisance_per_trial : int
        See `TrialFactors`.

    Returns
    -------
    TrialFactors
        One triangular factor of ``[W Y]`` per usable trial.

    Raises
    ------
    InputError
        Shapes that do not belong together, values that are not finite, no usable trial.
    """
    W, Y = _matching(np.asarray(W, np.float64), np.asarray(Y, np.float64))
    keep = np.ones(len(W), np.bool_) if usable is None else np.asarray(usable, np.bool_)
    if keep.shape != (len(W),):
        raise InputError(f"usable has shape {keep.shape}", expected=f"shape ({len(W)},)")
    if not keep.any() or W.shape[1] == 0:
        raise InputError("nothing to fit", expected="one usable trial with samples or more")
    if not keep.all():
        W, Y = W[keep], Y[keep]
    _check_columns(W, regressors)
    _check_columns(Y, outputs)
    return TrialFactors(
        r=_triangles(W, Y),
        rows=np.full(len(W), W.shape[1]),
        regressors=tuple(regressors),
        outputs=tuple(outputs),
        regressor_units=tuple(regressor_units or ()),
        output_units=tuple(output_units or ()),
        nuisance_per_trial=nuisance_per_trial,
        intercept=_constant_column(W.reshape(-1, W.shape[2]), regressors),
    )


def ragged_factors(
    W: Sequence[ArrayLike],
    Y: Sequence[ArrayLike],
    *,
    regressors: Sequence[str],
    outputs: Sequence[str],
    regressor_units: Sequence[str] | None = None,
    output_units: Sequence[str] | None = None,
    nuisance_per_trial: int = 0,
) -> TrialFactors:
    """Factor clusters of different length: lists of (S_t, p) and of (S_t, q).

    Parameters
    ----------
    W : sequence of T arrays (S_t, p)
        Regressors, SI.
    Y : sequence of T arrays (S_t, q)
        Outputs, SI.
    regressors, outputs, regressor_units, output_units : sequences of str
    nuisance_per_trial : int
        See `TrialFactors`.

    Returns
    -------
    TrialFactors
        One triangular factor of ``[W Y]`` per cluster.

    Raises
    ------
    InputError
        The same cases as in `trial_factors`.
    """
    if len(W) != len(Y) or len(W) == 0:
        raise InputError(
            f"{len(W)} blocks of regressors, {len(Y)} of outputs", expected="equally many, not 0"
        )
    triangles = []
    for cluster, (w, y) in enumerate(zip(W, Y, strict=True)):
        w, y = _matching(np.asarray(w, np.float64)[None], np.asarray(y, np.float64)[None])
        _check_columns(w, regressors, cluster)
        _check_columns(y, outputs, cluster)
        triangles.append(_triangles(w, y))
    everything = np.concatenate([np.asarray(w, np.float64) for w in W])
    return TrialFactors(
        r=np.concatenate(triangles),
        rows=np.array([len(np.asarray(w)) for w in W]),
        regressors=tuple(regressors),
        outputs=tuple(outputs),
        regressor_units=tuple(regressor_units or ()),
        output_units=tuple(output_units or ()),
        nuisance_per_trial=nuisance_per_trial,
        intercept=_constant_column(everything, regressors),
    )


def _matching(W: FloatArray, Y: FloatArray) -> tuple[FloatArray, FloatArray]:
    if W.ndim != 3 or Y.ndim != 3 or W.shape[:2] != Y.shape[:2]:
        raise InputError(
            f"regressors of shape {W.shape}, outputs of shape {Y.shape}",
            expected="(trials, samples, columns) with the same trials and samples",
        )
    return W, Y


def _check_columns(columns: FloatArray, names: Sequence[str], first_cluster: int = 0) -> None:
    if columns.shape[2] != len(names):
        raise InputError(
            f"{columns.shape[2]} columns", expected=f"one for each of {', '.join(names)}"
        )
    finite = np.isfinite(columns)
    if not finite.all():
        cluster, row, j = np.argwhere(~finite)[0]
        raise InputError(
            f"not finite in cluster {first_cluster + cluster}, sample {row} (counted from 0)",
            column=names[j],
            expected="finite numbers",
        )


def _triangles(W: FloatArray, Y: FloatArray) -> FloatArray:
    """Triangles (T, k, k) of [W_t Y_t] (S, k); zero rows fill up clusters of fewer rows than k."""
    T, S, k = *W.shape[:2], W.shape[2] + Y.shape[2]
    r = np.zeros((T, k, k))
    at_once = max(_BATCH_NUMBERS // (max(S, k) * k), 1)
    for start in range(0, T, at_once):
        batch = slice(start, start + at_once)
        # [W_t Y_t] (S, k) = Q_t (S, k) r_t (k, k)
        table = np.concatenate([W[batch], Y[batch]], axis=2)
        r[batch, : min(S, k)] = np.linalg.qr(table, mode="r")
    return r


def _constant_column(W: FloatArray, regressors: Sequence[str]) -> str | None:
    """The first regressor that has the same value, not zero, in all rows of W (N, p)."""
    first = W[0]
    for j, name in enumerate(regressors):
        # two rows rule out nearly every column before a whole column is read
        if first[j] == 0 or abs(W[-1, j] - first[j]) > _CONSTANT_TOLERANCE * abs(first[j]):
            continue
        if np.ptp(W[:, j]) <= _CONSTANT_TOLERANCE * abs(first[j]):
            return name
    return None
