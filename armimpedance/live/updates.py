"""The stiffness of the hand, one update a sample, from a model that was fitted before."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.arm import Arm
from armimpedance.arrays import LARGEST, FloatArray
from armimpedance.errors import InputError
from armimpedance.files import read_model
from armimpedance.levels import kinematic_arm
from armimpedance.live.activity import HeldActivity, activations_lost
from armimpedance.live.clock import Clock, Tick
from armimpedance.live.form import StiffnessForm, form_of
from armimpedance.live.posture_part import HandPart, PosturePart, PostureTerms
from armimpedance.live.result import LiveStiffness
from armimpedance.live.spring import VaryingSpring
from armimpedance.muscles import MuscleModel
from armimpedance.recordings import read_subject
from armimpedance.records import Recording, Subject

#: A joint stiffness whose smallest eigenvalue is less than this part of its largest counts as not
#: definite, and is lifted to it: next to nothing would turn such a stiffness round.
LEAST_PART: Final = 1e-3
#: ... where no eigenvalue is positive (N m/rad).
_LEAST: Final = 1e-3
#: An activation this far beyond the measured range is still inside, as for `predict`.
_EDGE: Final = 1e-6
#: No joint angle (rad), force (N) or displacement (m) is larger: other units are.
_LARGEST: Final = {"q": 2 * np.pi, "hand": 10.0, "force": 1e4, "displacement": 10.0}


class Live:
    """Stiffness of the hand from posture and muscle activity, sample by sample.

    Parameters
    ----------
    model : MuscleModel, StiffnessForm or path
        What `fit_muscles` made, or its MODEL.json.
    recording : Arm, Recording, Subject or path
        Whose arm it is, and how gravity acts; or an arm of any number of joints.
    rate_hz : float
        Nominal rate of the samples, Hz.
    limit_N_m_s : float, optional
        Largest rate of change of the commanded stiffness, N/m per s; none: no limit.
    posture_step_rad : float
        Keep what depends on the posture until a joint has moved by more than this; 0: every
        posture is computed anew.

    Raises
    ------
    InputError
        A file cannot be read, the model is none of posture and activation, the arm is not known
        or has other joints, or a rate that is not positive.

    Examples
    --------
    >>> from armimpedance import Live
    >>> Live("nowhere.json", "session")
    Traceback (most recent call last):
    armimpedance.errors.InputError: nowhere.json: cannot be read: No such file or directory
    """

    def __init__(
        self,
        model: MuscleModel | StiffnessForm | str | os.PathLike[str],
        recording: Arm | Recording | Subject | str | os.PathLike[str],
        *,
        rate_hz: float = 1000.0,
        limit_N_m_s: float | None = None,
        posture_step_rad: float = 0.0,
    ) -> None:
        if not (np.isfinite(rate_hz) and rate_hz > 0):
            raise InputError(f"a rate of {rate_hz:g} Hz", expected="more than 0")
        self.form, self.arm = _form(model), _arm(recording)
        if self.arm.joints != self.form.joints:
            raise InputError(f"an arm of {self.arm.joints} joints", expected=f"{self.form.joints}")
        self._rate, self._limit, self._moved = rate_hz, limit_N_m_s, posture_step_rad
        self._terms = PostureTerms(self.form)
        self._posture: PosturePart | None = None
        n = self.form.joints
        self._i, self._j = np.triu_indices(n)
        self._order = np.arange(self.form.rising.shape[0])
        self._passive = np.zeros(len(self._i))
        self._passive[self._i == self._j] = self.form.passive
        self.reset()

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the muscles, in the order of a sample's channels."""
        return self.form.muscles

    @property
    def signal(self) -> str:
        """What a sample holds of the muscles: the name of its field in a packet."""
        return "activation"

    @property
    def delay_s(self) -> float:
        """What the filters add, s."""
        return 0.0

    def reset(self) -> None:
        """Forget all samples."""
        self._clock = Clock(self._rate)
        self._begin()

    def _begin(self) -> None:
        self._held = HeldActivity(self.form.highest)
        self._spring = VaryingSpring(self._limit, 2 / self._rate)

    def update(
        self,
        signal: ArrayLike,
        *,
        q: ArrayLike | None = None,
        hand: ArrayLike | None = None,
        time_s: float | None = None,
        force: ArrayLike | None = None,
        displacement: ArrayLike | None = None,
        signal_sd: ArrayLike | None = None,
    ) -> LiveStiffness:
        """Take one sample and say how stiff the hand is.

        Parameters
        ----------
        signal : (m,)
            Activation of each muscle, 0..1; NaN where a channel dropped out.
        q : (n,), optional
            Joint angles, rad.
        hand : (2,), optional
            Place of the hand from the shoulder in place of `q`, m; two-link arms only.
        time_s : float, optional
            Time stamp; without one, samples are taken to follow each other at their rate.
        force : (d,), optional
            Force by the hand on its environment, N; none: no force.
        displacement : (d,), optional
            Of the hand from where the commanded spring is at rest, m: the energy that a varying
            stiffness adds is then counted.
        signal_sd : (m,), optional
            Standard errors of the activations.

        Returns
        -------
        LiveStiffness

        Raises
        ------
        InputError
            A sample that cannot be taken; the next one can.
        """
        d, m = self.arm.axes, len(self.form.muscles)
        level = _vector(signal, "signal", m, lost=True)
        sd = np.zeros(m) if signal_sd is None else _vector(signal_sd, "signal_sd", m)
        e = None if displacement is None else _vector(displacement, "displacement", d)
        F = None if force is None else _vector(force, "force", d)
        posture = self._posture_at(self._angles(q, hand))
        tick = self._clock.next(time_s)
        if tick.anew:
            self._begin()
        alpha, sd, flags = self._activity(level, sd, tick)
        return self._result(posture, alpha, sd, F, e, tick, flags)

    def _angles(self, q: ArrayLike | None, hand: ArrayLike | None) -> FloatArray:
        if q is not None:
            return _vector(q, "q", self.form.joints)
        if hand is None or not hasattr(self.arm, "joint_angles"):
            raise InputError("a sample without a posture", expected="joint angles q")
        place = _vector(hand, "hand", self.arm.axes)
        return np.asarray(cast(Any, self.arm).joint_angles(place), dtype=float)

    def _posture_at(self, q: FloatArray) -> PosturePart:
        """The posture part, kept while no joint has moved by more than `posture_step_rad`."""
        kept = self._posture
        if kept is None or np.abs(q - kept.q).max() > self._moved:
            kept = self._posture = PosturePart(self.form, self._terms, self.arm, q)
        return kept

    def _activity(
        self, level: FloatArray, sd: FloatArray, tick: Tick
    ) -> tuple[FloatArray, FloatArray, list[str]]:
        lost = activations_lost(level)
        names = [name for name, gone in zip(self.form.muscles, lost, strict=True) if gone]
        flags = [f"lost: {name}" for name in names]
        if tick.gap:
            flags.append("gap")
        alpha, sd = self._held.take(level, sd, lost, tick.step_s)
        return alpha, sd, flags

    def _result(
        self,
        posture: PosturePart,
        alpha: FloatArray,
        sd: FloatArray,
        force: FloatArray | None,
        displacement: FloatArray | None,
        tick: Tick,
        flags: list[str],
    ) -> LiveStiffness:
        form = self.form
        # f = f(0) + rise, from the powers of s (m, N + 1) and the basis on them
        s = (alpha / form.highest)[:, None]
        basis = s**self._order @ form.rising
        rise = (basis[:, 1:] * form.stiffness[:, 1:]).sum(axis=1)
        f = basis[:, 0] * form.stiffness[:, 0] + rise
        packed = f @ posture.squares + rise @ posture.curvatures + self._passive + posture.gravity
        if force is not None:
            gamma = np.tensordot(force, self.arm.jacobian_derivative(posture.q), 1)
            packed = packed + gamma[self._i, self._j]
        K_j, packed, definite = self._definite(packed)
        hand = posture.hand_part(form, K_j)
        K = _unpacked(hand.to_hand @ packed, self.arm.axes)
        mine = f * _trace(hand.squares, self.arm.axes) + rise * _trace(
            hand.curvatures, self.arm.axes
        )
        return LiveStiffness(
            time_s=tick.time_s,
            delay_s=self.delay_s,
            q=posture.q,
            activation=alpha,
            joint_stiffness=K_j,
            stiffness=K,
            commanded=self._spring.follow(K, tick.step_s, displacement),
            covariance=self._covariance(hand, basis, f, rise)
            + self._by_activation(hand, alpha, sd),
            dof=form.dof,
            share=mine / np.trace(K),
            reach=hand.reach,
            extrapolating=not posture.measured or bool((alpha > form.highest + _EDGE).any()),
            definite=definite,
            flags=tuple(flags),
            growth_W_m2=self._spring.growth_W_m2,
            added_J=self._spring.added_J,
            direction_rad=float(np.arctan2(posture.position[1], posture.position[0])),
        )

    def _definite(self, packed: FloatArray) -> tuple[FloatArray, FloatArray, bool]:
        """Joint stiffness (n, n) and packed, lifted to positive definite where it is not."""
        K_j = _unpacked(packed, self.form.joints)
        values, vectors = np.linalg.eigh(K_j)
        least = max(LEAST_PART * values[-1], _LEAST)
        if values[0] >= least:
            return K_j, packed, True
        K_j = (vectors * np.maximum(values, least)) @ vectors.T
        packed = K_j[self._i, self._j]
        return _unpacked(packed, self.form.joints), packed, False

    def _covariance(
        self, hand: HandPart, basis: FloatArray, f: FloatArray, rise: FloatArray
    ) -> FloatArray:
        """Covariance (E, E) from the model's parameters."""
        mine = self.form.muscle
        corrections = (
            f[mine, None] * hand.square_changes + rise[mine, None] * hand.curvature_changes
        )
        # f(0) makes no tension
        without = basis.copy()
        without[:, 0] = 0.0
        muscles = basis[:, :, None] * hand.squares[:, None]
        muscles += without[:, :, None] * hand.curvatures[:, None]
        slopes = np.concatenate([corrections, muscles.reshape(-1, muscles.shape[-1]), hand.passive])
        return np.asarray(slopes.T @ self.form.covariance @ slopes)

    def _by_activation(
        self, hand: HandPart, alpha: FloatArray, sd: FloatArray
    ) -> FloatArray | float:
        """Covariance (E, E) from the errors of the activations."""
        if not sd.any():
            return 0.0
        form = self.form
        s = (alpha / form.highest)[:, None]
        rates = self._order[1:] * s ** (self._order[1:] - 1) @ form.rising[1:]
        by_alpha = (rates * form.stiffness).sum(axis=1) / form.highest
        spread = (by_alpha * sd)[:, None] * (hand.squares + hand.curvatures)
        return np.asarray(spread.T @ spread)


def _unpacked(packed: FloatArray, n: int) -> FloatArray:
    """The symmetric matrix (n, n) of its elements on and above the diagonal."""
    i, j = np.triu_indices(n)
    A = np.empty((n, n))
    A[i, j] = A[j, i] = packed
    return A


def _trace(packed: FloatArray, n: int) -> FloatArray:
    """Traces of packed matrices (m, E)."""
    i, j = np.triu_indices(n)
    return np.asarray(packed[:, i == j].sum(axis=1))


def _form(model: Any) -> StiffnessForm:
    if isinstance(model, StiffnessForm):
        return model
    read = read_model(Path(model)) if isinstance(model, str | os.PathLike) else model
    if not isinstance(read, MuscleModel):
        raise InputError(
            "a model that is not of posture and activation",
            file=model if isinstance(model, str | os.PathLike) else None,
            expected="one of `fit muscles`",
        )
    return form_of(read)


def _arm(whose: Any) -> Arm:
    if isinstance(whose, str | os.PathLike):
        whose = read_subject(whose)
    if isinstance(whose, Subject):
        return cast(Arm, kinematic_arm(whose))
    if hasattr(whose, "jacobian"):
        return cast(Arm, whose)
    return cast(Arm, kinematic_arm(whose.subject, whose.gravity_m_s2))


def _vector(values: ArrayLike, name: str, length: int, *, lost: bool = False) -> FloatArray:
    """A vector (length,) of finite numbers, or with NaN for lost channels."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} is no list of numbers", expected=f"{length} numbers") from None
    if array.shape != (length,):
        raise InputError(f"{name} of shape {array.shape}", expected=f"({length},)")
    largest = _LARGEST.get(name, LARGEST)
    if lost:
        array[~(np.abs(array) < LARGEST)] = np.nan
    elif not (np.abs(array) <= largest).all():
        raise InputError(
            f"{name} of {array.tolist()}", expected=f"finite numbers up to {largest:g}"
        )
    return array
