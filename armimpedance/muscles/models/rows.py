"""Joint stiffness and viscosity of several conditions: what muscle models are fitted to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.limb.arm import FREE, HELD, IN_SPACE
from armimpedance.muscles.models.packed import elements, kept_elements, triple, triple_sd

# Errors that all rows of a fit have in common, in the covariance of what was fitted.
#
# Errors of single rows average out over many rows; a reflex, a gain or a length of the arm makes
# all rows wrong together. With the change d of the coefficients when the rows move by one standard
# deviation of such a cause, it adds ``d d^T`` to their covariance.

#: Part of the causes' variance, in the rows' own variances, that is followed.
_FOLLOWED: Final = 0.99


def shared_blocks(errors: Sequence[Mapping[str, FloatArray]], axes: int) -> FloatArray:
    """Errors of M, B and K of each row by each shared cause.

    A cause of one name is the same in all rows; a row that does not name it has none of it.

    `errors` sequence of mapping of str to (3 d^2,): of P rows, by the names of the causes.
    `axes`: d.
    Returns: (P, s, 3, d, d).
    """
    names = dict.fromkeys(name for one in errors for name in one)
    none = np.zeros(3 * axes**2)
    blocks = [[one.get(name, none) for name in names] for one in errors]
    return np.reshape(blocks, (len(errors), len(names), 3, axes, axes)).astype(float)


def main_errors(shared: FloatArray, sd: FloatArray | None) -> FloatArray:
    """The fewest errors (t, P, E) with nearly the same covariance of the rows as `shared`.

    `shared` (s, P, E): of each cause one standard deviation.
    `sd` (P, E) or None: standard errors of the rows, which say what is large; None: all alike.
    Returns: (t, P, E).
    """
    weight = np.ones(shared.shape[1:]) if sd is None else 1 / sd
    # U (s, P E) = sum_i s_i u_i v_i^T; U^T U = sum_i s_i^2 v_i v_i^T
    found = np.linalg.svd((shared * weight).reshape(len(shared), weight.size), full_matrices=False)
    energy = found.S**2
    beyond = energy.sum() - np.cumsum(energy) + energy
    kept = beyond > (1 - _FOLLOWED) * energy.sum()
    return np.asarray((found.S[:, None] * found.Vh)[kept].reshape(-1, *weight.shape) / weight)


def spread_of(
    covariance: FloatArray, design: FloatArray, weight: FloatArray, shared: FloatArray
) -> FloatArray:
    """Covariance (p, p) of a weighted linear fit that shared errors add.

    `shared` (s, P, E).
    `covariance` (p, p): C of the fit, of rows of unit variance.
    `design` (P, E, p): weighted regressors.
    `weight` (P, E, E): ``L^-1`` of each row's covariance ``L L^T``.
    Returns: (p, p).
    """
    moved = np.einsum("pij,spj->spi", weight, shared)
    # d (s, p) = W f (s, P E) X (P E, p) C (p, p)
    d = np.einsum("spi,piq->sq", moved, design) @ covariance
    return np.asarray(d.T @ d)


#: The elements of a symmetric 2 x 2 matrix in the order in which models hold them.
ELEMENTS = ("ss", "se", "ee")


def element_labels(n: int) -> tuple[str, ...]:
    """Names of the packed elements of n joints: ``ss, se, ee``, or ``11, 12, ...``."""
    if n == 2:
        return ELEMENTS
    return tuple(f"{i + 1}{j + 1}" for i, j in zip(*elements(n), strict=True))


#: What an estimate may warn of that is the same person's or rig's in all conditions.
ALIKE: Final = (
    *("delay", "reflex", "amplitude", "friction", "voluntary"),
    *("gain", "inner mode", "own motion"),
)


@dataclass(frozen=True)
class JointRows(FrozenRecord):
    """P conditions at the joint level: n joints of which r move, in the plane shoulder and elbow.

    Attributes
    ----------
    joint_angles : (P, n)
        rad.
    stiffness, viscosity : (P, r, r)
        Matrices as measured, not necessarily symmetric; N m/rad, N m s/rad.
    stiffness_sd, viscosity_sd : (P, r, r) or None
        Standard errors of the elements, positive.
    activation, activation_sd : (P, m) or None
        Activation of each muscle, 0..1, and its standard error.
    torque : (P, r) or None
        Joint torque that the muscles bear, ``tau = J^T F``, N m.
    labels : (P,) tuple of str
        Origin of each row, for messages: a condition, or a file and its line.
    muscles : (m,) tuple of str
        Names of the muscles of `activation`; empty where they are not known.
    moving : (r,) tuple of int
        Numbers, from 0, of the joints that the matrices are of: one that was held has an angle and
        no stiffness. Default: all.
    doubts : tuple of str
        Departures that the rows' estimates warn of, such as "reflex": they make all rows wrong
        alike.
    stiffness_shared, viscosity_shared : (P, s, r, r) or None
        What each of s causes that all rows have in common makes wrong in each row, one standard
        deviation of it; it is part of the rows' standard errors, and does not average out.
    """

    joint_angles: Annotated[FloatArray, "p n"]
    stiffness: Annotated[FloatArray, "p r r"]
    viscosity: Annotated[FloatArray, "p r r"]
    stiffness_sd: Annotated[FloatArray, "p r r"] | None = None
    viscosity_sd: Annotated[FloatArray, "p r r"] | None = None
    activation: Annotated[FloatArray, "p _"] | None = None
    activation_sd: Annotated[FloatArray, "p _"] | None = None
    torque: Annotated[FloatArray, "p r"] | None = None
    labels: tuple[str, ...] = ()
    muscles: tuple[str, ...] = ()
    moving: tuple[int, ...] = ()
    doubts: tuple[str, ...] = ()
    stiffness_shared: Annotated[FloatArray, "p s r r"] | None = None
    viscosity_shared: Annotated[FloatArray, "p s r r"] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        p = len(self.joint_angles)
        if not self.labels:
            labels = tuple(f"row {i}" for i in range(1, p + 1))
            object.__setattr__(self, "labels", labels)
        if len(self.labels) != p:
            raise InputError(f"{len(self.labels)} labels for {p} rows")
        n, r = self.joints, self.stiffness.shape[1]
        moving = self.moving or tuple(range(n))
        object.__setattr__(self, "moving", moving)
        if (
            len(moving) != r
            or sorted(set(moving)) != list(moving)
            or not set(moving) <= {*range(n)}
        ):
            raise InputError(
                f"matrices of {r} joints, angles of {n}, of which {len(moving)} move",
                expected="as many as move, in order",
            )
        columns = None if self.activation is None else self.activation.shape[1]
        if self.muscles and columns is not None and len(self.muscles) != columns:
            raise InputError(
                f"{columns} activations", expected=f"{len(self.muscles)}, one a muscle"
            )
        self._check_values()

    def _check_values(self) -> None:
        for name in ("stiffness_sd", "viscosity_sd"):
            sd = getattr(self, name)
            if sd is not None and not (sd > 0).all():
                row = int(np.argmax((sd <= 0).any(axis=(1, 2))))
                raise InputError(f"{self.labels[row]}: a {name} of 0", expected="more than 0")
        if self.activation is not None:
            outside = (self.activation < 0) | (self.activation > 1)
            if outside.any():
                row, muscle = (int(i) for i in np.argwhere(outside)[0])
                raise InputError(
                    f"{self.labels[row]}: activation {self.activation[row, muscle]:.3g}",
                    column=f"alpha_{muscle + 1}",
                    expected="0 to 1 (1 is the maximum voluntary contraction)",
                )

    @property
    def n_rows(self) -> int:
        """Number of conditions P."""
        return len(self.joint_angles)

    @property
    def joints(self) -> int:
        """Number of joints n."""
        return self.joint_angles.shape[1]

    @property
    def kept(self) -> IntArray:
        """Which of the packed elements of n joints are those of the joints that move."""
        return kept_elements(self.joints, self.moving)

    @staticmethod
    def doubts_in(warnings: Iterable[str]) -> tuple[str, ...]:
        """Which departures warnings begin with that make all conditions wrong alike."""
        doubted = {warning.split(":")[0].strip() for warning in warnings}
        return tuple(name for name in ALIKE if name in doubted)

    @staticmethod
    def shared_of(errors: Sequence[Mapping[str, FloatArray]], joints: int) -> dict[str, Any]:
        """`stiffness_shared` and `viscosity_shared` of rows; none where no row names a cause.

        See `shared_errors.shared_blocks`.
        """
        if not any(errors):
            return {}
        parts = shared_blocks(errors, joints)
        return {"viscosity_shared": parts[:, :, 1], "stiffness_shared": parts[:, :, 2]}

    @staticmethod
    def moving_of(joints: int, measured: int) -> tuple[int, ...] | None:
        """The joints that move where matrices are of `measured` of them; None: nobody can say.

        An arm in space of which three joints were measured has its upper arm kept from turning.
        """
        if measured == joints:
            return tuple(range(joints))
        if joints not in IN_SPACE:
            return None
        # of seven angles those of a locked wrist are known beside
        return next((known for known in (HELD, FREE) if len(known) == measured), None)

    def require_planar(self) -> None:
        """Refuse rows of other joints than shoulder and elbow.

        Raises
        ------
        InputError
        """
        if self.joints != 2 or len(self.moving) != 2:
            raise InputError(
                f"rows of {self.joints} joints",
                expected="shoulder and elbow; of more joints only `fit muscles` makes a model",
            )

    def elements(self, symbol: str) -> tuple[FloatArray, FloatArray | None]:
        """Packed stiffness ("K") or viscosity ("B"), in the plane ``ss, se, ee``, and its errors.

        Returns
        -------
        values, sd : (P, E), and (P, E) or None
            N m/rad or N m s/rad; a cross term is the mean of both.
        """
        which = "stiffness" if symbol == "K" else "viscosity"
        measured, sd = getattr(self, which), getattr(self, f"{which}_sd")
        return triple(measured), None if sd is None else triple_sd(measured, sd)

    def shared(self, symbol: str) -> FloatArray:
        """Errors of packed K or B by causes that rows share, (s, P, E), one sd of each."""
        errors = self.stiffness_shared if symbol == "K" else self.viscosity_shared
        if errors is None:
            return np.zeros((0, self.n_rows, len(elements(len(self.moving))[0])))
        return triple(errors.swapaxes(0, 1))

    def select(self, rows: ArrayLike) -> JointRows:
        """These rows only (numbers from 0, or a mask)."""
        which = np.asarray(rows)
        # an empty list has no kind of its own
        chosen = np.arange(self.n_rows)[which if which.size else which.astype(np.intp)]
        fields_of_rows: dict[str, Any] = {
            name: None if value is None else value[chosen]
            for name, value in self.__dict__.items()
            if name not in ("labels", "muscles", "moving", "doubts")
        }
        return replace(self, **fields_of_rows, labels=tuple(self.labels[i] for i in chosen))

    def of_muscles(self, names: tuple[str, ...]) -> JointRows:
        """The same rows with the activations of these muscles, in this order.

        Order of the muscles, for rows that do not name them.

        Raises
        ------
        InputError
            A muscle whose activation was not measured.
        """
        if not self.muscles or self.activation is None or self.muscles == tuple(names):
            return self
        columns, sd = muscle_columns(self.muscles, names), self.activation_sd
        return replace(
            self,
            activation=self.activation[:, columns],
            activation_sd=None if sd is None else sd[:, columns],
            muscles=tuple(names),
        )


def muscle_columns(measured: tuple[str, ...], names: tuple[str, ...]) -> list[int]:
    """Where each of these muscles stands among the measured ones.

    Raises InputError: a muscle whose activation was not measured.
    """
    missing = [name for name in names if name not in measured]
    if missing:
        raise InputError(
            f"no activation of {', '.join(missing)}",
            column="muscles",
            expected=f"muscles of the arm among the measured {', '.join(measured)}",
        )
    return [measured.index(name) for name in names]
