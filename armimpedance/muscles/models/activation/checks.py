"""Checks of the rows of an activation model, and of fitted values that no muscle can have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.findings import Finding
from armimpedance.limb.arm import MuscularArm
from armimpedance.muscles.models.activation.equations import (
    ActivationEquations,
    power_slopes,
    powers,
)
from armimpedance.muscles.models.fitted_model import ElementQuality
from armimpedance.muscles.models.from_estimates import HandRows
from armimpedance.muscles.models.rows import JointRows

#: Joint angles (rad) within this of their median are one posture: moment arms change by some per
#: cent over .1 rad, less than they are known.
ONE_POSTURE_RAD = 0.05
#: Stiffness of an arm's joint lies between these (median of shoulder and elbow, N m/rad): a relaxed
#: elbow has .4 and more, an arm that holds a load some hundreds.
PLAUSIBLE = (0.05, 2000.0)
#: Points of the measured range at which a muscle's curve is looked at.
_POINTS = 101


def check_activation(rows: JointRows | HandRows, arm: MuscularArm, *, torque: bool) -> FloatArray:
    """Activations (P, m) of the arm's muscles.

    Raises InputError: no activation, another number of muscles than the arm, no torque where it is
    asked for.
    """
    muscles = arm.paths.muscles
    if rows.activation is None:
        raise InputError("rows without activation", expected=f"columns alpha_1..{len(muscles)}")
    if rows.activation.shape[1] != len(muscles):
        raise InputError(
            f"activations of {rows.activation.shape[1]} muscles",
            expected=f"{len(muscles)}, those of the arm {arm.name}: {', '.join(muscles)}",
        )
    if rows.activation_sd is not None and rows.activation_sd.shape != rows.activation.shape:
        raise InputError(f"activation_sd of shape {rows.activation_sd.shape}")
    if rows.activation_sd is not None and (rows.activation_sd < 0).any():
        raise InputError("a negative activation_sd", expected="0 or more")
    if torque and rows.torque is None:
        raise InputError(
            "torque asked for, but the rows have none", expected="rows with tau = J^T F"
        )
    return rows.activation


def check_rows(rows: JointRows, arm: MuscularArm, *, torque: bool) -> tuple[FloatArray, FloatArray]:
    """Activations (P, m) and the one posture (2,), the mean of all rows.

    Raises InputError: the same cases as in `check_activation`, or several postures.
    """
    rows.require_planar()
    activation = check_activation(rows, arm, torque=torque)
    median = np.median(rows.joint_angles, axis=0)
    off = np.abs(rows.joint_angles - median).max(axis=1)
    if (off > ONE_POSTURE_RAD).any():
        named = [rows.labels[i] for i in np.flatnonzero(off > ONE_POSTURE_RAD)]
        shown = ", ".join(named[:5]) + (f" and {len(named) - 5} more" if len(named) > 5 else "")
        raise InputError(
            f"more than one posture: {shown} up to {off.max():.2g} rad from the others",
            expected=f"rows within {ONE_POSTURE_RAD} rad",
        )
    return activation, rows.joint_angles.mean(axis=0)


def plausible_size(K: FloatArray) -> Finding:
    """Check that ``ss, se, ee`` (P, 3) of the stiffness are of the size that an arm can have."""
    size = float(np.median(K[:, [0, 2]]))
    low, high = PLAUSIBLE
    if low <= size <= high:
        return Finding("units", "ok", f"K of {size:.3g} N m/rad (median) is an arm's")
    sentence = (
        f"K of {size:.3g} N m/rad (median of shoulder and elbow) is no arm's: the unit, or the sign"
    )
    return Finding("units", "warning", sentence)


def falling_muscles(
    theta: FloatArray,
    reach: FloatArray,
    muscles: tuple[str, ...],
    equations: ActivationEquations,
) -> tuple[str, ...]:
    """Warnings for muscles whose stiffness falls below what it is at their least activation.

    Whether it is then negative depends on the constant part, which the data do not tell.

    `theta` (3 + m N, ...).
    `reach` (m, 2): measured range of activation.
    """
    N = equations.order
    c = theta[3 : 3 + equations.n_active].reshape(-1, N)
    alpha = np.linspace(reach[:, 0], reach[:, 1], _POINTS)
    f = (powers(alpha, N) * c).sum(axis=-1)
    rise = f - f[0]
    size = np.abs(rise).max(axis=0)
    findings = []
    for i in np.flatnonzero(rise.min(axis=0) < -1e-6 * np.maximum(size, 1e-12)):
        low = alpha[rise[:, i] < 0, i]
        findings.append(
            f"{muscles[i]}: its stiffness falls with activation, by up to "
            f"{-rise[:, i].min():.3g} N/m between {low[0]:.3g} and {low[-1]:.3g}"
        )
    return tuple(findings)


def unpredicted(quality: tuple[ElementQuality, ...]) -> tuple[str, ...]:
    """A warning that names elements whose left-out rows are predicted no better than noise."""
    lost = [q.element for q in quality if q.leave_one_out_r <= q.null_r]
    if not lost:
        return ()
    sentence = f"{', '.join(lost)}: rows left out are predicted no better than noise would be"
    return (f"{sentence}; is the arm the right one?",)


# Can these conditions tell the muscles apart?
#
# Two things can be missing. The activations themselves may be related (in co-contraction of one
# pattern they all rise together): the regressors lose rank. Or they differ, but by no more than
# what errors of the activation make: the rank is full and means nothing.
#
# The first is judged from the singular values of the regressors with unit columns: below 1e-3 of
# the largest they count as zero. Activation comes from EMG, relative to a maximum voluntary
# contraction, and is never better than some thousandths of its size; a smaller singular value would
# be made of such errors. The second is judged where errors of the activation are known, by the
# reliability of each direction: the part of its length that errors do not explain.

#: Singular values below this part of the largest count as zero.
RANK_TOLERANCE = 1e-3
#: Reliability below which a direction is refused, and below which it is warned of.
_REFUSED, _DOUBTFUL = 0.5, 0.9
#: A muscle takes part in a direction above this part of the largest weight.
_TAKES_PART = 0.1
#: Activations that differ by less do not vary.
_NO_CHANGE = 1e-6


@dataclass(frozen=True)
class ActivationRank:
    """Rank and condition of the regressors of K.

    `cond_raw`, `cond_scaled`: condition numbers of the regressors as given and with columns of unit
    length.
    """

    rank: int
    columns: int
    cond_raw: float
    cond_scaled: float
    warnings: tuple[str, ...] = ()


def activation_rank(equations: ActivationEquations, muscles: tuple[str, ...]) -> ActivationRank:
    """Refuse activations from which the coefficients cannot be told.

    Raises NotIdentifiableError: a muscle's activation does not vary, too few conditions, lost rank,
    or directions that errors of the activation explain.
    """
    _refuse_constant(equations.activation, muscles)
    X = _comparable_columns(equations)
    rows, p = X.shape
    if rows < p:
        raise NotIdentifiableError(
            f"{len(equations.outputs)} conditions give {rows} numbers for {p} coefficients "
            f"(order {equations.order}): more conditions or a lower order",
            muscles,
        )
    length = np.linalg.norm(X, axis=0)
    s, directions = np.linalg.svd(X / length)[1:]
    rank = int((s > RANK_TOLERANCE * s[0]).sum())
    if rank < p:
        # a null direction may be a mixture: any muscle that takes part in one of them
        names = _involved(np.sqrt((directions[rank:] ** 2).sum(axis=0)), equations, muscles)
        raise NotIdentifiableError(
            f"these activations cannot tell the muscles apart: rank {rank} of {p} at order "
            f"{equations.order} for {', '.join(names)}; their activations are related in all "
            f"{len(equations.outputs)} conditions: add conditions of other patterns, such as "
            "hand forces in several directions",
            names,
        )
    warnings = _reliability(equations, X, muscles)
    raw = np.linalg.svd(X, compute_uv=False)
    return ActivationRank(rank, p, float(raw[0] / raw[-1]), float(s[0] / s[-1]), warnings)


def _refuse_constant(activation: FloatArray, muscles: tuple[str, ...]) -> None:
    still = np.ptp(activation, axis=0) <= _NO_CHANGE
    if still.any():
        names = tuple(np.array(muscles)[still].tolist())
        raise NotIdentifiableError(
            f"the activation of {', '.join(names)} never varies: its effect on stiffness "
            "cannot be distinguished from a constant",
            names,
        )


def _comparable_columns(equations: ActivationEquations) -> FloatArray:
    """Regressors (P r, p); a torque counts as the stiffness that its tension stands for."""
    X = equations.columns(equations.activation)
    if equations.moment_arms is not None:
        X = np.where(equations.group[:, None] == 1, _torque_weight(equations) * X, X)
    return X.reshape(-1, X.shape[-1])


def _torque_weight(equations: ActivationEquations) -> float:
    """Stiffness (N m/rad) that stands for 1 N m: kappa times a typical moment arm."""
    arms = np.abs(np.asarray(equations.moment_arms))
    return equations.stiffness_per_tension * float(np.sqrt((arms[arms > 0] ** 2).mean()))


def _involved(
    weights: FloatArray, equations: ActivationEquations, muscles: tuple[str, ...]
) -> tuple[str, ...]:
    active = np.abs(weights[3 : 3 + equations.n_active]).reshape(len(muscles), -1).max(axis=1)
    return tuple(np.array(muscles)[active > _TAKES_PART * active.max()].tolist())


def _reliability(
    equations: ActivationEquations, X: FloatArray, muscles: tuple[str, ...]
) -> tuple[str, ...]:
    """Refuse or warn of directions v whose ``|X v|^2`` errors of the activation explain."""
    if not equations.activation_sd.any():
        return ()
    noise = _noise_gram(equations, X.shape[1])
    gram = X.T @ X
    length = np.sqrt(np.diag(gram))
    # noise v = (1 - reliability) gram v, the least reliable direction last
    unit = np.outer(length, length)
    explained, v = eigh(noise / unit, gram / unit)
    names = _involved(v[:, -1], equations, muscles)
    reliability = max(1 - float(explained[-1]), 0.0)
    where = f"the least certain combination of {', '.join(names)}"
    if reliability < _REFUSED:
        raise NotIdentifiableError(
            f"errors of the activation explain {100 - 100 * reliability:.0f} % of how {where} "
            f"varies at order {equations.order}: it determines no model; add conditions of "
            "other patterns, such as hand forces in several directions",
            names,
        )
    if reliability < _DOUBTFUL:
        return (
            f"errors of the activation explain {100 - 100 * reliability:.0f} % of how {where} "
            "varies: its coefficients are doubtful",
        )
    return ()


def _noise_gram(equations: ActivationEquations, p: int) -> FloatArray:
    """Expected ``E^T E`` (p, p), E what errors of the activation change in the regressors."""
    m, N = len(equations.patterns), equations.order
    slopes = power_slopes(equations.activation, N) * equations.activation_sd[..., None]
    reach = equations.reach.copy()
    if equations.moment_arms is not None:
        reach[:, 3:] *= _torque_weight(equations)
    # errors of different muscles are independent: blocks of N columns
    blocks = np.einsum("pmk,pml->mkl", slopes, slopes) * (reach**2).sum(axis=1)[:, None, None]
    gram = np.zeros((p, p))
    for i in range(m):
        at = slice(3 + i * N, 3 + (i + 1) * N)
        gram[at, at] = blocks[i]
    return gram
