"""The central types: frozen, validated on construction, without algorithms.

A type proves that a stage ran: a `Recording` has been read and its table agrees with its samples;
a `Window` has been cut around each onset; a `Response` has its derivatives. The result of an
impedance analysis is in `estimates`. Arrays are copied and read-only.

Sizes: d hand (or joint) axes, n joints, m muscles, S samples in a window, T trials, N samples in
all trials of a recording.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Annotated, Any, Final, Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, IntArray, frozen_array
from armimpedance.core.conventions import IMPOSED, Imposed, Kind
from armimpedance.core.errors import RecordError
from armimpedance.core.estimates import ImpedanceEstimate as ImpedanceEstimate, Quality as Quality
from armimpedance.core.findings import Finding
from armimpedance.core.trials import InTrials, expect_shape, trial_slices as trial_slices

#: Highest order of a low-pass that a user may state.
HIGHEST_LOWPASS: Final = 8


def wrong_lowpass(hz: float | None, order: float, rate_hz: float) -> tuple[str, str] | None:
    """Return the wrong field of a stated low-pass and what was expected; None if both are right."""
    if hz is not None and not 0 < hz < rate_hz / 2:
        return "force_lowpass_hz", f"more than 0, less than half the rate, {rate_hz / 2:g} Hz"
    if isinstance(order, bool) or order not in range(1, HIGHEST_LOWPASS + 1):
        return "force_lowpass_order", f"a whole number, 1 to {HIGHEST_LOWPASS}"
    return None


@dataclass(frozen=True)
class Subject:
    """The person who was measured; a fact that is not stated is None. Lengths: see `conventions`.

    `mass_sd_kg` and `length_sd_m` are standard errors of the mass and of each length, if stated.

    Examples
    --------
    >>> import armimpedance as ai
    >>> ai.Subject("P1", mass_kg=70.0, height_m=1.75, upper_arm_m=0.30, forearm_hand_m=0.34).mass_kg
    70.0
    """

    id: str = "unknown"
    mass_kg: float | None = None
    height_m: float | None = None
    upper_arm_m: float | None = None
    forearm_hand_m: float | None = None
    mass_sd_kg: float | None = None
    length_sd_m: float | None = None


@dataclass(frozen=True, repr=False)
class Recording(InTrials):
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
        First sample of each trial; trials may differ in length; none is empty.
    time_s : (N,)
        Each trial's own clock.
    position : (N, d)
        Hand position in m, or joint angles in rad.
    force : (N, d)
        Force (N) or torque (N m) **by the limb on the device**.
    joint_angles : (N, n) or None
        Measured arm posture in rad (shoulder, elbow). Values of slower sensors are repeated.
    emg : (N, m) or None
        In V or normalised to MVC (`emg_unit`), in the order of `muscles`.
    perturbation : {"returning", "stochastic", "moving"}
        "moving": pushes of a hand that reaches, whose trials the table describes by ``phase``.
    torque : {"interaction", "commanded"} or None
    imposed : {"position", "force", "torque", "both"} or None
        The quantity that the device imposed on the limb whatever the limb did; "both": a device of
        finite impedance. None: not stated; analyses that need it infer it from the data.
    handle_mass_kg : float
        Mass between the force sensor and the hand.
    force_lowpass_hz : float or None
        Corner of a causal Butterworth low-pass that the force passed before it was recorded and the
        position did not; None: not stated.
    force_lowpass_order : int
        Its order.
    shoulder_m : (d,) or None
        Place of the shoulder in the frame of `position` (kind "hand").
    gravity_m_s2 : (d,) tuple or None
        Gravity along the axes of `position` (kind "hand"), m/s^2: zeros in a horizontal plane. None
        if it is not stated: the plane of a robot is then assumed to be horizontal.
    extra : mapping str -> (N,)
        Further numeric sample columns, kept for round trips. Analyses read only the commanded
        motion (`core.conventions.command_columns`) and the commanded perturbation torque
        (`core.conventions.perturbation_columns`).
    provenance : tuple of str
        Steps of the processing so far, one sentence each.
    findings : tuple of Finding
        Findings of the file's reader: trials left out, and the sign of the force. They are not
        written to the disk; the provenance has them as sentences.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> session, truth = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> session
    Recording of 8 trials, 8.1 s at 1000 Hz
    conditions: cocontraction_10
    """

    kind: Kind
    sample_rate_hz: float
    trials: pd.DataFrame
    offsets: Annotated[IntArray, "T+1"]
    time_s: Annotated[FloatArray, "N"]
    position: Annotated[FloatArray, "N d"]
    force: Annotated[FloatArray, "N d"]
    joint_angles: Annotated[FloatArray, "N n"] | None = None
    emg: Annotated[FloatArray, "N m"] | None = None
    muscles: tuple[str, ...] = ()
    emg_unit: Literal["V", "normalised"] = "V"
    perturbation: Literal["returning", "stochastic", "moving"] = "returning"
    torque: Literal["interaction", "commanded"] | None = None
    imposed: Imposed | None = None
    handle_mass_kg: float = 0.0
    force_lowpass_hz: float | None = None
    force_lowpass_order: int = 2
    shoulder_m: Annotated[FloatArray, "d"] | None = None
    gravity_m_s2: tuple[float, ...] | None = None
    subject: Subject = field(default_factory=Subject)
    extra: Mapping[str, FloatArray] = field(default_factory=dict)
    provenance: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.kind not in ("hand", "joint"):
            raise RecordError(f"unknown kind {self.kind!r}", expected="'hand' or 'joint'")
        if self.imposed not in (None, *IMPOSED):
            raise RecordError(f"imposed {self.imposed!r}", expected=f"one of {', '.join(IMPOSED)}")
        samples = len(self.time_s)
        if self.emg is not None:
            expect_shape("emg", self.emg, (samples, len(self.muscles)))
        if not (np.isfinite(self.handle_mass_kg) and self.handle_mass_kg >= 0):
            raise RecordError(f"handle_mass_kg is {self.handle_mass_kg}", expected=">= 0 kg")
        wrong = wrong_lowpass(self.force_lowpass_hz, self.force_lowpass_order, self.sample_rate_hz)
        if wrong is not None:
            name, expected = wrong
            raise RecordError(f"{name} is {getattr(self, name)}", expected=expected)
        if self.gravity_m_s2 is not None and self.kind == "hand":
            expect_shape("gravity_m_s2", np.array(self.gravity_m_s2), (self.axes,))
        extra = {k: frozen_array(v, k, (samples,)) for k, v in self.extra.items()}
        object.__setattr__(self, "extra", MappingProxyType(extra))

    def __getstate__(self) -> dict[str, Any]:
        # a read-only view of a mapping cannot be sent to another process
        return {**self.__dict__, "extra": dict(self.extra)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update({**state, "extra": MappingProxyType(state["extra"])})

    @property
    def axes(self) -> int:
        """Number of axes d of position and force."""
        return int(self.position.shape[1])

    def select(self, rows: ArrayLike) -> Recording:
        """Return the recording with these trials only (row numbers from 0, or a mask)."""
        everything = np.arange(self.n_trials)
        if np.array_equal(everything[np.asarray(rows)], everything):
            return self
        index, changes = self._chosen(rows)
        return replace(
            self,
            **changes,
            position=self.position[index],
            force=self.force[index],
            joint_angles=None if self.joint_angles is None else self.joint_angles[index],
            emg=None if self.emg is None else self.emg[index],
            extra={k: v[index] for k, v in self.extra.items()},
        )

    def with_step(self, sentence: str, **changes: Any) -> Recording:
        """Return a changed copy, with a sentence on the change in its provenance."""
        return replace(self, provenance=(*self.provenance, sentence), **changes)


@dataclass(frozen=True)
class Window(FrozenRecord):
    """Raw samples in equal windows around each onset.

    `joint_angles_at_onset` (T, n) or None.
    `lag_s` (S,): time from the onset, equally spaced; 0 is the last sample before the disturbance.
    `position`, `force` (T, S, d): as recorded (force by the limb), not referenced.
    `duration_s` (T,): from onset to the end of each disturbance.
    `trial` (T,) int: trial numbers as in the recording.
    `usable` (T,) bool: False where a trial's samples do not fill the window; such trials hold
    zeros.
    `position_at_onset`, `force_at_onset` (T, d): means over the rest just before the onset.
    `disturbance` (T,) int or None: trials with the same number had the same disturbance; None if
    that is not known.
    `commanded` (T, S, d) or None: the commanded motion of the robot; None if it was not recorded.
    `notes`: facts that matter for the result, for example that onsets were detected.
    """

    sample_rate_hz: float
    lag_s: Annotated[FloatArray, "S"]
    position: Annotated[FloatArray, "T S d"]
    force: Annotated[FloatArray, "T S d"]
    duration_s: Annotated[FloatArray, "T"]
    trial: Annotated[IntArray, "T"]
    usable: Annotated[BoolArray, "T"]
    position_at_onset: Annotated[FloatArray, "T d"]
    force_at_onset: Annotated[FloatArray, "T d"]
    joint_angles_at_onset: Annotated[FloatArray, "T n"] | None = None
    disturbance: Annotated[IntArray, "T"] | None = None
    notes: tuple[str, ...] = ()
    commanded: Annotated[FloatArray, "T S d"] | None = None

    @property
    def axes(self) -> int:
        """Number of axes d."""
        return int(self.position.shape[2])


@dataclass(frozen=True)
class Response(FrozenRecord):
    """Displacement, its derivatives and force, all through the same smoothing, drift removed.

    `lag_s` (S,), `trial` (T,) int.
    `displacement`, `velocity`, `acceleration`, `force` (T, S, d): both sides of the impedance
    equation after the same linear operator.
    `usable` (T,) bool: False rows hold zeros and add nothing to a fit.
    """

    sample_rate_hz: float
    lag_s: Annotated[FloatArray, "S"]
    displacement: Annotated[FloatArray, "T S d"]
    velocity: Annotated[FloatArray, "T S d"]
    acceleration: Annotated[FloatArray, "T S d"]
    force: Annotated[FloatArray, "T S d"]
    trial: Annotated[IntArray, "T"]
    usable: Annotated[BoolArray, "T"]

    @property
    def axes(self) -> int:
        """Number of axes d."""
        return int(self.displacement.shape[2])


@dataclass(frozen=True)
class ArmPosture(FrozenRecord):
    """An arm at one posture: the maps between hand, joints and muscles.

    `joint_angles` (n,): rad.
    `hand_position` (d,): hand from the shoulder, m.
    `jacobian` (d, n): ``J = dp/dtheta``.
    `jacobian_derivative` (d, n, n): ``[k, i, j] = d2 p_k / dtheta_i dtheta_j``, symmetric in i, j.
    `inertia` (n, n) or None: joint-space inertia matrix M(theta).
    `gravity_torque` (n,) or None: g(theta), N m: the joint torque that carries the arm's weight;
    None if it is not known.
    `gravity_gradient` (n, n) or None: ``[i, j] = dg_i / dtheta_j``, N m/rad; None if it is not
    known.
    `muscle_jacobian` (m, n) or None: ``G = dL/dtheta``, lengthening positive.
    `muscle_curvature` (m, n, n) or None: ``d2L/dtheta2``.
    """

    joint_angles: Annotated[FloatArray, "n"]
    hand_position: Annotated[FloatArray, "d"]
    jacobian: Annotated[FloatArray, "d n"]
    jacobian_derivative: Annotated[FloatArray, "d n n"]
    inertia: Annotated[FloatArray, "n n"] | None = None
    gravity_torque: Annotated[FloatArray, "n"] | None = None
    gravity_gradient: Annotated[FloatArray, "n n"] | None = None
    muscle_jacobian: Annotated[FloatArray, "m n"] | None = None
    muscle_curvature: Annotated[FloatArray, "m n n"] | None = None

    def torque_under(self, force: FloatArray) -> FloatArray:
        """Muscles' joint torque (n,), N m, for the hand's force (d,) and, if known, the weight."""
        # tau (n,) = J^T (n, d) F (d,) + g (n,); Tsuji (1997), eq. (3) without g
        torque = self.jacobian.T @ force
        return torque if self.gravity_torque is None else torque + self.gravity_torque
