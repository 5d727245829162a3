"""The central types: frozen, validated on construction, without algorithms.

A type proves that a stage ran: a `Recording` has been read and its table agrees with its samples;
a `Window` has been cut around each onset; a `Response` has its derivatives; an
`ImpedanceEstimate` has its covariance. Arrays are copied in and read-only.

Sizes: d hand (or joint) axes, n joints, m muscles, S samples in a window, T trials, N samples in
all trials of a recording.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from armimpedance.arrays import BoolArray, FloatArray, IntArray, frozen_array
from armimpedance.conventions import Kind, Level, parameter_names
from armimpedance.errors import RecordError


def trial_slices(offsets: IntArray) -> list[slice]:
    """The samples of each trial, from where the trials start.

    Parameters
    ----------
    offsets : (T + 1,) int
        Trial t is ``offsets[t]:offsets[t + 1]``.

    Returns
    -------
    list of T slice
    """
    return [slice(int(a), int(b)) for a, b in zip(offsets[:-1], offsets[1:], strict=True)]


@dataclass(frozen=True)
class Subject:
    """Who was measured; what is not known is None. Lengths: see `conventions`."""

    id: str = "unknown"
    mass_kg: float | None = None
    height_m: float | None = None
    upper_arm_m: float | None = None
    forearm_hand_m: float | None = None


@dataclass(frozen=True)
class Recording:
    """All trials of a session, samples one after another.

    Attributes
    ----------
    kind : {"hand", "joint"}
        Hand position and force, or joint angle and torque.
    sample_rate_hz : float
    trials : DataFrame (T rows)
        ``trial`` (int, unique), ``condition`` (str), and any of ``set``, ``day``, ``experiment``,
        ``direction_deg``, ``onset_s``, ``end_s``, ``target_activation``,
        ``target_force_x_N``, ``target_force_y_N``, ``q_shoulder_rad``, ``q_elbow_rad``; further
        columns are kept. Row t belongs to samples ``offsets[t]:offsets[t + 1]``. Not to be changed.
    offsets : (T + 1,) int
        Where each trial starts; trials may differ in length; none is empty.
    time_s : (N,)
        Each trial's own clock.
    position : (N, d)
        Hand position in m, or joint angles in rad.
    force : (N, d)
        Force (N) or torque (Nm) **by the limb on the device**.
    joint_angles : (N, n) or None
        Measured arm posture in rad (shoulder, elbow), where there is one. Slower sensors are held.
    emg : (N, m) or None
        In V or normalised to MVC (`emg_unit`), in the order of `muscles`.
    perturbation : {"returning", "stochastic"}
    torque : {"interaction", "commanded"} or None
    handle_mass_kg : float
        Mass between the force sensor and the hand.
    shoulder_m : (d,) or None
        Where the shoulder is in the frame of `position` (kind "hand").
    extra : mapping str -> (N,)
        Further numeric sample columns, kept for round trips. Analyses read the commanded motion
        (`conventions.command_columns`) and the torque that a device was told to add
        (`conventions.perturbation_columns`) only.
    provenance : tuple of str
        What was done so far, one sentence each.
    """

    kind: Kind
    sample_rate_hz: float
    trials: pd.DataFrame
    offsets: IntArray
    time_s: FloatArray
    position: FloatArray
    force: FloatArray
    joint_angles: FloatArray | None = None
    emg: FloatArray | None = None
    muscles: tuple[str, ...] = ()
    emg_unit: Literal["V", "normalised"] = "V"
    perturbation: Literal["returning", "stochastic"] = "returning"
    torque: Literal["interaction", "commanded"] | None = None
    handle_mass_kg: float = 0.0
    shoulder_m: FloatArray | None = None
    subject: Subject = field(default_factory=Subject)
    extra: Mapping[str, FloatArray] = field(default_factory=dict)
    provenance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.kind not in ("hand", "joint"):
            raise RecordError(f"unknown kind {self.kind!r}", expected="'hand' or 'joint'")
        if not (np.isfinite(self.sample_rate_hz) and self.sample_rate_hz > 0):
            raise RecordError(f"sample rate {self.sample_rate_hz} Hz", expected="a positive number")
        put = object.__setattr__
        trials = self.trials.reset_index(drop=True).copy()
        put(self, "trials", trials)
        offsets = frozen_array(self.offsets, "offsets", (len(trials) + 1,), np.int64)
        put(self, "offsets", offsets)
        if len(trials) == 0:
            raise RecordError("no trials", expected="one row per trial")
        for column in ("trial", "condition"):
            if column not in trials:
                raise RecordError("no such column in the trial table", column=column)
        if trials["trial"].duplicated().any():
            twice = trials["trial"][trials["trial"].duplicated()].iloc[0]
            raise RecordError(f"trial {twice} stands twice in the trial table")
        if offsets[0] != 0 or (np.diff(offsets) <= 0).any():
            raise RecordError("a trial has no samples", expected="rising offsets from 0")
        samples = int(offsets[-1])
        put(self, "time_s", frozen_array(self.time_s, "time_s", (samples,)))
        put(self, "position", frozen_array(self.position, "position", (samples, None)))
        put(self, "force", frozen_array(self.force, "force", self.position.shape))
        if self.joint_angles is not None:
            angles = frozen_array(self.joint_angles, "joint_angles", (samples, None))
            put(self, "joint_angles", angles)
        put(self, "muscles", tuple(self.muscles))
        if self.emg is not None:
            put(self, "emg", frozen_array(self.emg, "emg", (samples, len(self.muscles))))
        if self.shoulder_m is not None:
            put(self, "shoulder_m", frozen_array(self.shoulder_m, "shoulder_m", (self.axes,)))
        if not (np.isfinite(self.handle_mass_kg) and self.handle_mass_kg >= 0):
            raise RecordError(f"handle_mass_kg is {self.handle_mass_kg}", expected=">= 0 kg")
        extra = {k: frozen_array(v, k, (samples,)) for k, v in self.extra.items()}
        put(self, "extra", MappingProxyType(extra))
        put(self, "provenance", tuple(self.provenance))

    def __getstate__(self) -> dict[str, Any]:
        # for another process; a read-only view of a mapping cannot go there
        return {**self.__dict__, "extra": dict(self.extra)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update({**state, "extra": MappingProxyType(state["extra"])})

    @property
    def axes(self) -> int:
        """Number of axes d of position and force."""
        return int(self.position.shape[1])

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.trials)

    def samples_of(self, row: int) -> slice:
        """The samples of the trial in row `row` (from 0) of the trial table."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))

    def select(self, rows: ArrayLike) -> Recording:
        """The same recording with these trials only (row numbers from 0, or a mask)."""
        chosen = np.arange(self.n_trials)[np.asarray(rows)]
        if np.array_equal(chosen, np.arange(self.n_trials)):
            return self
        index = np.concatenate(
            [np.arange(self.offsets[r], self.offsets[r + 1]) for r in chosen] or [np.arange(0)]
        )
        lengths = np.diff(self.offsets)[chosen]
        return replace(
            self,
            trials=self.trials.iloc[chosen],
            offsets=np.concatenate([[0], np.cumsum(lengths)]),
            time_s=self.time_s[index],
            position=self.position[index],
            force=self.force[index],
            joint_angles=None if self.joint_angles is None else self.joint_angles[index],
            emg=None if self.emg is None else self.emg[index],
            extra={k: v[index] for k, v in self.extra.items()},
        )

    def with_step(self, sentence: str, **changes: Any) -> Recording:
        """A changed copy that says in its provenance what was changed."""
        return replace(self, provenance=(*self.provenance, sentence), **changes)


@dataclass(frozen=True)
class Window:
    """Raw samples in equal windows around each onset.

    Attributes
    ----------
    lag_s : (S,)
        Time from the onset, equally spaced; 0 is the last sample before the disturbance.
    position, force : (T, S, d)
        As recorded (force by the limb), not referenced.
    duration_s : (T,)
        From onset to the end of each disturbance.
    trial : (T,) int
        Trial numbers as in the recording.
    usable : (T,) bool
        False where a trial's samples do not fill the window; such trials hold zeros.
    position_at_onset, force_at_onset : (T, d)
        Means over the rest just before the onset.
    joint_angles_at_onset : (T, n) or None
    disturbance : (T,) int or None
        Trials with the same number saw the same disturbance; None where that is not known.
    commanded : (T, S, d) or None
        The motion that the robot was told to make; None where it was not recorded.
    notes : tuple of str
        What a reader of the result must know, for example that onsets were detected.
    """

    sample_rate_hz: float
    lag_s: FloatArray
    position: FloatArray
    force: FloatArray
    duration_s: FloatArray
    trial: IntArray
    usable: BoolArray
    position_at_onset: FloatArray
    force_at_onset: FloatArray
    joint_angles_at_onset: FloatArray | None = None
    disturbance: IntArray | None = None
    notes: tuple[str, ...] = ()
    commanded: FloatArray | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "lag_s", frozen_array(self.lag_s, "lag_s", (None,)))
        put(self, "trial", frozen_array(self.trial, "trial", (None,), np.int64))
        t, s = len(self.trial), len(self.lag_s)
        put(self, "position", frozen_array(self.position, "position", (t, s, None)))
        put(self, "force", frozen_array(self.force, "force", self.position.shape))
        d = self.position.shape[2]
        for name, shape in (("duration_s", (t,)), ("position_at_onset", (t, d))):
            put(self, name, frozen_array(getattr(self, name), name, shape))
        put(self, "force_at_onset", frozen_array(self.force_at_onset, "force_at_onset", (t, d)))
        put(self, "usable", frozen_array(self.usable, "usable", (t,), np.bool_))
        if self.joint_angles_at_onset is not None:
            angles = frozen_array(self.joint_angles_at_onset, "joint_angles_at_onset", (t, None))
            put(self, "joint_angles_at_onset", angles)
        if self.disturbance is not None:
            put(self, "disturbance", frozen_array(self.disturbance, "disturbance", (t,), np.int64))
        if self.commanded is not None:
            put(self, "commanded", frozen_array(self.commanded, "commanded", (t, s, d)))

    @property
    def axes(self) -> int:
        """Number of axes d."""
        return int(self.position.shape[2])


@dataclass(frozen=True)
class Response:
    """Displacement, its derivatives and force, all through the same smoothing, drift removed.

    Attributes
    ----------
    lag_s : (S,)
    displacement, velocity, acceleration, force : (T, S, d)
        Both sides of the impedance equation after the same linear operator.
    trial : (T,) int
    usable : (T,) bool
        False rows hold zeros and add nothing to a fit.
    """

    sample_rate_hz: float
    lag_s: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    force: FloatArray
    trial: IntArray
    usable: BoolArray

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "lag_s", frozen_array(self.lag_s, "lag_s", (None,)))
        put(self, "trial", frozen_array(self.trial, "trial", (None,), np.int64))
        shape = (len(self.trial), len(self.lag_s), None)
        put(self, "displacement", frozen_array(self.displacement, "displacement", shape))
        for name in ("velocity", "acceleration", "force"):
            put(self, name, frozen_array(getattr(self, name), name, self.displacement.shape))
        put(self, "usable", frozen_array(self.usable, "usable", (len(self.trial),), np.bool_))

    @property
    def axes(self) -> int:
        """Number of axes d."""
        return int(self.displacement.shape[2])


@dataclass(frozen=True)
class ArmPosture:
    """An arm at one posture: what maps hand, joints and muscles onto one another.

    Attributes
    ----------
    joint_angles : (n,)
        rad.
    hand_position : (d,)
        Hand from the shoulder, m.
    jacobian : (d, n)
        ``J = dp/dtheta``.
    jacobian_derivative : (d, n, n)
        ``[k, i, j] = d2 p_k / dtheta_i dtheta_j``, symmetric in i, j.
    inertia : (n, n) or None
        Joint-space inertia matrix M(theta).
    muscle_jacobian : (m, n) or None
        ``G = dL/dtheta``, lengthening positive.
    muscle_curvature : (m, n, n) or None
        ``d2L/dtheta2``.
    """

    joint_angles: FloatArray
    hand_position: FloatArray
    jacobian: FloatArray
    jacobian_derivative: FloatArray
    inertia: FloatArray | None = None
    muscle_jacobian: FloatArray | None = None
    muscle_curvature: FloatArray | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "joint_angles", frozen_array(self.joint_angles, "joint_angles", (None,)))
        put(self, "hand_position", frozen_array(self.hand_position, "hand_position", (None,)))
        n, d = len(self.joint_angles), len(self.hand_position)
        put(self, "jacobian", frozen_array(self.jacobian, "jacobian", (d, n)))
        derivative = frozen_array(self.jacobian_derivative, "jacobian_derivative", (d, n, n))
        put(self, "jacobian_derivative", derivative)
        if self.inertia is not None:
            put(self, "inertia", frozen_array(self.inertia, "inertia", (n, n)))
        if self.muscle_jacobian is not None:
            g = frozen_array(self.muscle_jacobian, "muscle_jacobian", (None, n))
            put(self, "muscle_jacobian", g)
        if self.muscle_curvature is not None:
            shape = (None, n, n)
            put(self, "muscle_curvature", frozen_array(self.muscle_curvature, "curvature", shape))


@dataclass(frozen=True)
class Quality:
    """How well the second-order model describes the data. None: does not apply.

    multiple_correlation: between the corrected force and its prediction, over all axes, as the
    source defines it; it cannot see a reflex or a wrong model. vaf: variance accounted for, 0..1.
    coherence: mean multiple coherence over the fitted band (stochastic perturbations).
    """

    n_trials: int
    n_rows: int
    multiple_correlation: float
    vaf: float
    cond_raw: float
    cond_scaled: float
    rank: int
    residual_sd: float
    coherence: float | None = None


#: Fields of an estimate that are vectors where they are known.
_VECTORS = (
    *("position", "force", "joint_angles", "torque"),
    *("activation", "activation_sd", "shoulder_m"),
)


@dataclass(frozen=True)
class ImpedanceEstimate:
    """Inertia, viscosity and stiffness at one level, with their covariance.

    Attributes
    ----------
    level : {"hand", "joint", "muscle"}
    method : str
    inertia, viscosity, stiffness : (k, k)
        SI units of the level. `inertia` is the limb's own, the handle subtracted.
    inertia_with_handle : (k, k)
        As measured.
    covariance : (3 k^2, 3 k^2)
        Of M, B, K, each row by row (the order of `conventions.parameter_names`).
    dof : float
        Degrees of freedom of the t distribution for intervals; inf = normal.
    bound : (3 k^2, 3 k^2) or None
        The least covariance that any unbiased estimator could have on this motion and noise
        (Cramer-Rao), in the same order; `efficiency` compares.
    keys : mapping
        The group's columns, for example ``{"condition": "relaxed"}``.
    position, force : (k_hand,) or None
        Mean hand position (m) and force (N) at the onset, or joint angle and torque for a
        recording of joints.
    joint_angles : (n,) or None
        Mean joint angles at the onset, rad.
    torque : (n,) or None
        Joint torque that the muscles bear at the onset, ``tau = J^T F``, Nm; known once mapped.
    activation, activation_sd : (m,) or None
        Mean activation of each muscle before the onset, 0..1, and its standard error.
    muscles : tuple of str
        Names of those muscles, in their order; empty where they are not known.
    shoulder_m : (k_hand,) or None
        Where the shoulder is in the frame of `position`.
    warnings : tuple of str
    provenance : tuple of str
    """

    level: Level
    method: str
    inertia: FloatArray
    viscosity: FloatArray
    stiffness: FloatArray
    covariance: FloatArray
    dof: float
    quality: Quality
    inertia_with_handle: FloatArray | None = None
    bound: FloatArray | None = None
    keys: Mapping[str, Any] = field(default_factory=dict)
    position: FloatArray | None = None
    force: FloatArray | None = None
    joint_angles: FloatArray | None = None
    torque: FloatArray | None = None
    activation: FloatArray | None = None
    activation_sd: FloatArray | None = None
    muscles: tuple[str, ...] = ()
    shoulder_m: FloatArray | None = None
    warnings: tuple[str, ...] = ()
    provenance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "inertia", frozen_array(self.inertia, "inertia", (None, None)))
        k = len(self.inertia)
        if self.inertia_with_handle is None:
            put(self, "inertia_with_handle", self.inertia)
        for name in ("inertia", "inertia_with_handle", "viscosity", "stiffness"):
            put(self, name, frozen_array(getattr(self, name), name, (k, k)))
        shape = (3 * k * k, 3 * k * k)
        put(self, "covariance", frozen_array(self.covariance, "covariance", shape))
        if self.bound is not None:
            put(self, "bound", frozen_array(self.bound, "bound", shape))
        for name in _VECTORS:
            if getattr(self, name) is not None:
                put(self, name, frozen_array(getattr(self, name), name, (None,)))
        if not self.dof > 0:
            raise RecordError(f"{self.dof} degrees of freedom", expected="more than 0")
        put(self, "keys", MappingProxyType(dict(self.keys)))
        put(self, "muscles", tuple(self.muscles))
        put(self, "warnings", tuple(self.warnings))
        put(self, "provenance", tuple(self.provenance))

    def __getstate__(self) -> dict[str, Any]:
        # what goes to another process and back; a read-only view of a mapping cannot
        return {**self.__dict__, "keys": dict(self.keys)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update({**state, "keys": MappingProxyType(state["keys"])})

    @property
    def k(self) -> int:
        """Number of axes."""
        return len(self.inertia)

    @property
    def parameters(self) -> FloatArray:
        """M, B, K row by row, (3 k^2,)."""
        return np.concatenate([self.inertia, self.viscosity, self.stiffness], axis=None)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of `parameters`: ``M_11 … K_kk``."""
        return parameter_names(self.k)

    @property
    def sd(self) -> FloatArray:
        """Standard errors of M, B, K, (3, k, k)."""
        return np.sqrt(np.diag(self.covariance)).reshape(3, self.k, self.k)

    @property
    def efficiency(self) -> FloatArray | None:
        """Variance of the bound over the estimate's own, of each element, (3, k, k).

        As uncertain as the estimated variances: with n degrees of freedom by sqrt(2/n) of itself.
        """
        if self.bound is None:
            return None
        own = np.diag(self.covariance)
        ratio = np.diag(self.bound) / np.where(own > 0, own, np.inf)
        return np.asarray(ratio.reshape(3, self.k, self.k))

    def with_warning(self, *sentences: str) -> ImpedanceEstimate:
        """A copy that carries these warnings too."""
        return replace(self, warnings=(*self.warnings, *sentences))
