"""MuJoCo's system identification: a model is simulated and its parameters fitted to a sensor.

It needs a model whose parameters are M, B and K. Of the hand that is two slides that carry
armature, damping and a spring each, and a tendon between them that carries all three too; M, B and
K are then symmetric, 9 numbers for 12. Of the joint it is one hinge. Intervals are its own
(`calculate_intervals`), which take the errors of samples as independent.

*Forward*, as in its examples: the measured force drives the model, the motion is fitted. *Inverse*:
its hook `custom_rollout` returns the force that MuJoCo's inverse dynamics finds for the measured
motion, and that is fitted, an offset and a slope of each trial taken off. A force is held over a
step, so a step gets the mean of its two ends. Its default divides an error by the size of the
sensor in that trial, which is noise where a push goes along the other axis; here errors stay in SI.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable, Sequence

import mujoco
import numpy as np
from discrete import CUTOFF_HZ
from mujoco import sysid
from record import Hand, Joint
from scipy.signal import butter, detrend, filtfilt
from scipy.stats import norm
from with_scipy import CUTOFF_HZ as HAND_CUTOFF_HZ, derivatives

#: A step of the simulation, s.
STEP_S = 0.002
FIELDS = ("armature", "damping", "stiffness")
#: Start, least and largest value of M, B, K, for the hand and for the joint. With a tenth of the
#: least inertia the simulation of the joint runs away, and the search ends with an error.
HAND = ((0.8, 0.01, 10.0), (8.0, 0.1, 100.0), (80.0, 1.0, 1000.0))
JOINT = ((0.1, 0.01, 1.0), (1.0, 0.01, 10.0), (10.0, 0.1, 1000.0))
#: Of x, y and the tendon x - y to a symmetric matrix, row by row.
TO_MATRIX = np.array([[1.0, 0, 1], [0, 0, -1], [0, 0, -1], [0, 1, 1]])

_BODY = '<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>'
_FIELDS = " ".join(f'{name}="1"' for name in FIELDS)
_WORLD = f'<option timestep="{STEP_S}" integrator="RK4" gravity="0 0 0"/><worldbody>'
TWO_SLIDES = f"""<mujoco>{_WORLD}<body>{_BODY}<joint name="x" type="slide" axis="1 0 0" {_FIELDS}/>
<body>{_BODY}<joint name="y" type="slide" axis="0 1 0" {_FIELDS}/></body></body></worldbody>
<tendon><fixed name="xy" springlength="0" {_FIELDS}>
<joint joint="x" coef="1"/><joint joint="y" coef="-1"/></fixed></tendon>
<actuator><motor joint="x"/><motor joint="y"/></actuator>
<sensor><jointpos name="sx" joint="x"/><jointpos name="sy" joint="y"/></sensor></mujoco>"""
HINGE = f"""<mujoco>{_WORLD}<body>{_BODY}<joint name="x" type="hinge" axis="0 0 1" {_FIELDS}/>
</body></worldbody><actuator><motor joint="x"/></actuator>
<sensor><jointpos name="sx" joint="x"/></sensor></mujoco>"""

Fit = tuple[np.ndarray, np.ndarray]


def _parts(spec: mujoco.MjSpec) -> list:
    """Joints and tendons, in the order of a parameter's values."""
    return [*spec.joints, *spec.tendons]


def _writer(field: str) -> Callable[[mujoco.MjSpec, sysid.Parameter], None]:
    """What puts the values of a parameter into a model."""

    def write(spec: mujoco.MjSpec, parameter: sysid.Parameter) -> None:
        for part, value in zip(_parts(spec), parameter.value, strict=True):
            # damping and stiffness are polynomials, the linear term first
            setattr(part, field, value if field == "armature" else [value, 0.0, 0.0])

    return write


def _plain(_parameters, predicted, measured, _model, _all, *, state, **_):
    """The error of the motion in SI units, from the second sample on: the first is the start.

    Of the state, not of the sensors: those of a step are computed before it.
    """
    kept = measured.data[1 : 1 + len(state)]
    return state[:, 1 : 1 + kept.shape[1]] - kept, predicted, predicted


def _without_drift(_parameters, predicted, measured, _model, _all, **_):
    """The error in newtons, an offset and a slope of the trial taken off."""
    return detrend(predicted.data - measured.data, axis=0), predicted, predicted


def _inverse_forces(
    models: Sequence[mujoco.MjModel],
    datas: Sequence[mujoco.MjData],  # codespell:ignore
    **given,
) -> list[sysid.SystemTrajectory]:
    """In place of a simulation: the forces that the motion (in place of controls) asks for."""
    found = []
    for model, motion in zip(models, given["control_signal"], strict=True):
        data, forces = datas[0], np.empty_like(motion.data)  # codespell:ignore
        velocity, acceleration = derivatives(motion.data, 1 / STEP_S)
        for i in range(len(forces)):
            data.qpos[:], data.qvel[:], data.qacc[:] = motion.data[i], velocity[i], acceleration[i]
            mujoco.mj_inverse(model, data)
            forces[i] = data.qfrc_inverse
        series = sysid.TimeSeries(motion.times, forces, given["rollout_signal_mapping"])
        state = sysid.TimeSeries(motion.times, np.column_stack([motion.times, motion.data]))
        found.append(sysid.SystemTrajectory(model, motion, series, None, state))
    return found


def _sequences(
    xml: str, u: np.ndarray, y: np.ndarray, start: tuple | None = None
) -> sysid.ModelSequences:
    """Controls u and sensors y, (T, S, d) each; position and velocity at the start, or rest."""
    spec = mujoco.MjSpec.from_string(xml)
    model, times = spec.compile(), np.arange(u.shape[1]) * STEP_S
    state = start or (np.zeros(model.nq), np.zeros(model.nv))
    rest = sysid.create_initial_state(model, *state)
    controls = [sysid.TimeSeries.from_control_names(times, f, model) for f in u]
    sensors = [sysid.TimeSeries.from_names(times, x, model) for x in y]
    names = [str(i) for i in range(len(u))]
    return sysid.ModelSequences("limb", spec, names, [rest] * len(u), controls, sensors)


def _fit(given: sysid.ModelSequences, start: tuple, **own: object) -> Fit:
    """Parameters (3 n,), M then B then K, and their covariance."""
    parameters, count = sysid.ParameterDict(), len(_parts(given.spec))
    for field, limits in zip(FIELDS, start, strict=True):
        values = [np.full(count, v) for v in limits]
        parameters.add(sysid.Parameter(field, *values, modifier=_writer(field)))
    residual = sysid.build_residual_fn(models_sequences=[given], n_threads=1, **own)
    with contextlib.redirect_stdout(io.StringIO()):
        found, result = sysid.optimize(parameters, residual, verbose=False)
    left = [np.ravel(r) for r in residual(result.x, found)[0]]
    return result.x, sysid.calculate_intervals(left, result.jac)[0]


def between(u: np.ndarray) -> np.ndarray:
    """Means of neighbours along the trials' samples (T, S, d)."""
    return np.concatenate([(u[:, 1:] + u[:, :-1]) / 2, u[:, -1:]], axis=1)


def forward(x: np.ndarray, force: np.ndarray) -> Fit:
    """Force in, motion out."""
    given = _sequences(TWO_SLIDES, between(force), x)
    return _fit(given, HAND, modify_residual=_plain)


def inverse(x: np.ndarray, force: np.ndarray) -> Fit:
    """Motion in, force out."""
    own = {"modify_residual": _without_drift, "custom_rollout": _inverse_forces}
    return _fit(_sequences(TWO_SLIDES, x, force), HAND, resample_true=False, **own)


def _hand(record: Hand, fit: Callable[[np.ndarray, np.ndarray], Fit]) -> Fit:
    b, a = butter(2, HAND_CUTOFF_HZ, fs=record.rate_hz)
    keep, before = round(STEP_S * record.rate_hz), record.lag_s <= 0
    to_all, found = np.kron(np.eye(3), TO_MATRIX), []
    for trials in record.conditions:
        both = (filtfilt(b, a, s[trials], axis=1) for s in (record.position, -record.force))
        x, force = (
            (s - s[:, before].mean(axis=1, keepdims=True))[:, ~before][:, ::keep] for s in both
        )
        values, covariance = fit(x, force)
        spread = np.sqrt(np.diag(to_all @ covariance @ to_all.T))
        found.append((to_all @ values, norm.ppf(0.975) * spread))
    values, half = zip(*found, strict=True)
    return np.stack(values), np.stack(half)


def hand_forward(record: Hand) -> Fit:
    """M, B, K of every condition, from the onset on, as in MuJoCo's examples."""
    return _hand(record, forward)


def hand_inverse(record: Hand) -> Fit:
    """The same by MuJoCo's inverse dynamics."""
    return _hand(record, inverse)


def joint(record: Joint) -> Fit:
    """I, B, K of every record, torque in, angle out."""
    b, a = butter(4, CUTOFF_HZ, fs=record.rate_hz)
    inner, found = slice(100, -100, round(STEP_S * record.rate_hz)), []
    for trial in range(len(record.angle)):
        y, u = (filtfilt(b, a, detrend(s[trial]))[inner] for s in (record.angle, record.torque))
        start = (y[:1], np.gradient(y[:3], STEP_S)[:1])
        given = _sequences(HINGE, between(u[None, :, None]), y[None, :, None], start)
        values, covariance = _fit(given, JOINT, modify_residual=_plain)
        found.append((values, norm.ppf(0.975) * np.sqrt(np.diag(covariance))))
    values, half = zip(*found, strict=True)
    return np.stack(values), np.stack(half)
