"""The impedance equation of every trial in terms of modes: few rows, any covariance.

Multiplied by each test function, `M x'' + B x' + K x = -f` becomes a sum over the window; with n
modes and d axes a trial has d n rows. Weighted by V = Sigma^-1 they give normal equations for M, B
and K together, since the noise of the axes is correlated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray, by_axis, frozen
from armimpedance.core.conventions import UNITS, Kind, element_names, parameter_names
from armimpedance.core.errors import RecordError
from armimpedance.core.records import Window
from armimpedance.numerics.regression import TrialEquations
from armimpedance.numerics.signals import Modes, delayed, spline_modes


@dataclass(frozen=True, eq=False)
class ModalEquation(FrozenRecord):
    """``M x'' + B x' + K x (+ R x_delayed) = -f`` of T trials in n modes.

    `disturbance` (T,) int or None.
    `lag_s` (S,): times of the window's samples, which the modes cover, from the onset, s.
    `motion` (T, r, d, n): x'', x', x of each axis, measured from where the hand rested before the
    onset; r > 3 if delayed x follow.
    `force` (T, d, n): -f, f being the force minus its mean over all trials before the onset.
    """

    modes: Modes
    lag_s: FloatArray
    motion: Annotated[FloatArray, "t r d n"]
    force: Annotated[FloatArray, "t d n"]
    disturbance: IntArray | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        n = self.modes.count
        if self.motion.shape[3] != n:
            raise RecordError(f"motion in {self.motion.shape[3]} modes", expected=f"{n}")

    @property
    def axes(self) -> int:
        """Number of axes d."""
        return int(self.motion.shape[2])

    @property
    def trials(self) -> int:
        """Number of trials T."""
        return len(self.motion)

    @property
    def matrices(self) -> int:
        """Number of unknown matrices r."""
        return int(self.motion.shape[1])

    @property
    def regressors(self) -> FloatArray:
        """x'', y'', x', y', x, y in modes, (T, r d, n)."""
        return self.motion.reshape(self.trials, self.matrices * self.axes, self.modes.count)

    def residual(self, parameters: FloatArray) -> FloatArray:
        """``-f - M x'' - B x' - K x`` (T, d n) for M, B, K row by row (r d^2,)."""
        d, r = self.axes, self.matrices
        # [i, n] = sum_mk theta[m, i, k] motion[m, k, n]
        stacked = parameters.reshape(r, d, d).transpose(1, 0, 2).reshape(d, r * d)
        return np.asarray((self.force - stacked @ self.regressors).reshape(self.trials, -1))


def modal_equation(
    window: Window, modes: Modes | None = None, *, delay_s: float | Sequence[float] | None = None
) -> ModalEquation:
    """The usable trials of a window in modes (default: `spline_modes`).

    Parameters
    ----------
    window : Window
    modes : Modes, optional
    delay_s : float or sequence of float, optional
        Adds the displacement of that much earlier as a further regressor, one for each delay. The
        hand is taken as at rest before the window.

    Returns
    -------
    ModalEquation
        Motion and force of the usable trials, as coefficients of the modes.

    Raises
    ------
    InputError
        If the window is too short for any modes.
    """
    modes = modes or spline_modes(len(window.lag_s), window.sample_rate_hz)
    d, n = window.axes, modes.count
    moved, pushed = about_rest(window)
    delays = () if delay_s is None else np.atleast_1d(delay_s)
    late = [delayed(moved, delay * window.sample_rate_hz) @ modes.smooth.T for delay in delays]
    # all trials and axes at once: (d T, S) (S, 3 n)
    motion = np.concatenate([moved @ modes.stacked.T, *late], axis=1)
    motion = motion.reshape(d, -1, motion.shape[1] // n, n).transpose(1, 2, 0, 3)
    force = pushed @ modes.smooth.T
    np.negative(force, out=force)
    return ModalEquation(
        modes=modes,
        lag_s=window.lag_s,
        motion=frozen(np.array(motion, order="C")),
        force=force.reshape(d, -1, n).transpose(1, 0, 2),
        disturbance=None if window.disturbance is None else window.disturbance[window.usable],
    )


def about_rest(window: Window) -> tuple[FloatArray, FloatArray]:
    """Displacement, and force minus its value at rest, of the usable trials, (d T, S) each."""
    used = window.usable
    moved = by_axis(window.position[used])
    moved -= by_axis(window.position_at_onset[used][:, None])
    pushed = by_axis(window.force[used])
    rest = window.force_at_onset[used].mean(axis=0)
    pushed -= np.repeat(rest, len(pushed) // window.axes)[:, None]
    return moved, pushed


def weighted_equations(
    equation: ModalEquation,
    weight: FloatArray,
    kind: Kind,
    instruments: FloatArray | None = None,
    excess: FloatArray | None = None,
) -> TrialEquations:
    """Normal equations ``A_t = Z_t^T V W_t``, ``b_t = Z_t^T V y_t`` of every trial.

    Row (i, n) of W has x_k^(m) of mode n in the column of the parameter (m, i, k), row i column k
    of the matrix m.

    `weight` (d n, d n): V, symmetric.
    `instruments` (T, r d, n): instruments that take the regressors' place in Z; default: the
    regressors themselves.
    `excess` (r d^2, r d^2): expected contribution of noise in the regressors, subtracted from every
    A_t.
    """
    d, n, T, r = equation.axes, equation.modes.count, equation.trials, equation.matrices
    X = equation.regressors
    Z = X if instruments is None else instruments
    V = weight.reshape(d, n, d, n).transpose(2, 1, 0, 3).reshape(d, n, d * n)
    right = np.concatenate([X, equation.force], axis=1).transpose(0, 2, 1)
    A = np.empty((T, r, d, d, r, d, d))
    b = np.zeros((T, r, d, d))
    for j in range(d):
        # Z_t (r d, n) V_ij (n, n) of all trials and rows i, times [X_t y_t]^T (n, r d + d)
        left = (Z.reshape(-1, n) @ V[j]).reshape(T, r * d * d, n)
        products = (left @ right).reshape(T, r, d, d, -1).transpose(0, 1, 3, 2, 4)
        A[:, :, :, :, :, j, :] = products[..., : r * d].reshape(T, r, d, d, r, d)
        b += products[..., r * d + j]
    size = r * d * d
    flat = A.reshape(T, size, size)
    if excess is not None:
        flat -= excess
    frozen(A)
    frozen(b)
    return TrialEquations(frozen(flat), frozen(b.reshape(T, size)), *names_and_units(kind, d, r))


def names_and_units(
    kind: Kind, d: int, matrices: int = 3
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of the parameters: M, B, K, then R for a delayed displacement."""
    names = parameter_names(d)
    units = tuple(UNITS[kind][name[0]] for name in names)
    if matrices == 3:
        return names, units
    stiffness = UNITS[kind]["K"]
    return (*names, *element_names("R", d)), (*units, *(stiffness,) * (d * d))


# Expected motion of a trial, from the other trials: instruments free of its noise.
#
# The noise of a trial's own position makes its regressors larger than the motion and the estimate
# smaller than the truth; noise of other trials does not.

#: The shared course is used if it explains at least this much of every trial's displacement.
LEAST_SHARED = 0.8
#: Courses form separate groups if the gap between them is so many times the unlikeness within each,
#: and more than this.
APART: Final = 4.0
LEAST_APART: Final = 1e-3
#: Fewest trials of a group: with fewer a gap between courses may be chance.
FEWEST_OF_A_COURSE: Final = 8


@dataclass(frozen=True, eq=False)
class SharedCourse:
    """Course over time shared by all displacements, or by each of several groups of them.

    `along` (T, d): amplitude of each trial's course along each axis.
    `groups`: rows of the trials of each course; all trials if there is one course.
    """

    along: FloatArray
    groups: tuple[IntArray, ...]

    @classmethod
    def of(cls, equation: ModalEquation) -> SharedCourse | None:
        """Shared course of an equation's trials; None if they are few or unlike."""
        displacement = equation.motion[:, 2]
        all_rows = (np.arange(len(displacement)),)
        if len(displacement) < 3:
            return None
        # if trials of a group share no course, as with a hand that the person moves, do not split
        for groups in (_apart(displacement), all_rows):
            along = _along(displacement, groups)
            if along is not None:
                return cls(along, groups)
        return None

    def expected(self, motion: FloatArray) -> FloatArray:
        """Expected motion (T, r, d, n) of every trial, from the other trials of its course."""
        # (T, r, n): motion along the trial's own direction, weighted by its size
        parts = (motion * self.along[:, None, :, None]).sum(axis=2)
        power = (self.along**2).sum(axis=1)
        others = np.empty(parts.shape)
        for rows in self.groups:
            others_power = power[rows].sum() - power[rows]
            others[rows] = (parts[rows].sum(axis=0) - parts[rows]) / others_power[:, None, None]
        return np.asarray(others[:, :, None, :] * self.along[:, None, :, None])


def _along(displacement: FloatArray, groups: tuple[IntArray, ...]) -> FloatArray | None:
    """Amplitudes of displacements (T, d, n) along their group's course; None if one differs."""
    T, d, n = displacement.shape
    along = np.empty((T, d))
    for rows in groups:
        # the course (n,) that explains most displacement over trials and axes
        own = displacement[rows].reshape(-1, n)
        along[rows] = displacement[rows] @ np.linalg.eigh(own.T @ own)[1][:, -1]
    whole = np.maximum((displacement**2).sum(axis=(1, 2)), 1e-300)
    explained = (along**2).sum(axis=1) / whole
    return along if explained.min() >= LEAST_SHARED else None


def _apart(displacement: FloatArray) -> tuple[IntArray, ...]:
    """Rows of groups of displacements (T, d, n) whose courses over time differ from all others.

    A soft servo makes courses of one command unlike each other, but without a gap between them.
    """
    # the course (n,) that explains most of each trial: along the main axis u of D D^T (d, d)
    u = np.linalg.eigh(displacement @ displacement.transpose(0, 2, 1))[1][:, :, -1]
    course = (u[:, None] @ displacement)[:, 0]
    course /= np.maximum(np.linalg.norm(course, axis=1, keepdims=True), 1e-300)
    remaining: IntArray = np.arange(len(course))
    groups: list[IntArray] = []
    while len(remaining) >= 2 * FEWEST_OF_A_COURSE:
        unlike = 1 - np.minimum((course[remaining] @ course[remaining[0]]) ** 2, 1.0)
        order = np.argsort(unlike, kind="stable")
        near, far = unlike[order[:-1]] + LEAST_APART, unlike[order[1:]]
        gap = int(np.argmax(far / near))
        few = min(gap + 1, len(remaining) - gap - 1) < FEWEST_OF_A_COURSE
        if few or far[gap] < APART * near[gap]:
            break
        groups.append(remaining[np.sort(order[: gap + 1])])
        remaining = remaining[np.sort(order[gap + 1 :])]
    return (*groups, remaining)


def expected_motion(equation: ModalEquation) -> FloatArray | None:
    """Regressors (T, r d, n) of every trial expected from the others; None if they are unlike.

    The motion is the shared course over time of the other trials, along the trial's own direction.
    Disturbances of one group have one course even if every direction was tried only once. If trials
    have several courses, each is that of the trials that share it.
    """
    shared = SharedCourse.of(equation)
    if shared is None:
        return None
    expected = shared.expected(equation.motion)
    return expected.reshape(equation.trials, -1, equation.modes.count)


def by_course(equation: ModalEquation) -> ModalEquation:
    """The equation with separate disturbances for each course over time and each direction."""
    shared = SharedCourse.of(equation)
    if equation.disturbance is None or shared is None or len(shared.groups) == 1:
        return equation
    course = np.zeros(equation.trials, dtype=np.int64)
    for number, rows in enumerate(shared.groups):
        course[rows] = number
    both = np.unique(equation.disturbance * len(shared.groups) + course, return_inverse=True)[1]
    return replace(equation, disturbance=both.astype(np.int64))


def mean_of_others(columns: FloatArray, labels: IntArray) -> FloatArray:
    """Mean (T, ...) over the other trials with the same label; zero if there are none."""
    total = np.zeros((int(labels.max()) + 1, *columns.shape[1:]))
    np.add.at(total, labels, columns)
    others = np.bincount(labels)[labels] - 1
    mean = (total[labels] - columns) / np.maximum(others, 1)[:, None, None]
    return np.where((others > 0)[:, None, None], mean, 0.0)
