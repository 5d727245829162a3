"""Result of a method at one phase, at joints and hand, and checks of the data against the model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import Level
from armimpedance.core.estimates import ImpedanceEstimate, Quality
from armimpedance.hand.reaching.course import inertia_rows, inertial_gradients
from armimpedance.hand.reaching.equation import INERTIAL, N_UNKNOWN, STIFFNESS, ReachEquations
from armimpedance.hand.reaching.solve import InertiaPrior, PhaseSolution, solve
from armimpedance.hand.reaching.windows import PhaseWindows
from armimpedance.limb.arm import TwoLinkArm

# From the joints to the hand of an arm that moves: ``-dF/da``, ``-dF/dv``, ``-dF/dx``.
# The hand's force is that of the muscles minus that of the moving links,
#
#     J^T F = tau - K_j dq - B_j dqd - Y(q, qd, qdd) phi,
# and the joints' angles, rates and accelerations follow from the hand's, A = J^-1, N = dJ/dt:
#
#     dq = A dx,  dqd = A dv - A N A dx,  dqdd = A da - A P A dx - 2 A N dqd.
# So the hand's B and K contain the Coriolis terms and the turning of the arm, and are not
# symmetric. These terms vanish at rest, where K is given by the formula for postures with its force
# term.

#: Step of the numerical difference in `turning` (rad).
_STEP_RAD = 1e-4


@dataclass(frozen=True)
class Instant(FrozenRecord):
    """One instant of the undisturbed reach.

    `angle`, `rate`, `acceleration` (2,): rad, rad/s, rad/s^2.
    `hand`, `velocity`, `force` (2,): from the shoulder, m; m/s; by the limb on what it holds, N.
    """

    angle: Annotated[FloatArray, "2"]
    rate: Annotated[FloatArray, "2"]
    acceleration: Annotated[FloatArray, "2"]
    hand: Annotated[FloatArray, "2"]
    velocity: Annotated[FloatArray, "2"]
    force: Annotated[FloatArray, "2"]


@dataclass(frozen=True)
class HandPlace:
    """The same instant of n free reaches.

    `states` tuple of (n, 2): the fields of an `Instant`.
    """

    states: tuple[FloatArray, ...]

    @property
    def mean(self) -> Instant:
        """Mean over reaches: the undisturbed reach."""
        return Instant(*(x.mean(axis=0) for x in self.states))

    def scatter(self, value: Callable[[Instant], FloatArray]) -> FloatArray:
        """Covariance (p, p) of ``value`` (p,) of the mean, by the jackknife over reaches."""
        n = len(self.states[0])
        # means without one (n, d): (n m - x_i) / (n - 1)
        without = [(n * x.mean(axis=0) - x) / (n - 1) for x in self.states]
        values = np.stack([value(Instant(*parts)) for parts in zip(*without, strict=True)])
        values = values - values.mean(axis=0)
        return np.asarray((n - 1) / n * values.T @ values)


#: Channels of an `Instant`, in its order.
INSTANT: Final = ("angle", "rate", "joint_acceleration", "hand", "velocity", "force")


def where_of(windows: PhaseWindows) -> HandPlace:
    """Free reaches at the middle of the window."""
    return HandPlace(tuple(windows.part(name)[~windows.pushed, windows.middle] for name in INSTANT))


def instant_of(windows: PhaseWindows) -> Instant:
    """The undisturbed reach at the middle of the window."""
    return where_of(windows).mean


def at_level(
    level: Level, arm: TwoLinkArm, where: HandPlace, theta: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """M, B and K row by row (12,) and their covariance, from phi, K_j and B_j (11,).

    The covariance includes the scatter of the free reaches, from which the place of the hand is
    estimated.
    """
    at = where.mean
    if level == "hand":
        weights, constant = to_hand(arm, at)
        scatter = where.scatter(lambda other: _hand_matrices(arm, other, theta, with_force=True))
    else:
        weights, constant = joint_weights(at), np.zeros(12)
        scatter = where.scatter(lambda other: joint_weights(other) @ theta)
    # values (12,) = W (12, 11) theta (11,) + constant
    return weights @ theta + constant, weights @ covariance @ weights.T + scatter


def to_hand(arm: TwoLinkArm, at: Instant) -> tuple[FloatArray, FloatArray]:
    """The hand's M, B, K as a linear function of the joints' unknowns.

    Parameters
    ----------
    arm : TwoLinkArm
        Its lengths.
    at : Instant

    Returns
    -------
    weights : (12, 11)
        Of phi, K_j and B_j (in the order of `equation`).
    constant : (12,)
        Contribution of the force on the hand: M, B, K row by row.
    """
    columns = [_hand_matrices(arm, at, unit, with_force=False) for unit in np.eye(11)]
    constant = _hand_matrices(arm, at, np.zeros(11), with_force=True)
    return np.stack(columns, axis=1), constant


def joint_weights(at: Instant) -> FloatArray:
    """The joints' M, B, K row by row as a linear function (12, 11) of the unknowns."""
    weights = np.zeros((12, 11))
    weights[:4, :3] = inertia_rows(at.angle).reshape(4, 3)
    weights[4:8, 7:11] = np.eye(4)
    weights[8:12, 3:7] = np.eye(4)
    return weights


def _hand_matrices(
    arm: TwoLinkArm, at: Instant, unknowns: FloatArray, with_force: bool
) -> FloatArray:
    """M, B, K (12,) of the hand for these unknowns (11,)."""
    phi, K_j, B_j = unknowns[:3], unknowns[3:7].reshape(2, 2), unknowns[7:].reshape(2, 2)
    A = np.linalg.inv(arm.jacobian(at.angle))
    N, P = arm.jacobian_rate(at.angle, at.rate), turning(arm, at)
    gradients = inertial_gradients(at.angle, at.rate, at.acceleration)
    by_angle, by_rate = (part @ phi for part in gradients)
    M_j = inertia_rows(at.angle) @ phi
    K_q, B_q = K_j + by_angle, B_j + by_rate
    if with_force:
        # Gamma_ij = sum_k d2p_k/dq_i dq_j F_k, (2, 2)
        K_q = K_q + np.einsum("kij,k->ij", arm.jacobian_derivative(at.angle), at.force)
    # M = A^T M_j A, (2, 2); B and K collect what multiplies dv and dx
    turn = A @ N @ A
    M = A.T @ M_j @ A
    B = A.T @ (B_q @ A - 2 * M_j @ turn)
    K = A.T @ (K_q @ A - B_q @ turn - M_j @ A @ P @ A + 2 * M_j @ turn @ N @ A)
    return np.concatenate([M, B, K], axis=None)


def turning(arm: TwoLinkArm, at: Instant) -> FloatArray:
    """Derivative ``d(J qdd + dJ/dt qd)/dq``, (2, 2), at constant rates and accelerations."""

    def value(q: FloatArray) -> FloatArray:
        return np.asarray(
            arm.jacobian(q) @ at.acceleration + arm.jacobian_rate(q, at.rate) @ at.rate
        )

    steps = _STEP_RAD * np.eye(2)
    columns = [(value(at.angle + s) - value(at.angle - s)) / (2 * _STEP_RAD) for s in steps]
    return np.stack(columns, axis=1)


@dataclass(frozen=True)
class PhaseFit(FrozenRecord):
    """M, B and K at one level in the middle of a window.

    `covariance` (12, 12).
    `values` (12,): M, B, K row by row; the limb's own.
    `condition`: of the scaled normal equations.
    `explained`: share of the mean response to the pushes that the model describes.
    """

    level: Level
    values: Annotated[FloatArray, "12"]
    covariance: Annotated[FloatArray, "12 12"]
    dof: float
    condition: float
    rank: int
    explained: float
    warnings: tuple[str, ...] = ()
    provenance: tuple[str, ...] = ()


#: Fit of one phase from its windows, the requested level, and the prior of the inertia.
FitPhase = Callable[[PhaseWindows, Level, InertiaPrior | None], PhaseFit]


@dataclass(frozen=True)
class ReachMethod:
    """An estimator of a moving hand's impedance.

    `assumes`: condition under which it is right, in one sentence.
    `fit`: `FitPhase`.
    `levels`: the levels for which it estimates M, B and K.
    `throughout`: True if it accepts pushes that go on throughout the reach.
    """

    assumes: str
    reference: str
    fit: FitPhase
    levels: tuple[Level, ...] = ("hand",)
    throughout: bool = False


def to_estimate(
    fit: PhaseFit, windows: PhaseWindows, method: str, keys: Mapping[str, Any]
) -> ImpedanceEstimate:
    """Convert the fit of one phase to an `ImpedanceEstimate`."""
    lag = windows.lag_s[windows.middle]
    note = f"told for {1e3 * lag:.0f} ms after the push's onset, window {windows.lag_s[-1]:.3g} s"
    pushed = int(windows.pushed.sum())
    return estimate_at(
        replace(fit, provenance=(note, *notes_of(windows), *fit.provenance)),
        instant_of(windows),
        windows.shoulder_m,
        (pushed, pushed * 2 * len(windows.lag_s)),
        method,
        keys,
    )


def notes_of(windows: PhaseWindows) -> tuple[str, ...]:
    """Notes on the free reaches."""
    return (f"{int((~windows.pushed).sum())} free reaches", *windows.notes)


def estimate_at(
    fit: PhaseFit,
    at: Instant,
    shoulder_m: FloatArray,
    counts: tuple[int, int],
    method: str,
    keys: Mapping[str, Any],
) -> ImpedanceEstimate:
    """Convert the fit at one instant; `counts` are pushed trials and rows."""
    M, B, K = fit.values.reshape(3, 2, 2)
    quality = Quality(
        n_trials=counts[0],
        n_rows=counts[1],
        multiple_correlation=float(np.sqrt(max(fit.explained, 0.0))),
        vaf=fit.explained,
        cond_raw=fit.condition,
        cond_scaled=fit.condition,
        rank=fit.rank,
        residual_sd=0.0,
    )
    return ImpedanceEstimate(
        level=fit.level,
        method=method,
        inertia=M,
        viscosity=B,
        stiffness=K,
        covariance=fit.covariance,
        dof=fit.dof,
        quality=quality,
        keys=keys,
        position=at.hand + shoulder_m,
        force=at.force,
        joint_angles=at.angle,
        shoulder_m=shoulder_m,
        warnings=fit.warnings,
        provenance=fit.provenance,
    )


# Two checks of the data of one phase against the model, and their consequences.
# First: is the residual response to the pushes, after M, B and K, significant? A reflex, a slack
# muscle or a wrong geometry makes it so; the intervals are then widened. Second: does the stated
# inertia agree with the one estimated from the pushes? If not, it is not used.

#: Significance level of both checks.
SELDOM: Final = 0.01


@dataclass(frozen=True)
class DoubtedPhase:
    """A solution corrected by the checks, with their warnings."""

    solution: PhaseSolution
    warnings: tuple[str, ...]
    provenance: tuple[str, ...]


def doubts_of(
    equations: ReachEquations, solution: PhaseSolution, prior: InertiaPrior | None
) -> DoubtedPhase:
    """Check the residual response and the stated inertia.

    `solution`: with the prior of the inertia, if there is one.
    """
    warnings: list[str] = []
    provenance = ["inertia fitted to the pushes" if prior is None else "inertia as told"]
    if prior is not None:
        free = solve(equations)
        p_inertia = _against(free, prior)
        provenance.append(_sensitivity(solution, free))
        if p_inertia < SELDOM:
            warnings.append(
                "the inertia that was told is not the one that the pushes show "
                f"(p = {p_inertia:.1g}): the pushes' own is used"
            )
            solution = free
    widened, excess, p = _widened(equations, solution)
    if p < SELDOM:
        warnings.append(
            f"M, B and K leave a response to the pushes (p = {p:.1g}), such as a reflex's: "
            f"intervals are {excess:.2g} times as wide"
        )
        solution = widened
    return DoubtedPhase(solution, tuple(warnings), tuple(provenance))


def _against(free: PhaseSolution, prior: InertiaPrior) -> float:
    """P-value of the difference between the estimated and the stated inertia."""
    from scipy.stats import f

    difference = free.theta[INERTIAL] - prior.inertial
    C = free.covariance[INERTIAL, INERTIAL] + prior.covariance
    # Hotelling: T^2 = d^T C^-1 d, (3,) (3, 3) (3,)
    squared = float(difference @ np.linalg.solve(C, difference))
    return float(f.sf(squared / 3, 3, free.dof))


def _sensitivity(with_it: PhaseSolution, free: PhaseSolution) -> str:
    K, own = with_it.theta[STIFFNESS], free.theta[STIFFNESS]
    percent = 100 * np.linalg.norm(K - own) / np.linalg.norm(K)
    return f"with the pushes' own inertia K would be {percent:.2g} % of itself elsewhere"


def _widened(
    equations: ReachEquations, solution: PhaseSolution
) -> tuple[PhaseSolution, float, float]:
    """Solution with intervals widened for the residual response; the factor, and its p-value.

    The residuals' part that is linear in the d instruments, (d, R), whitened by W, is chi-square
    with ``d R - p`` degrees of freedom if the model holds; with W from few trials, approximately F.
    """
    from scipy.stats import f

    residual = equations.along_direction(solution.residual)
    squared = float(np.sum((residual @ solution.weight) * residual))
    rows = solution.residual.shape[1]
    count = equations.instruments.shape[1]
    dof = count * rows - N_UNKNOWN
    trials = equations.trials - equations.nuisance.shape[1] - count
    # Hotelling's correction for a covariance of `rows` rows from few trials
    rest = max(trials - rows + 1, 4)
    ratio = squared / dof * rest / trials
    p = float(f.sf(ratio, dof, rest))
    excess = float(np.sqrt(max(squared / dof, 1.0)))
    covariance: FloatArray = solution.covariance * excess**2
    scatter: FloatArray = solution.scatter * excess**2
    return replace(solution, covariance=covariance, scatter=scatter), excess, p
