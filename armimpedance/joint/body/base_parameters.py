"""Base parameters: the combinations of inertial parameters that a motion can show.

``W phi = W_J (phi_J + K phi_D)``: columns D of the regressor are combinations ``W_D = W_J K`` of
the others, so only ``b = phi_J + K phi_D`` can be estimated. The rank comes from the pivoted
QR of the column-scaled regressor. The columns J are then chosen in the order of the columns, with
segments from the root outwards, so that a base parameter is named after its segment nearest to the
root. Essential base parameters belong to the structure and need a motion that excites all of them;
data-dependent ones belong to one regressor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.linalg import qr, solve_triangular

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import EstimationError, InputError, RecordError, check_number
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body.equations import BodyEquations
from armimpedance.joint.body.regressor import regressor, term_columns
from armimpedance.joint.body.rows import RowChoice
from armimpedance.limb.arm import skeleton_model

#: Relative singular value of the scaled regressor below which a direction counts as not shown.
TOLERANCE = 1e-8
#: Coefficients below this are set to zero as rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class BaseParameters(FrozenRecord):
    """Base parameters ``b = mapping @ phi``, with names and texts.

    `names`: leading inertial parameter or joint term of each.
    `expressions`: texts such as ``m_thigh_right + 0.31 m_shank_right``.
    `leading` (b,) int: indices of the columns J.
    `mapping` (b, p): 1 at the leading column.
    `null_space` (p, p - b): ``mapping @ null_space = 0``, directions that no such motion can show.
    """

    names: Annotated[tuple[str, ...], "b"]
    units: Annotated[tuple[str, ...], "b"]
    expressions: Annotated[tuple[str, ...], "b"]
    leading: Annotated[IntArray, "b"]
    mapping: Annotated[FloatArray, "b p"]
    null_space: Annotated[FloatArray, "p _"]

    def __post_init__(self) -> None:
        super().__post_init__()
        if sum(np.shape(self.null_space)) != 2 * np.shape(self.mapping)[1] - self.rank:
            raise RecordError(f"null space of shape {np.shape(self.null_space)}", expected="p - b")

    @property
    def rank(self) -> int:
        """Number of base parameters."""
        return len(self.names)

    def of(self, phi: FloatArray) -> FloatArray:
        """Base parameters (b,) of all parameters (p,)."""
        # b (b,) = mapping (b, p) phi (p,)
        return np.asarray(self.mapping @ phi)

    def lift(self, base: FloatArray) -> FloatArray:
        """Parameters (p,) with this base (b,) and zeros outside the leading columns."""
        phi = np.zeros(self.mapping.shape[1])
        phi[self.leading] = base
        return phi


def base_parameters(
    triangle: FloatArray,
    names: tuple[str, ...],
    units: tuple[str, ...],
    *,
    tolerance: float = TOLERANCE,
) -> BaseParameters:
    """Data-dependent base parameters from the triangle of a regressor ``W = Q R``.

    Parameters
    ----------
    triangle : (p, p)
        The triangle R.
    names, units : tuple of p str
        Names and units of all parameters.
    tolerance : float
        Relative singular value below which a direction counts as not shown.

    Returns
    -------
    BaseParameters

    Raises
    ------
    InputError
        The regressor is zero.
    EstimationError
        The rank is not clear at this tolerance.
    """
    p = len(names)
    R = np.asarray(np.linalg.qr(triangle[:, :p], mode="r"))
    lengths = np.linalg.norm(R, axis=0)
    if not lengths.any():
        raise InputError("the regressor is zero: nothing moves and nothing weighs")
    # columns that are zero up to rounding
    silent = lengths <= tolerance * 1e-3 * lengths.max()
    scale = np.where(silent, np.inf, lengths)
    scaled = R / scale
    diagonal = np.abs(np.diag(qr(scaled, mode="r", pivoting=True)[0]))
    rank = int((diagonal > tolerance * diagonal[0]).sum())
    leading = _independent(scaled, tolerance)
    if len(leading) != rank:
        raise EstimationError(
            f"rank {rank} by pivoting, {len(leading)} in order: the rank is not clear "
            f"at a tolerance of {tolerance:g}"
        )
    return _grouped(scaled, scale, leading, names, units)


def essential_base_parameters(
    skeleton: Skeleton, choice: RowChoice | None = None, *, seed: int = 0
) -> BaseParameters:
    """Base parameters of the structure, from random coordinates, velocities and accelerations.

    Parameters
    ----------
    skeleton : Skeleton
    choice : RowChoice, optional
        Default: the root's wrench for a floating root, all rows for a fixed one.
    seed : int
        Seed of the random motion.

    Returns
    -------
    BaseParameters

    Raises
    ------
    InputError
        The choice of rows does not match the skeleton.
    """
    choice = choice or RowChoice(rows="base" if skeleton.floating else "all")
    rng, n = np.random.default_rng(seed), len(skeleton.coordinates)
    rows = choice.indices(skeleton)
    p = len(choice.column_names(skeleton))
    samples = -(-4 * p // len(rows))
    q = rng.uniform(-1.2, 1.2, (samples, n))
    qd, qdd = rng.uniform(-3, 3, (samples, n)), rng.uniform(-30, 30, (samples, n))
    W = np.zeros((samples, len(rows), p))
    Y = regressor(skeleton_model(skeleton), q, qd, qdd, rows)
    W[:, :, : Y.shape[2]] = Y
    _put_terms(W, choice, skeleton, rows, (q, qd, qdd))
    triangle = np.asarray(np.linalg.qr(W.reshape(-1, p), mode="r"))
    return base_parameters(triangle, choice.column_names(skeleton), choice.column_units(skeleton))


def _put_terms(
    W: FloatArray,
    choice: RowChoice,
    skeleton: Skeleton,
    rows: IntArray,
    motion: tuple[FloatArray, FloatArray, FloatArray],
) -> None:
    columns = term_columns(choice.terms, skeleton, motion[0], motion, 1.0, None)
    first = W.shape[2] - len(choice.terms)
    for i, term in enumerate(choice.terms):
        at = int(np.flatnonzero(rows == skeleton.coordinate(term.coordinate))[0])
        W[:, at, first + i] = columns[:, i]


def _independent(scaled: FloatArray, tolerance: float) -> IntArray:
    """Indices of the columns that are not combinations of earlier ones, in order."""
    remaining, chosen = scaled.copy(), []
    for j in range(remaining.shape[1]):
        length = float(np.linalg.norm(remaining[:, j]))
        if length <= tolerance:
            continue
        chosen.append(j)
        direction = remaining[:, j] / length
        for _ in range(2):  # twice: a single pass leaves rounding along the direction
            remaining[:, j + 1 :] -= np.outer(direction, direction @ remaining[:, j + 1 :])
    return np.array(chosen, dtype=np.int64)


def _grouped(
    scaled: FloatArray,
    scale: FloatArray,
    leading: IntArray,
    names: tuple[str, ...],
    units: tuple[str, ...],
) -> BaseParameters:
    p = len(names)
    rest = np.setdiff1d(np.arange(p), leading)
    Q, R = np.linalg.qr(scaled[:, leading])
    # W_D (p, d) = W_J (p, b) K (b, d), both sides scaled
    K = solve_triangular(R, Q.T @ scaled[:, rest])
    K = K / scale[leading][:, None] * np.where(np.isinf(scale[rest]), 0.0, scale[rest])
    K[np.abs(K) < _ROUNDING] = 0.0
    mapping, null = np.zeros((len(leading), p)), np.zeros((p, len(rest)))
    mapping[np.arange(len(leading)), leading] = 1.0
    mapping[:, rest] = K
    null[leading], null[rest, np.arange(len(rest))] = -K, 1.0
    return BaseParameters(
        names=tuple(names[j] for j in leading),
        units=tuple(units[j] for j in leading),
        expressions=tuple(
            _text(row, lead, names) for row, lead in zip(mapping, leading, strict=True)
        ),
        leading=leading,
        mapping=mapping,
        null_space=null,
    )


def _text(row: FloatArray, lead: int, names: tuple[str, ...]) -> str:
    text = names[lead]
    for j in np.flatnonzero(row):
        if j == lead:
            continue
        size = f"{abs(row[j]):.4g}"
        text += f" {'+' if row[j] > 0 else '-'} {'' if size == '1' else size + ' '}{names[j]}"
    return text


# Choice of motions that excite the dynamics, by the condition of the column-scaled base regressor.
#
# The greedy choice starts from the motion of the lowest condition and adds the motion that lowers
# it most; the other motions are used for cross-validation.

#: Singular values below this share of the largest count as zero.
_NOTHING = 1e-12


@dataclass(frozen=True)
class MotionChoice(FrozenRecord):
    """Motions in the order in which they were chosen.

    Attributes
    ----------
    chosen : tuple of int
        Rows of the trial table (from 0).
    motions : tuple of str
        Names of these motions.
    conditions : tuple of float
        Condition of the regressor after each motion was added.
    alone : (T,)
        Condition of every motion alone; inf if it shows fewer parameters.
    """

    chosen: tuple[int, ...]
    motions: tuple[str, ...]
    conditions: tuple[float, ...]
    alone: Annotated[FloatArray, "T nan"]

    @property
    def rest(self) -> tuple[int, ...]:
        """Trials that are used for cross-validation."""
        return tuple(t for t in range(len(self.alone)) if t not in self.chosen)


def motion_conditions(equations: BodyEquations, base: BaseParameters) -> FloatArray:
    """Condition of every motion's column-scaled base regressor.

    Parameters
    ----------
    equations : BodyEquations
    base : BaseParameters

    Returns
    -------
    (T,)
        inf if a motion shows fewer parameters.
    """
    return np.array([_condition(r)[1] for r in _triangles(equations, base)])


def scaled_condition(equations: BodyEquations, base: BaseParameters) -> float:
    """Condition of the column-scaled base regressor of all motions together."""
    b = base.rank
    return _condition(_triangles(equations, base).reshape(-1, b))[1]


def choose_motions(
    equations: BodyEquations, base: BaseParameters, *, most: int = 4
) -> MotionChoice:
    """Add the motion that lowers the condition most, until `most` or no gain.

    Parameters
    ----------
    equations : BodyEquations
    base : BaseParameters
    most : int
        Largest number of motions.

    Returns
    -------
    MotionChoice

    Raises
    ------
    InputError
        No motions are requested.
    """
    check_number(most, f"{most} motions asked for", low=1)
    triangles = _triangles(equations, base)
    alone = np.array([_condition(r)[1] for r in triangles])
    chosen: list[int] = []
    reached: list[tuple[int, float]] = []
    so_far = np.empty((0, base.rank))
    while len(chosen) < min(most, len(triangles)):
        remaining = [t for t in range(len(triangles)) if t not in chosen]
        tried = [_condition(np.concatenate([so_far, triangles[t]])) for t in remaining]
        best = min(range(len(remaining)), key=lambda i: tried[i])
        if reached and tried[best] >= reached[-1]:
            break
        chosen.append(remaining[best])
        reached.append(tried[best])
        both = np.concatenate([so_far, triangles[remaining[best]]])
        so_far = np.asarray(np.linalg.qr(both, mode="r"))
    return MotionChoice(
        tuple(chosen),
        tuple(equations.motions[t] for t in chosen),
        tuple(condition for _, condition in reached),
        alone,
    )


def _triangles(equations: BodyEquations, base: BaseParameters) -> FloatArray:
    """Triangles (T, b, b) of the base regressor of every motion, with unweighted rows."""
    b = base.rank
    # W_base (R S, b) = W[:, leading]
    stack = equations.r[..., base.leading].reshape(equations.n_trials, -1, b)
    return np.asarray(np.linalg.qr(stack, mode="r"))


def _condition(stack: FloatArray) -> tuple[int, float]:
    """Number of directions that are not shown, and condition, of a column-scaled stack (n, b)."""
    lengths = np.linalg.norm(stack, axis=0)
    s = np.linalg.svd(stack / np.where(lengths > 0, lengths, 1.0), compute_uv=False)
    lost = int((s <= _NOTHING * s[0]).sum())
    return lost, float("inf") if lost else float(s[0] / s[-1])
