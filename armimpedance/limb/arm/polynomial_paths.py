"""Muscle paths as polynomials of the joint angles: lengths, moment arms, curvature.

L is positive in lengthening, so that ``dL = G dtheta`` (Tsuji 1997, eq. (5)) and tensions give the
torque ``tau = -G^T f`` (6): flexors have negative rows in G, extensors positive ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Final, Protocol

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, IntArray, frozen_array
from armimpedance.core.errors import InputError, NotIdentifiableError, check_number

#: Default stiffness per tension (1/m): Selen, Franklin and Wolpert 2009 (J Neurosci
#: 29:12606-12616), Table 1.
STIFFNESS_PER_TENSION: Final = 75.0


class MusclePaths(Protocol):
    """m muscles over n joints. All methods take leading batch axes: `q` is (..., n) in rad."""

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the m muscles."""

    @property
    def joints(self) -> int:
        """Number of joints n."""

    def moment_arms(self, q: ArrayLike) -> FloatArray:
        """Moment arms ``G = dL/dq``, m, (..., m, n)."""

    def curvature(self, q: ArrayLike) -> FloatArray:
        """Second derivatives ``d2L/dq2``, m, (..., m, n, n), symmetric in the last two axes."""


def check_angles(q: ArrayLike, n: int) -> FloatArray:
    """Return joint angles (..., n) as an array; refuse another shape and values not finite."""
    angles = np.asarray(q, dtype=float)
    if angles.ndim == 0 or angles.shape[-1] != n:
        raise InputError(f"joint angles of shape {angles.shape}", expected=f"{n} on the last axis")
    if not np.isfinite(angles).all():
        raise InputError("a joint angle is not finite", expected="finite numbers, rad")
    return angles


@dataclass(frozen=True)
class MuscularArm(FrozenRecord):
    """Muscles of an arm: paths, maximum tensions, and stiffness per tension.

    Attributes
    ----------
    name : str
    paths : MusclePaths
    max_tension : (m,)
        Tension of each muscle at full activation, N.
    stiffness_per_tension : float
        Ratio of a muscle's stiffness to its tension, 1/m.
    angle_range : (n, 2)
        Joint angles (rad) for which `paths` are valid.
    source : str
        Origin of the numbers, in words.
    sagittal : bool
        The arm moves in a plane in which gravity acts.
    """

    name: str
    paths: MusclePaths
    max_tension: Annotated[FloatArray, "m"]
    stiffness_per_tension: float
    angle_range: Annotated[FloatArray, "n 2"]
    source: str
    sagittal: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        have = (len(self.max_tension), len(self.angle_range))
        if have != (len(self.paths.muscles), self.paths.joints):
            raise InputError(
                f"arm {self.name}: {have[0]} tensions, {have[1]} ranges of angles",
                expected=f"{len(self.paths.muscles)} and {self.paths.joints}, as its paths",
            )
        if not (self.max_tension > 0).all():
            raise InputError(f"arm {self.name}: a muscle without tension", expected="max > 0 N")
        ratio = f"arm {self.name}: stiffness per tension {self.stiffness_per_tension}"
        check_number(self.stiffness_per_tension, ratio, above=0, unit="1/m")


# Muscle lengths that are polynomials of the joint angles; moment arms are their gradient.
#
# With lengths of order L + 1 the moment arms have order L, Tsuji (1997), eqs. (36)-(37). The source
# lets the two arms of a two-joint muscle be any two polynomials. Here both are derivatives of one
# length, so that the muscle is conservative and its curvature agrees with the arms.


@dataclass(frozen=True)
class PolynomialPaths(FrozenRecord):
    """m muscles over n joints, lengths up to a constant.

    Attributes
    ----------
    muscles : (m,) tuple of str
    exponents : (T, n) int
        Powers of the scaled angles in each of the T terms.
    coefficients : (m, T)
        Coefficients of the lengths, m.
    box : (n, 2)
        Joint angles (rad) that are scaled to -1 and 1.
    """

    muscles: Annotated[tuple[str, ...], "m"]
    exponents: Annotated[IntArray, "t n"]
    coefficients: Annotated[FloatArray, "m t"]
    box: Annotated[FloatArray, "n 2"]

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.exponents < 0).any():
            raise InputError("a negative power of an angle", expected="0 or more")
        if len(set(self.muscles)) != len(self.muscles):
            raise InputError("two muscles of one name", expected="different names")
        if not (self.box[:, 1] > self.box[:, 0]).all():
            raise InputError("an empty range of angles", expected="low < high, rad")

    @property
    def joints(self) -> int:
        """Number of joints n."""
        return self.exponents.shape[1]

    def lengths(self, q: ArrayLike) -> FloatArray:
        """Lengths (..., m) in m, up to a constant of each muscle."""
        return self._terms(q, np.zeros(self.joints, dtype=np.int64)) @ self.coefficients.T

    def moment_arms(self, q: ArrayLike) -> FloatArray:
        """Moment arms ``G = dL/dq``, m, (..., m, n)."""
        once = np.eye(self.joints, dtype=np.int64)
        columns = [self._terms(q, orders) @ self.coefficients.T for orders in once]
        return np.stack(columns, axis=-1)

    def curvature(self, q: ArrayLike) -> FloatArray:
        """``d2L/dq2``, m, (..., m, n, n)."""
        once, n = np.eye(self.joints, dtype=np.int64), self.joints
        elements = [
            self._terms(q, once[i] + once[j]) @ self.coefficients.T
            for i, j in product(range(n), repeat=2)
        ]
        return np.stack(elements, axis=-1).reshape(*elements[0].shape, n, n)

    def _terms(self, q: ArrayLike, orders: IntArray) -> FloatArray:
        """Derivatives (..., T) of all terms, `orders` (n,) times by each angle."""
        return _monomials(check_angles(q, self.joints), self.exponents, self.box, orders)


def _monomials(q: FloatArray, exponents: IntArray, box: FloatArray, orders: IntArray) -> FloatArray:
    half = (box[:, 1] - box[:, 0]) / 2
    u = (q - box.mean(axis=1)) / half
    value = np.ones((*q.shape[:-1], len(exponents)))
    for j, order in enumerate(orders):
        powers = exponents[:, j]
        value = value * u[..., j, None] ** np.maximum(powers - order, 0)
        # d^r/dq^r u^e = e (e - 1) ... (e - r + 1) u^(e - r) / half^r
        for r in range(order):
            value = value * (powers - r) / half[j]
    return value


def constant_paths(muscles: tuple[str, ...], G: ArrayLike) -> PolynomialPaths:
    """Return paths with constant moment arms G (m, n), in m; their lengths are linear."""
    arms = frozen_array(G, "G", (len(muscles), None))
    n = arms.shape[1]
    # with the box -1..1 rad the scaled angles equal the angles
    return PolynomialPaths(muscles, np.eye(n, dtype=np.int64), arms, np.tile([-1.0, 1.0], (n, 1)))


@dataclass(frozen=True)
class FittedPaths(FrozenRecord):
    """Polynomial paths and the misfit of their moment arms to the samples.

    `rms` (m, n): root mean square misfit of each muscle's arm at each joint, m.
    """

    paths: PolynomialPaths
    rms: Annotated[FloatArray, "m n"]


def fit_paths(
    muscles: tuple[str, ...],
    q: ArrayLike,
    G: ArrayLike,
    order: int,
    spans: ArrayLike,
    *,
    box: ArrayLike | None = None,
) -> FittedPaths:
    """Fit lengths to sampled moment arms, by least squares over all joints.

    Parameters
    ----------
    muscles : (m,) tuple of str
    q : (P, n)
        Postures, rad.
    G : (P, m, n)
        Moment arms dL/dq there, m.
    order : int
        Order of the moment arms; that of the lengths is one more.
    spans : (m, n) bool
        True for the joints on which a muscle's length depends.
    box : (n, 2), optional
        Angles (rad) that are scaled to [-1, 1]; default: the range of `q`.

    Returns
    -------
    FittedPaths

    Raises
    ------
    NotIdentifiableError
        The postures do not determine all coefficients of a muscle.
    """
    check_number(order, f"moment arms of order {order}", low=0)
    postures: FloatArray = frozen_array(q, "q", (None, None))
    P, n = postures.shape
    sampled: FloatArray = frozen_array(G, "G", (P, len(muscles), n))
    spanned: BoolArray = frozen_array(spans, "spans", (len(muscles), n), np.bool_)
    scaled = _range(postures) if box is None else frozen_array(box, "box", (n, 2))
    exponents = monomial_exponents(n, order + 1)
    once = np.eye(n, dtype=np.int64)
    # G (P, n) of a muscle = W (P, n, T) c (T,): the gradient of each term
    W = np.stack([_monomials(postures, exponents, scaled, orders) for orders in once], axis=1)
    coefficients = np.zeros((len(muscles), len(exponents)))
    for i, name in enumerate(muscles):
        used = ~exponents[:, ~spanned[i]].any(axis=1)
        if used.any():
            coefficients[i, used] = _solve(name, W[:, :, used], sampled[:, i], spanned[i])
    paths = PolynomialPaths(muscles, exponents, coefficients, scaled)
    rms = np.sqrt(np.mean((paths.moment_arms(postures) - sampled) ** 2, axis=0))
    return FittedPaths(paths, rms)


def monomial_exponents(n: int, degree: int) -> IntArray:
    """Powers (T, n) of all monomials of n angles with total degree 1 to `degree`.

    Parameters
    ----------
    n : int
        Number of angles.
    degree : int
        Highest total degree.

    Returns
    -------
    (T, n) int
    """
    exponents = [e for e in product(range(degree + 1), repeat=n) if 0 < sum(e) <= degree]
    return np.array(sorted(exponents, key=lambda e: (sum(e), e)), dtype=np.int64)


def _range(q: FloatArray) -> FloatArray:
    low, high = q.min(axis=0), q.max(axis=0)
    still = high - low < 1e-9
    return np.stack([np.where(still, low - 1, low), np.where(still, high + 1, high)], axis=1)


def _solve(name: str, W: FloatArray, G: FloatArray, spanned: BoolArray) -> FloatArray:
    """Solve ``W (P n, T) c (T,) = G (P n,)`` by least squares over the joints that are spanned."""
    rows = W[:, spanned].reshape(-1, W.shape[-1])
    coefficients, _, rank, _ = np.linalg.lstsq(rows, G[:, spanned].ravel(), rcond=1e-10)
    if rank < rows.shape[1]:
        raise NotIdentifiableError(
            f"muscle {name}: {len(W)} postures determine {rank} of {rows.shape[1]} coefficients of "
            "its length; take a lower order or more postures, off one line",
            (name,),
        )
    return np.asarray(coefficients)


# Polynomial lengths from moment arms of n joints, tabulated at any postures.

#: Highest order of the moment arms; a lower order is used if the postures do not determine it.
HIGHEST_ORDER: Final = 3
#: Largest misfit of a smooth length as a share of the muscle's own arms (rms), as for a table over
#: shoulder and elbow.
LARGEST_MISFIT: Final = 0.1
#: A joint is not spanned if all of a muscle's moment arms about it are smaller than this (m).
_NO_ARM_M: Final = 1e-6


def paths_of_table(
    muscles: tuple[str, ...], q: Sequence[FloatArray], G: Sequence[FloatArray]
) -> PolynomialPaths:
    """Fit lengths to tabulated moment arms.

    `muscles` (m,) tuple of str.
    `q` (m,) sequence of (P, n): postures of each muscle's rows, rad; the same for all.
    `G` (m,) sequence of (P, n): moment arms dL/dq there, m.
    Returns: paths whose box is the range of the postures.
    Raises InputError: a muscle has other postures than the first one, or moment arms that are not
    the gradient of a smooth length.
    Raises NotIdentifiableError: the postures do not determine even constant arms.
    """
    for name, of_muscle in zip(muscles, q, strict=True):
        if of_muscle.shape != q[0].shape or (of_muscle != q[0]).any():
            raise InputError(
                f"muscle {name} at other postures than {muscles[0]}",
                expected="all muscles at the same postures, in the same order",
            )
    arms = np.stack(G, axis=1)
    fitted = _highest(muscles, q[0], arms)
    size = np.sqrt((arms**2).sum(axis=2).mean(axis=0))
    misfit = np.sqrt((fitted.rms**2).sum(axis=1))
    for name, missed, of_muscle in zip(muscles, misfit, size, strict=True):
        if missed > LARGEST_MISFIT * of_muscle:
            raise InputError(
                f"muscle {name}: no smooth length has these moment arms (they miss by "
                f"{1e3 * missed:.2g} mm rms of {1e3 * of_muscle:.2g} mm)",
                expected=f"at most {100 * LARGEST_MISFIT:g} %: dG_i/dq_j and dG_j/dq_i are one",
            )
    return fitted.paths


def _highest(muscles: tuple[str, ...], q: FloatArray, G: FloatArray) -> FittedPaths:
    """Fit paths of the highest order with at least twice as many values as coefficients."""
    P, n = q.shape
    spans = (np.abs(G) > _NO_ARM_M).any(axis=0)
    for order in range(HIGHEST_ORDER, 0, -1):
        if n * P < 2 * len(monomial_exponents(n, order + 1)):
            continue
        try:
            return fit_paths(muscles, q, G, order, spans)
        except NotIdentifiableError:
            continue
    return fit_paths(muscles, q, G, 0, spans)
