"""What depends on the posture alone, so that it is computed once while the arm stands still."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.limb.arm import SINGULAR_CONDITION, Arm
from armimpedance.muscles.live.form import StiffnessForm
from armimpedance.muscles.models import congruence, elements, kept_elements


class PostureTerms:
    """Moment arms and curvatures of a form's muscles, and what corrections add to them.

    Parameters
    ----------
    form : StiffnessForm
    """

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

    Attributes
    ----------
    q : (n,)
    jacobian : (d, r)
    arms : (m, r)
        Moment arms of the muscles about the joints that move, m.
    squares, curvatures : (m, E)
        Packed ``g g^T`` and ``d2L / kappa``.
    gravity : (E,)
        Packed gradient of the arm's weight, N m/rad.
    measured : bool
        Whether the model knows such postures.
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
    """What each part of K_j gives at the hand: ``K_e = V^T K_j V``, V the joints' motion.

    With ``V = K_j^-1 J^T K_e`` this holds for any arm, and to first order for its errors too.

    Attributes
    ----------
    motion : (n, d)
        V.
    to_hand : (E_d, E_n)
        V^T . V of packed matrices.
    reach : (d, m)
        U: ``dK_e / dk_i = u_i u_i^T``.
    squares, curvatures : (m, E_d)
        Packed ``u_i u_i^T`` and the curvatures as the hand feels them.
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
