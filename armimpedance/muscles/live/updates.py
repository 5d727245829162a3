"""The stiffness of the hand, one update a sample, from a model that was fitted before."""

from __future__ import annotations

import os
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from armimpedance.limb.arm import Arm
from armimpedance.muscles.live.activity import ActivationChannels, Channels, StreamClock
from armimpedance.muscles.live.emg_channels import EmgChannels
from armimpedance.muscles.live.hand_stiffness import HandEquations, StiffnessForm
from armimpedance.muscles.live.inputs import (
    Elbow,
    EmgLevels,
    arm_for,
    form_for,
    levels_for,
    moving_for,
    vector,
)
from armimpedance.muscles.live.result import LiveStiffness, VaryingSpring
from armimpedance.muscles.models import MuscleModel

#: An activation this far beyond the measured range is still inside, as for `predict`.
_EDGE: Final = 1e-6


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
    levels : EmgLevels, Recording or path, optional
        Samples hold EMG in V, and this, or what the recording's table says, is what it means;
        default: they hold activations.
    envelope : bool
        The EMG is an envelope: rectified and smoothed before it comes here.
    limit_N_m_s : float, optional
        Largest rate of change of the commanded stiffness, N/m per s; none: no limit.
    elbow : {"held", "free"}, optional
        In space: whether the upper arm is kept from turning about its own axis. Default: what the
        recording's column `elbow` says, else free.
    posture_step_rad : float
        Keep what depends on the posture until a joint has moved by more than this; 0: every
        posture is computed anew.

    Raises
    ------
    InputError
        A file cannot be read, the model is none of posture and activation, the arm is not known
        or has other joints, a rate that is not positive or a step that is negative.

    Examples
    --------
    >>> from armimpedance import Live
    >>> Live("nowhere.json", "session")
    Traceback (most recent call last):
    armimpedance.core.errors.InputError: nowhere.json: cannot be read: No such file or directory
    """

    def __init__(
        self,
        model: MuscleModel | StiffnessForm | str | os.PathLike[str],
        recording: Arm | Recording | Subject | str | os.PathLike[str],
        *,
        rate_hz: float = 1000.0,
        levels: EmgLevels | Recording | str | os.PathLike[str] | None = None,
        envelope: bool = False,
        limit_N_m_s: float | None = None,
        posture_step_rad: float = 0.0,
        elbow: Elbow | None = None,
    ) -> None:
        if not (np.isfinite(rate_hz) and rate_hz > 0):
            raise InputError(f"a rate of {rate_hz:g} Hz", expected="more than 0")
        if not 0 <= posture_step_rad < np.inf:
            raise InputError(f"a posture step of {posture_step_rad:g} rad", expected="0 or more")
        self.form = form_for(model)
        self.arm = arm_for(recording, self.form.joints)
        self._rate, self._limit = rate_hz, limit_N_m_s
        self.moving = moving_for(recording, self.form.joints, elbow)
        self._equations = HandEquations(self.form, self.arm, posture_step_rad, self.moving)
        self._channels: Channels = ActivationChannels(self.form.muscles, self.form.highest)
        if levels is not None:
            emg_levels = levels_for(levels, self.form.muscles)
            self._channels = EmgChannels(self.form, emg_levels, rate_hz, raw=not envelope)
        self.reset()

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the muscles, in the order of a sample's channels."""
        return self.form.muscles

    @property
    def signal(self) -> str:
        """Name of the field of a packet that holds the muscles' numbers."""
        return self._channels.signal

    @property
    def delay_s(self) -> float:
        """Delay that the filters add, s."""
        return self._channels.delay_s

    def reset(self) -> None:
        """Forget all samples."""
        self._clock = StreamClock(self._rate)
        self._channels.reset()
        self._spring = VaryingSpring(self._limit, 1 / self._rate)

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
            Activation of each muscle, 0..1, or its EMG in V; NaN where a channel dropped out.
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
        values = vector(signal, "signal", m, lost=True)
        sd = np.zeros(m) if signal_sd is None else vector(signal_sd, "signal_sd", m)
        e = None if displacement is None else vector(displacement, "displacement", d)
        F = None if force is None else vector(force, "force", d)
        posture = self._equations.posture(self._angles(q, hand))
        tick = self._clock.next(time_s)
        if tick.anew:
            # the spring goes on: a robot that holds it must not jump
            self._channels.reset()
        active = self._channels.take(values, sd, tick)
        now = self._equations.at(posture, active.alpha, active.sd, F)
        beyond = (active.alpha > self.form.highest + _EDGE).any()
        return LiveStiffness(
            time_s=tick.time_s,
            delay_s=self.delay_s,
            q=posture.q,
            activation=active.alpha,
            joint_stiffness=now.joint_stiffness,
            stiffness=now.stiffness,
            commanded=self._spring.follow(now.stiffness, tick.step_s, e),
            covariance=now.covariance,
            dof=self.form.dof,
            share=now.share,
            reach=now.reach,
            extrapolating=bool(beyond) or not posture.measured,
            definite=now.definite,
            flags=tuple(active.flags) + (("gap",) if tick.gap else ()),
            growth_W_m2=self._spring.growth_W_m2,
            added_J=self._spring.added_J,
            direction_rad=float(np.arctan2(posture.position[1], posture.position[0])),
        )

    def _angles(self, q: ArrayLike | None, hand: ArrayLike | None) -> FloatArray:
        if q is not None:
            return vector(q, "q", self.form.joints)
        arm: Any = self.arm
        if hand is None or arm.joints != arm.axes or not hasattr(arm, "joint_angles"):
            raise InputError("a sample without a posture", expected="joint angles q")
        return np.asarray(arm.joint_angles(vector(hand, "hand", arm.axes)), dtype=float)
