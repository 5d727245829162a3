"""The stiffness of the hand at one posture and activation, with its covariance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError
from armimpedance.limb.arm import SINGULAR_CONDITION, Arm
from armimpedance.muscles.models import (
    AngleScaling,
    MuscleModel,
    Region,
    congruence,
    elements,
    kept_elements,
    unpacked,
)

# What of a muscle model a live update needs, for any number of joints and muscles.
#
# ``K_j = K_p + sum_i [f_i(alpha_i) g_i g_i^T + (f_i(alpha_i) - f_i(0)) d2L_i / kappa]``, as in
# `muscles.models.combined.equations`, but with every array laid out for one sample at a time.
# Symmetric matrices are packed: the elements on and above the diagonal, row by row.


@dataclass(frozen=True)
class StiffnessForm(FrozenRecord):
    """A model of joint stiffness over posture and activation: m muscles, n joints.

    Attributes
    ----------
    muscles : (m,) tuple of str
    exponents : (T, n) int
        Powers of the scaled angles in each term of a muscle's length.
    lengths : (m, T)
        Coefficients of the lengths, m.
    muscle : (C,) int
        Number of the muscle that each correction of the lengths belongs to.
    change : (C, T)
        Change of that muscle's coefficients with the correction, m.
    box : (n, 2)
        Joint angles (rad) that become -1 and 1.
    rising : (N + 1, N + 1)
        ``basis = (1, s, ..., s^N) @ rising`` with ``s = alpha / highest``: what the coefficients of
        f multiply; the first of them is f at rest.
    highest : (m,)
        Highest activation of each muscle that the model was fitted to.
    stiffness : (m, N + 1)
        Coefficients of f, N/m.
    per_tension : float
        1 / kappa in m, or 0 without curvature.
    passive : (n,)
        N m/rad.
    covariance : (p, p)
        Of corrections, coefficients of f (muscle by muscle) and passive stiffness, in this order.
    dof : float
        Degrees of freedom of the t distribution for intervals.
    measured : (V, n) or None
        Hull of the measured postures, scaled angles; None: the whole box was measured.
    scatter : float
        Standard deviation of each muscle's ``f_i g_i g_i^T`` at one place, as a part of it.
    """

    muscles: Annotated[tuple[str, ...], "m"]
    exponents: Annotated[IntArray, "t n"]
    lengths: Annotated[FloatArray, "m t"]
    muscle: Annotated[IntArray, "c"]
    change: Annotated[FloatArray, "c t"]
    box: Annotated[FloatArray, "n 2"]
    rising: Annotated[FloatArray, "k k"]
    highest: Annotated[FloatArray, "m"]
    stiffness: Annotated[FloatArray, "m k"]
    per_tension: float
    passive: Annotated[FloatArray, "n"]
    covariance: Annotated[FloatArray, "p p covariance"]
    dof: float
    measured: Annotated[FloatArray, "v n"] | None = None
    scatter: float = 0.0

    @property
    def joints(self) -> int:
        """Number of joints n."""
        return len(self.box)

    def was_measured(self, q: FloatArray) -> bool:
        """Return True if a posture (n,) lies among the measured ones."""
        if self.measured is None:
            return bool(((q >= self.box[:, 0]) & (q <= self.box[:, 1])).all())
        return bool(self._region.contains(self._scaling.scaled(q)))

    @cached_property
    def _region(self) -> Region:
        return Region(np.asarray(self.measured))

    @cached_property
    def _scaling(self) -> AngleScaling:
        return AngleScaling(self.box)


def form_of(model: MuscleModel) -> StiffnessForm:
    """The form of a model that `fit muscles` made."""
    equations, x = model.equations, model.values
    layout, lengths = equations.layout, equations.lengths
    kept = np.r_[layout.z, layout.f, layout.passive_K]
    return StiffnessForm(
        muscles=model.muscles,
        exponents=model.exponents,
        lengths=lengths.coefficients(x[layout.z]),
        muscle=model.muscle,
        change=model.change,
        box=model.box,
        rising=_powers_to_basis(model),
        highest=model.highest,
        stiffness=x[layout.f].reshape(len(model.muscles), -1),
        per_tension=model.curvature / model.stiffness_per_tension,
        passive=x[layout.passive_K],
        covariance=model.covariance[np.ix_(kept, kept)],
        dof=model.dof,
        measured=model.measured,
        scatter=model.scatter[0],
    )


def _powers_to_basis(model: MuscleModel) -> FloatArray:
    """The model's own basis at N + 1 activations, as a matrix on the powers of s."""
    s = np.linspace(0.0, 1.0, model.order + 1)
    at = model.equations.at(
        np.tile(model.box.mean(axis=1), (len(s), 1)), s[:, None] * model.highest
    )
    return np.asarray(np.linalg.solve(np.vander(s, increasing=True), at.basis[:, 0]))


# What depends on the posture alone, so that it is computed once while the arm stands still.


class PostureTerms:
    """Moment arms and curvatures of a form's muscles, and what corrections add to them."""

    def __init__(self, form: StiffnessForm) -> None:
        n = form.joints
        self._form, self._exponents = form, form.exponents.T.astype(float)
        self._half = (form.box[:, 1] - form.box[:, 0]) / 2
        self._middle = form.box.mean(axis=1)
        self._once = np.maximum(self._exponents - 1, 0)
        self._twice = np.maximum(self._exponents - 2, 0)
        self._slopes = self._exponents / self._half[:, None]
        self._bends = self._slopes * (self._exponents - 1) / self._half[:, None]
        rows, columns = elements(n)
        # how often each factor of a term is differentiated: by one angle, then by two
        by_one = np.eye(n, dtype=np.intp)
        self._orders = np.concatenate([by_one, by_one[rows] + by_one[columns]])
        self._joint = np.arange(n)
        every = np.concatenate([form.lengths, form.change])
        self._coefficients = np.ascontiguousarray(every.T)

    def at(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Moment arms (m + C, n) and packed curvatures (m + C, n (n + 1) / 2) at q (n,).

        The first m rows are the muscles', in m; the others what a unit of each correction adds.
        """
        form, n = self._form, self._form.joints
        u = ((q - self._middle) / self._half)[:, None]
        # every factor u_j^e of every term, and its two derivatives: (3, n, T)
        factors = np.stack(
            [u**self._exponents, self._slopes * u**self._once, self._bends * u**self._twice]
        )
        # terms differentiated (n + n (n + 1) / 2, T): the product over joints of their factors
        terms = factors[self._orders, self._joint].prod(axis=1)
        both = terms @ self._coefficients
        return both[:n].T, both[n:].T * form.per_tension


class PosturePart:
    """The arm and its muscles at one posture.

    `q` (n,), `jacobian` (d, r).
    `arms` (m, r): moment arms of the muscles about the joints that move, m.
    `squares`, `curvatures` (m, E): packed ``g g^T`` and ``d2L / kappa``.
    `gravity` (E,): packed gradient of the arm's weight, N m/rad.
    `measured`: whether the model knows such postures.
    """

    def __init__(
        self,
        form: StiffnessForm,
        terms: PostureTerms,
        arm: Arm,
        q: FloatArray,
        moving: tuple[int, ...],
    ) -> None:
        m, moves = len(form.muscles), list(moving)
        i, j = elements(len(moving))
        self.q = q
        self.jacobian = J = arm.jacobian(q)[:, moves]
        self.square = J.shape[0] == J.shape[1]
        inverse = np.asarray(_inverse(J) if self.square else np.linalg.pinv(J), dtype=float)
        if not np.abs(J).max() * np.abs(inverse).max() < SINGULAR_CONDITION:
            raise InputError(
                "the arm is stretched: its joints do not set the hand's stiffness",
                expected="a posture with the elbow bent",
            )
        self.position = arm.hand_position(q)
        every_arm, every_curvature = terms.at(q)
        every_arm = every_arm[:, moves]
        every_curvature = every_curvature[:, kept_elements(form.joints, moving)]
        self.arms, self.arm_changes = every_arm[:m], every_arm[m:]
        self.curvatures, self.curvature_changes = every_curvature[:m], every_curvature[m:]
        self.squares = self.arms[:, i] * self.arms[:, j]
        self.gravity = arm.gravity_gradient(q)[np.ix_(moves, moves)][i, j]
        self.measured = form.was_measured(q)
        # a square Jacobian sets the joints whatever their stiffness is
        self.at_hand = HandPart(form, self, inverse) if self.square else None

    def hand_part(self, form: StiffnessForm, K_j: FloatArray) -> HandPart:
        """The part seen at the hand; of a redundant arm it depends on the joint stiffness K_j."""
        if self.at_hand is not None:
            return self.at_hand
        J = self.jacobian
        yielding = np.linalg.solve(K_j, J.T)
        # joints' motion under a unit of the hand's: V = K^-1 J^T (J K^-1 J^T)^-1, (n, d)
        return HandPart(form, self, yielding @ _inverse(J @ yielding))


class HandPart:
    """Contribution of each part of K_j to the hand: ``K_e = V^T K_j V``, V the joints' motion.

    With ``V = K_j^-1 J^T K_e`` this holds for any arm, and to first order for its errors too.

    `motion` (n, d): V.
    `to_hand` (E_d, E_n): V^T . V of packed matrices.
    `reach` (d, m): U: ``dK_e / dk_i = u_i u_i^T``.
    `squares`, `curvatures` (m, E_d): packed ``u_i u_i^T`` and the curvatures as the hand feels
    them.
    """

    def __init__(self, form: StiffnessForm, at: PosturePart, V: FloatArray) -> None:
        n, d = V.shape
        i, j = elements(n)
        a, b = elements(d)
        self.motion = V
        self.to_hand = congruence(V)
        self.reach = U = V.T @ at.arms.T
        self.squares = (U[a] * U[b]).T
        self.curvatures = at.curvatures @ self.to_hand.T
        mine, du = U[:, form.muscle], V.T @ at.arm_changes.T
        self.square_changes = (mine[a] * du[b] + du[a] * mine[b]).T
        self.curvature_changes = at.curvature_changes @ self.to_hand.T
        self.passive = self.to_hand[:, i == j].T


def _inverse(A: FloatArray) -> FloatArray:
    """The inverse; infinite where there is none."""
    try:
        return np.asarray(np.linalg.inv(A), dtype=float)
    except np.linalg.LinAlgError:
        return np.full_like(A, np.inf)


#: A joint stiffness whose smallest eigenvalue is less than this part of its largest counts as not
#: definite, and is lifted to it: next to nothing would turn such a stiffness round.
LEAST_PART: Final = 1e-3
#: ... where no eigenvalue is positive (N m/rad).
_LEAST: Final = 1e-3


@dataclass(frozen=True, slots=True)
class HandStiffness:
    """The fields of `LiveStiffness` that posture and activation set."""

    joint_stiffness: FloatArray
    stiffness: FloatArray
    covariance: FloatArray
    share: FloatArray
    reach: FloatArray
    definite: bool


class HandEquations:
    """A form on an arm; it keeps the part of the last posture.

    `posture_step_rad`: a posture counts as the last one while no joint has moved by more.
    `moving`: the joints that move, r of n.
    """

    def __init__(
        self, form: StiffnessForm, arm: Arm, posture_step_rad: float, moving: tuple[int, ...]
    ) -> None:
        self._form, self._arm, self._step, self._moving = form, arm, posture_step_rad, moving
        self._terms = PostureTerms(form)
        self._kept: PosturePart | None = None
        self._i, self._j = elements(len(moving))
        self._diagonal = np.equal(*elements(arm.axes))
        self._order = np.arange(len(form.rising))
        self._passive = np.zeros(len(self._i))
        self._passive[self._i == self._j] = form.passive[list(moving)]

    def posture(self, q: FloatArray) -> PosturePart:
        """The posture part at q (n,).

        Raises InputError: the arm is stretched.
        """
        kept = self._kept
        if kept is None or np.abs(q - kept.q).max() > self._step:
            kept = self._kept = PosturePart(self._form, self._terms, self._arm, q, self._moving)
        return kept

    def at(
        self, posture: PosturePart, alpha: FloatArray, sd: FloatArray, force: FloatArray | None
    ) -> HandStiffness:
        """The hand's stiffness at activations (m,) with standard errors, under a force (d,)."""
        form = self._form
        s = (alpha / form.highest)[:, None]
        # f (m,) = f(0) + rise; a muscle at rest is stiff without tension, hence without curvature
        basis = s**self._order @ form.rising
        rise = (basis[:, 1:] * form.stiffness[:, 1:]).sum(axis=1)
        f = basis[:, 0] * form.stiffness[:, 0] + rise
        packed = f @ posture.squares + rise @ posture.curvatures + self._passive + posture.gravity
        if force is not None:
            gamma = np.tensordot(force, self._arm.jacobian_derivative(posture.q), 1)
            packed = packed + gamma[np.ix_(self._moving, self._moving)][self._i, self._j]
        K_j, packed, definite = self._definite(packed)
        hand = posture.hand_part(form, K_j)
        at_hand = hand.to_hand @ packed
        covariance = self._by_parameters(hand, basis, f, rise)
        if sd.any():
            covariance = covariance + self._by_activation(hand, s, sd)
        return HandStiffness(
            joint_stiffness=K_j,
            stiffness=unpacked(at_hand, self._arm.axes),
            covariance=covariance,
            share=self._traces(hand, f, rise) / at_hand[self._diagonal].sum(),
            reach=hand.reach,
            definite=definite,
        )

    def _definite(self, packed: FloatArray) -> tuple[FloatArray, FloatArray, bool]:
        """Joint stiffness (n, n) and packed, lifted to positive definite where it is not."""
        K_j = unpacked(packed, len(self._moving))
        values, vectors = np.linalg.eigh(K_j)
        least = max(LEAST_PART * values[-1], _LEAST)
        if values[0] >= least:
            return K_j, packed, True
        packed = ((vectors * np.maximum(values, least)) @ vectors.T)[self._i, self._j]
        return unpacked(packed, len(self._moving)), packed, False

    def _traces(self, hand: HandPart, f: FloatArray, rise: FloatArray) -> FloatArray:
        """Contribution of each muscle (m,) to the trace."""
        squares = hand.squares[:, self._diagonal].sum(axis=1)
        return np.asarray(f * squares + rise * hand.curvatures[:, self._diagonal].sum(axis=1))

    def _by_parameters(
        self, hand: HandPart, basis: FloatArray, f: FloatArray, rise: FloatArray
    ) -> FloatArray:
        """Covariance (E, E) from the model's parameters and its scatter."""
        mine = self._form.muscle
        corrections = (
            f[mine, None] * hand.square_changes + rise[mine, None] * hand.curvature_changes
        )
        muscles = basis[:, :, None] * hand.squares[:, None]
        muscles[:, 1:] += basis[:, 1:, None] * hand.curvatures[:, None]
        passive = np.zeros((self._form.joints, muscles.shape[-1]))
        passive[list(self._moving)] = hand.passive
        slopes = np.concatenate([corrections, muscles.reshape(-1, muscles.shape[-1]), passive])
        parts = (self._form.scatter * f)[:, None] * hand.squares
        return np.asarray(slopes.T @ self._form.covariance @ slopes + parts.T @ parts)

    def _by_activation(self, hand: HandPart, s: FloatArray, sd: FloatArray) -> FloatArray:
        """Covariance (E, E) from the errors of the activations."""
        form, order = self._form, self._order[1:]
        rates = (order * s ** (order - 1)) @ form.rising[1:]
        by_alpha = (rates * form.stiffness).sum(axis=1) / form.highest
        spread = (by_alpha * sd)[:, None] * (hand.squares + hand.curvatures)
        return np.asarray(spread.T @ spread)
