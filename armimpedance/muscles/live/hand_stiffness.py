"""The stiffness of the hand at one posture and activation, with its covariance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.limb.arm import Arm
from armimpedance.muscles.live.form import StiffnessForm
from armimpedance.muscles.live.posture_part import HandPart, PosturePart, PostureTerms
from armimpedance.muscles.models import elements, unpacked

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

    Parameters
    ----------
    form : StiffnessForm
    arm : Arm
    posture_step_rad : float
        A posture counts as the last one while no joint has moved by more.
    moving : tuple of int
        The joints that move, r of n.
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

        Raises
        ------
        InputError
            The arm is stretched.
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
        """What each muscle gives (m,) to the trace."""
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
