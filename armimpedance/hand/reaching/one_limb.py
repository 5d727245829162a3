"""Check of the session: one limb and one rig from the first reach to the last.

    y_n + X_n theta + w_n E_n g = (torque of the person's own movement)
    E_n = [X_M theta_M, X_B theta_B, X_K theta_K]

g (3,) are the relative changes of inertia, B and K along a course w: 0 before a trial and 1 from it
on, or rising from the first trial to the last. With six numbers they are those of the force along
each axis of the hand. Inertia does not change while a person is measured, and is the same in all
phases and conditions.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import NotIdentifiableError
from armimpedance.core.findings import Finding
from armimpedance.hand.reaching.equation import (
    INERTIAL,
    REFLEX,
    STIFFNESS,
    STIFFNESS_CHANGE,
    STIFFNESS_CURVE,
    VISCOSITY,
    VISCOSITY_CHANGE,
    VISCOSITY_CURVE,
    ReachEquations,
    equations_of,
    orthonormal,
    projected,
    terms_of,
)
from armimpedance.hand.reaching.solve import PhaseSolution, further, solve
from armimpedance.hand.reaching.windows import LEAST_PUSHED, PhaseWindows
from armimpedance.numerics.criticism import HAND_WORDS, TrialsChange, clearest_finding

#: Unknowns that change together: of inertia, B and K.
_TOGETHER: Final = (
    np.r_[INERTIAL],
    np.r_[VISCOSITY, VISCOSITY_CHANGE, VISCOSITY_CURVE],
    np.r_[STIFFNESS, STIFFNESS_CHANGE, STIFFNESS_CURVE, REFLEX],
)
#: Number of places of a change that are tried, none nearer to an end than MARGIN, a share of the
#: session.
PLACES: Final = 20
#: A phase is tested if there are so many times the fewest pushes of a fit before and after a
#: change.
AMPLE: Final = 1.5
#: Standard errors from which on a change is reported: some sixty are tried, with errors from few
#: trials.
LIMIT: Final = 5.5
MARGIN: Final = 0.15


@dataclass(frozen=True, eq=False)
class _Phase:
    """Equations of a phase, their solution, and E of all axes (n, R, 3) and of each (n, R, 6)."""

    windows: PhaseWindows
    equations: ReachEquations
    solution: PhaseSolution
    of_all: FloatArray
    of_axes: FloatArray

    @classmethod
    def of(cls, windows: PhaseWindows) -> _Phase:
        """Solve a phase.

        Raises NotIdentifiableError: the pushes do not determine M, B and K.
        """
        equations = equations_of(windows)
        solution = solve(equations)
        # torques (n, S, 2) of inertia, B and K
        raw = terms_of(windows)
        torques = [raw[..., own] @ solution.theta[own] for own in _TOGETHER]
        jacobian = windows.arm.jacobian(windows.part("angle"))
        back = np.linalg.inv(jacobian)
        along = []
        for torque in torques:
            # J^T e_i e_i^T J^-T tau, the part of a torque that is a force along axis i
            force = np.einsum("nsji,nsj->nsi", back, torque)
            along += [jacobian[..., i, :] * force[..., i, None] for i in range(2)]
        of_all, of_axes = (
            np.stack([projected(windows.lag_s, one) for one in each], axis=-1)
            for each in (torques, along)
        )
        return cls(windows, equations, solution, of_all, of_axes)


def check_one_limb(phases: Sequence[PhaseWindows]) -> tuple[Finding, ...]:
    """The finding "session" of all phases; empty if the pushes do not determine it."""
    numbers = np.unique(np.concatenate([windows.trial for windows in phases]))
    try:
        solved = [_Phase.of(windows) for windows in phases]
    except (NotIdentifiableError, np.linalg.LinAlgError):
        return ()
    changes: dict[str, list[TrialsChange]] = {"": [], "x": [], "y": []}
    for first, course in _courses(len(numbers)):
        weights = [course[np.searchsorted(numbers, one.windows.trial)] for one in solved]
        for axis, g, sd in (*_along(solved, weights, ("",)), *_along(solved, weights, ("x", "y"))):
            others = g[1:], sd[1:], LIMIT
            changes[axis].append(TrialsChange(float(g[0]), float(sd[0]), first, *others))
    if not all(changes.values()):
        return ()
    clearest = {
        axis: max(candidates, key=lambda one: abs(one.size) / one.error)
        for axis, candidates in changes.items()
    }
    return clearest_finding(clearest, [f"trial {int(n)}" for n in numbers], HAND_WORDS)


def _along(
    solved: Sequence[_Phase], weights: Sequence[FloatArray], axes: Sequence[str]
) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Yield each axis with changes (3,) of all phases, weighted by their precisions, and errors."""
    k = 3 * len(axes)
    precision, right = np.zeros((k, k)), np.zeros(k)
    for phase, w in zip(solved, weights, strict=True):
        after = w[phase.windows.pushed] > 0.5
        if min(after.sum(), (~after).sum()) < AMPLE * LEAST_PUSHED:
            continue
        try:
            g, C = _changes(phase, phase.of_all if k == 3 else phase.of_axes, w)
            precision, right = precision + np.linalg.inv(C), right + np.linalg.solve(C, g)
        except (NotIdentifiableError, np.linalg.LinAlgError):
            continue
    if precision.any():
        covariance = np.linalg.inv(precision)
        g, sd = covariance @ right, np.sqrt(np.diag(covariance))
        for i, axis in enumerate(axes):
            yield axis, g[i :: len(axes)], sd[i :: len(axes)]


def _courses(n: int) -> Iterator[tuple[int | None, FloatArray]]:
    """Yield the first trial of a change (None for a drift), and w (n,)."""
    for first in np.unique(np.linspace(MARGIN * n, (1 - MARGIN) * n, PLACES).astype(int)):
        yield int(first), (np.arange(n) >= first).astype(float)
    yield None, np.linspace(0.0, 1.0, n)


def _changes(phase: _Phase, E: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """g (k,), relative to the values before, and its covariance; E (n, R, k), w (n,).

    Raises NotIdentifiableError: the pushes do not determine them.
    """
    equations, n = phase.equations, phase.equations.trials
    # means and history may differ after the change
    nuisance = orthonormal(np.hstack([equations.nuisance, w[:, None] * equations.nuisance]))

    def without(values: FloatArray) -> FloatArray:
        flat = values.reshape(n, -1)
        return np.asarray(flat - nuisance @ (nuisance.T @ flat)).reshape(values.shape)

    U = np.hstack([equations.instruments, w[:, None] * equations.instruments])
    wider = replace(
        equations,
        X=without(np.concatenate([equations.X, w[:, None, None] * E], axis=-1)),
        y=without(equations.y),
        instruments=orthonormal(without(U)),
        nuisance=nuisance,
    )
    before, g, C = further(wider, phase.solution)
    whole, axes = phase.solution.theta, len(g) // len(_TOGETHER)
    ratios = [before[own] @ whole[own] / (whole[own] @ whole[own]) for own in _TOGETHER]
    scale: FloatArray = np.repeat(ratios, axes)
    return g / scale, C / np.outer(scale, scale)
