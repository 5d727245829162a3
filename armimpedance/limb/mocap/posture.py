"""Least-squares postures of a skeleton from its markers, and frames that do not determine them.

Directions of the coordinates that the markers do not determine are set by a natural posture. A
plain pull towards it (Tikhonov) would bias the other directions by ``(w / s)^2`` of the distance
from the natural posture, where s is the motion of the markers per unit of the direction. The pull
is therefore iterated (iterated Tikhonov regularisation, King and Chillingworth 1979; Engl, Hanke
and Neubauer 1996, section 5.1). With `PASSES` passes the bias is ``(w^2 / (s^2 + w^2))^PASSES``:
nearly zero for a direction that moves markers by a few times w, while the natural posture still
determines directions with s << w.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.core.progress import Progress
from armimpedance.limb.mocap.kinematics import MarkerTree, marker_jacobian, marker_places

#: w: a direction that moves the markers by less is determined by the natural posture, m/rad.
PULL_M: Final = 3e-3
PASSES: Final = 6

_DESCENT_STEPS: Final = 60
_COARSE: Final = 1e-5
_POLISH_STEPS: Final = 30
#: A frame has converged when its coordinates change by less than this (rad, m).
_FINE: Final = 1e-9
#: Change that is still accepted if rounding prevents convergence.
_GOOD: Final = 1e-6
#: Largest turn in one step, rad; beyond it the linear model of a joint is not valid.
_LONGEST_STEP: Final = 0.5

#: Numbers of a block's Jacobian: 2 million are 16 MB.
_BLOCK_SIZE: Final = 2_000_000


@dataclass(frozen=True)
class Postures:
    """Coordinates of every frame.

    `q` (N, n), `steps` (N,) int.
    `cost` (N,): sum of the squared distances of the seen markers, m^2.
    `free` (N, n): share of each coordinate that the natural posture determines, 0 (markers only)
    to 1.
    `settled` (N,) bool: False: the result is the plain pull's minimum, biased by up to
    ``(w / s)^2``.
    `converged` (N,) bool: False: the search did not converge.
    """

    q: FloatArray
    cost: FloatArray
    free: FloatArray
    steps: IntArray
    settled: BoolArray
    converged: BoolArray


def fit_postures(
    tree: MarkerTree,
    targets: FloatArray,
    start: FloatArray,
    natural: FloatArray,
    *,
    pull_m: float = PULL_M,
    progress: Progress | None = None,
) -> Postures:
    """Fit the posture of every frame by least squares.

    `targets` (N, P, 3): measured places of the markers; NaN where they were not seen.
    `start`, `natural` (N, n): start of the search, and posture for directions that the markers do
    not determine.
    `pull_m`: w: a direction that moves the markers by less is determined by the natural posture,
    m/rad.
    `progress`: called with the number of frames done and their total.
    """
    n, rows = start.shape[1], targets.shape[1] * 3
    block = max(1, _BLOCK_SIZE // max(1, rows * n))
    parts = []
    for i in range(0, len(start), block):
        rows_of_block = slice(i, i + block)
        parts.append(
            _Search(tree, targets[rows_of_block], natural[rows_of_block], pull_m).run(
                start[rows_of_block]
            )
        )
        if progress is not None:
            progress(min(i + block, len(start)), len(start))
    if len(parts) == 1:
        return parts[0]
    return Postures(
        **{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Postures)}
    )


@dataclass(frozen=True)
class _Search:
    """Search for the postures of a block of frames."""

    tree: MarkerTree
    targets: FloatArray
    natural: FloatArray
    pull_m: float

    def run(self, start: FloatArray) -> Postures:
        q, steps, converged = self._descend(start)
        return self._polish(q, steps, converged)

    def _descend(self, start: FloatArray) -> tuple[FloatArray, IntArray, BoolArray]:
        """Minimise ``|r|^2 + w^2 |q - natural|^2`` (Levenberg-Marquardt, damped for each frame).

        The sum never increases, whatever the start.
        """
        q, steps = start.copy(), np.zeros(len(start), np.int64)
        w2, identity = self.pull_m**2, np.eye(q.shape[1])
        present = self._plain_pull(np.arange(len(q)), q)
        active = np.arange(len(q))
        damping = np.full(len(q), 1e-3)
        for _ in range(_DESCENT_STEPS):
            if not len(active):
                break
            # (J^T J + (w^2 + mu) 1) (n, n) dq (n,) = J^T r + w^2 (natural - q)
            A = present.JtJ[active] + (w2 + damping[active])[:, None, None] * identity
            dq = np.asarray(np.linalg.solve(A, present.g[active][..., None])[..., 0], np.float64)
            dq = _shortened(dq)
            trial = self._plain_pull(active, q[active] + dq)
            better = trial.cost <= present.cost[active]
            accepted = active[better]
            q[accepted] += dq[better]
            present.cost[accepted], present.JtJ[accepted], present.g[accepted] = (
                values[better] for values in (trial.cost, trial.JtJ, trial.g)
            )
            steps[active] += 1
            factor = np.where(better, 0.1, 10.0)
            damping[active] = np.clip(damping[active] * factor, 1e-12, 1e6)
            active = active[np.abs(dq).max(axis=1) > _COARSE]
        converged = np.ones(len(q), bool)
        converged[active] = False
        return q, steps, converged

    def _plain_pull(self, rows: IntArray, q: FloatArray) -> _Normal:
        """Sum of squares with the plain pull for some frames at q, and its normal equations."""
        away = self.natural[rows] - q
        w2 = self.pull_m**2
        at = normal_equations(self.tree, q, self.targets[rows])
        return _Normal(at.cost + w2 * (away * away).sum(axis=1), at.JtJ, at.g + w2 * away)

    def _polish(self, start: FloatArray, steps: IntArray, converged: BoolArray) -> Postures:
        """Take Newton steps on the iterated pull, from a start so near that no damping is needed.

        If they do not converge (markers that hardly determine a direction and fit badly), the
        start, which is the plain pull's minimum, is kept.
        """
        q, steps = start.copy(), steps.copy()
        free = np.zeros_like(q)
        last = np.full(len(q), np.inf)
        active = np.arange(len(q))
        for _ in range(_POLISH_STEPS):
            if not len(active):
                break
            at = normal_equations(self.tree, q[active], self.targets[active])
            away = self.natural[active] - q[active]
            dq, free[active] = iterated_pull(at.JtJ, at.g, away, self.pull_m)
            dq = _shortened(dq)
            q[active] += dq
            last[active] = np.abs(dq).max(axis=1)
            steps[active] += 1
            active = active[last[active] > _FINE]
        cost, before = (_cost(self.tree, at, self.targets) for at in (q, start))
        settled = (last < _GOOD) & (cost <= before * (1.0 + 1e-6) + 1e-12)
        q[~settled], cost[~settled] = start[~settled], before[~settled]
        return Postures(q, cost, free, steps, settled, converged)


@dataclass(frozen=True)
class _Normal:
    """A sum of squares (N,) and its normal equations: ``J^T J`` (N, n, n), ``J^T r`` (N, n)."""

    cost: FloatArray
    JtJ: FloatArray
    g: FloatArray


def normal_equations(tree: MarkerTree, q: FloatArray, targets: FloatArray) -> _Normal:
    """Normal equations of the seen markers, r = measured - computed, in m."""
    places, jacobian = marker_jacobian(tree, q)
    r, lost = _residual(places, targets)
    if lost.any():
        jacobian *= ~lost[:, None, :, None]
    J = jacobian.reshape(len(q), -1, q.shape[1])
    Jt = np.swapaxes(J, 1, 2)
    flat = np.swapaxes(r, 1, 2).reshape(len(q), -1, 1)
    return _Normal((r * r).sum(axis=(1, 2)), Jt @ J, (Jt @ flat)[..., 0])


def iterated_pull(
    JtJ: FloatArray, Jtr: FloatArray, away: FloatArray, pull_m: float
) -> tuple[FloatArray, FloatArray]:
    """Compute the step to the iterated-Tikhonov solution of the linearised problem.

    Each pass minimises ``|r - J x|^2 + w^2 |x - x_before|^2``, from x = natural - q = `away`.

    Returns: `step` (N, n).
    `free` (N, n): share of the natural posture in each coordinate, the diagonal of ``(w^2 (J^T J +
    w^2)^-1)^PASSES``.
    """
    A = np.linalg.inv(JtJ + pull_m**2 * np.eye(JtJ.shape[1]))
    b = (A @ Jtr[..., None])[..., 0]
    P = pull_m**2 * A
    x = away
    for _ in range(PASSES):
        # x (n,) = (J^T J + w^2 1)^-1 (J^T r + w^2 x)
        x = b + (P @ x[..., None])[..., 0]
    return x, np.einsum("fii->fi", np.linalg.matrix_power(P, PASSES)).copy()


def _residual(places: FloatArray, targets: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Residuals (N, P, 3), 0 for a lost marker; and the mask of lost markers (N, P)."""
    lost = np.isnan(targets[..., 0])
    return np.where(lost[..., None], 0.0, targets - places), lost


def _cost(tree: MarkerTree, q: FloatArray, targets: FloatArray) -> FloatArray:
    r, _ = _residual(marker_places(tree, q), targets)
    return np.asarray((r * r).sum(axis=(1, 2)))


def _shortened(dq: FloatArray) -> FloatArray:
    """Shorten steps to at most `_LONGEST_STEP` in any coordinate."""
    longest = np.abs(dq).max(axis=1, keepdims=True)
    return np.asarray(dq * np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300)))


# Frames in which the seen markers do not determine the posture.

#: A direction that moves the seen markers by less than this is bridged, m/rad: with 0.5 mm of
#: noise, its estimate would be worse than a spline across a fifth of a second.
BRIDGE_M: Final = 20e-3

#: Additional undetermined coordinates, by loss of markers, above which a frame counts as short.
_MORE_FREEDOM: Final = 0.1

#: At a trial's ends the nearest posture is repeated for at most this share of the gap that is
#: allowed inside.
END_SHARE: Final = 0.5


def short_frames(tree: MarkerTree, q: FloatArray, targets: FloatArray) -> BoolArray:
    """True for frames (N,) whose lost markers leave more coordinates undetermined."""
    lost = np.flatnonzero(np.isnan(targets[..., 0]).any(axis=1))
    short = np.zeros(len(targets), bool)
    for rows in np.array_split(lost, max(1, len(lost) // 256)):
        if len(rows):
            all_seen = np.zeros_like(targets[rows])
            seen = _freedom(tree, q[rows], targets[rows])
            short[rows] = seen > _freedom(tree, q[rows], all_seen) + _MORE_FREEDOM
    return short


def _freedom(tree: MarkerTree, q: FloatArray, targets: FloatArray) -> FloatArray:
    """Number of coordinates (N,) that these markers leave undetermined, not necessarily whole."""
    at = normal_equations(tree, q, targets)
    _, free = iterated_pull(at.JtJ, at.g, np.zeros_like(q), BRIDGE_M)
    return np.asarray(free.sum(axis=1))


def bridge(
    q: FloatArray,
    short: BoolArray,
    markers: MarkerRecording,
    names: tuple[str, ...],
    targets: FloatArray,
    longest_gap_s: float,
) -> FloatArray:
    """Interpolate the coordinates (N, n) of short frames through the other frames of their trial.

    Inside a trial by a cubic spline; at its ends the nearest posture is repeated.

    Raises InputError: a run of short frames is longer than `longest_gap_s`, or than half of it at a
    trial's ends.
    """
    bridged = q.copy()
    for t in range(markers.n_trials):
        rows = markers.samples_of(t)
        if not short[rows].any():
            continue
        _refuse_long(short[rows], t, markers, names, targets[rows], longest_gap_s)
        bridged[rows] = _across(q[rows], short[rows])
    return bridged


def _across(q: FloatArray, short: BoolArray) -> FloatArray:
    from scipy.interpolate import CubicSpline

    index = np.arange(len(q))
    good = np.flatnonzero(~short)
    inside = np.clip(index[short], good[0], good[-1])
    filled = q.copy()
    if len(good) < 4:
        for k in range(q.shape[1]):
            filled[short, k] = np.interp(inside, good, q[good, k])
    else:
        filled[short] = CubicSpline(good, q[good])(inside)
    return filled


def _refuse_long(
    short: BoolArray,
    trial: int,
    markers: MarkerRecording,
    names: tuple[str, ...],
    targets: FloatArray,
    longest_gap_s: float,
) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], short, [False]]).astype(np.int8)))
    for start, end in edges.reshape(-1, 2):
        at_end = start == 0 or end == len(short)
        allowed = longest_gap_s * (END_SHARE if at_end else 1.0)
        length = (end - start) / markers.sample_rate_hz
        if length <= allowed * (1.0 + 1e-9) and end - start < len(short):
            continue
        lost = np.isnan(targets[start:end, :, 0]).mean(axis=0)
        missing = [names[m] for m in np.argsort(-lost, kind="stable") if lost[m] > 0.5][:3]
        time = markers.time_s[markers.samples_of(trial)]
        suffix = " at the trial's end" if at_end else ""
        raise InputError(
            f"trial {markers.trials['trial'].iloc[trial]}: {', '.join(missing) or 'markers'} lost "
            f"from {time[start]:.3f} to {time[end - 1]:.3f} s ({length:.3f} s{suffix}), and the "
            "others do not determine the posture",
            expected=f"at most {allowed:g} s",
        )
