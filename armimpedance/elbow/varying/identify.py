"""B(t) and K(t) of a joint under a random perturbation: the entry."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.elbow.result import VaryingImpedance
from armimpedance.elbow.samples import COMMANDED, JointSamples
from armimpedance.elbow.varying.beginning import Beginning, begin
from armimpedance.elbow.varying.data import VaryingData, decimated, varying_data
from armimpedance.elbow.varying.found import Found
from armimpedance.elbow.varying.methods import DEFAULT_VARYING, varying_method_named
from armimpedance.errors import InputError
from armimpedance.regression import NamedParameter, t_factor
from armimpedance.signals import CUTOFF_HZ

#: Half of K's 95 % band over K, above which the subject's own torque is told to limit it.
WIDE: Final = 0.1


def identify_varying(
    samples: JointSamples,
    *,
    method: str = DEFAULT_VARYING,
    amplitude: FloatArray | None = None,
    amplitude_sd: FloatArray | None = None,
    amplitude_cutoff_hz: float = CUTOFF_HZ,
    window_s: float | None = None,
    cutoff_hz: float | None = None,
    every_s: float | None = None,
) -> VaryingImpedance:
    """``tau = I theta'' + B(t) theta' + K(t) theta``, I constant.

    Parameters
    ----------
    samples : JointSamples
    method : str
        A name in `varying_methods.VARYING_METHODS`.
    amplitude : (N, m) or None
        EMG amplitudes at the samples' rate, 0..1; the first is the flexor, the second the
        extensor. For "emg" only.
    amplitude_sd : (m,) or None
        Their standard errors.
    amplitude_cutoff_hz : float
        Of the low-pass that made them: their errors lie below it.
    window_s : float or None
        Length of a window, for "windows" and "quadratic"; None: the method's own.
    cutoff_hz : float or None
        Highest frequency of the motion that counts; None: read from the torque's spectrum.
    every_s : float or None
        Grid of the result; None: the method's own, 0.02 s or the windows' step.

    Raises
    ------
    InputError
        An unknown method, an option that it does not take, or samples that cannot be used.
    EstimationError
        The record does not determine B(t) and K(t), or a solver did not get there.
    """
    chosen = varying_method_named(method)
    for name, value in (("window_s", window_s), ("every_s", every_s)):
        if value is not None and not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} of {value:g} s", expected="a positive time")
    if window_s is not None and chosen.needs != "window":
        raise InputError(f"method {method!r} takes no window", expected="windows or quadratic")
    begun = begin(varying_data(samples, cutoff_hz))
    data = begun.data
    if chosen.needs == "window":
        found = chosen.identify(begun, window_s=window_s, every_s=every_s)
    elif chosen.needs == "amplitude":
        a, sd = _amplitudes(samples, data, amplitude, amplitude_sd)
        found = chosen.identify(
            begun,
            amplitude=a,
            amplitude_sd=sd,
            amplitude_cutoff_hz=amplitude_cutoff_hz,
            every_s=every_s,
        )
    else:
        found = chosen.identify(begun, every_s=every_s)
    return _result(method, samples, begun, found)


def _amplitudes(
    samples: JointSamples,
    data: VaryingData,
    amplitude: FloatArray | None,
    sd: FloatArray | None,
) -> tuple[FloatArray, FloatArray | None]:
    """Amplitudes at the decimated rate, (N', m), and their standard errors."""
    if amplitude is None:
        raise InputError("method 'emg' without EMG amplitudes", expected="amplitude (N, m)")
    given = np.asarray(amplitude, dtype=np.float64)
    if given.ndim != 2 or len(given) != len(samples.torque) or not np.isfinite(given).all():
        raise InputError(
            f"EMG amplitudes of shape {given.shape}",
            expected=f"({len(samples.torque)}, muscles), finite",
        )
    rows = [samples.samples_of(t) for t in range(samples.n_trials)]
    columns = [
        np.concatenate([decimated(given[r, j], data.every) for r in rows])
        for j in range(given.shape[1])
    ]
    if sd is None:
        return np.stack(columns, axis=1), None
    errors = np.asarray(sd, dtype=np.float64)
    if errors.shape != (given.shape[1],) or not (np.isfinite(errors) & (errors >= 0)).all():
        raise InputError(
            f"standard errors {errors} of the amplitudes",
            expected=f"{given.shape[1]} numbers, 0 or more",
        )
    return np.stack(columns, axis=1), errors


def _result(method: str, samples: JointSamples, begun: Beginning, found: Found) -> VaryingImpedance:
    data = begun.data
    counts = np.bincount(found.trial, minlength=len(data.trials))
    inertia = NamedParameter(
        "I", found.inertia, found.sd_inertia, found.sd_inertia, "kg m^2", found.dof, samples.joint
    )
    return VaryingImpedance(
        method=method,
        trials=data.trials,
        offsets=np.concatenate([[0], np.cumsum(counts)]),
        time_s=found.time_s,
        B=found.B,
        K=found.K,
        sd_B=found.sd_B,
        sd_K=found.sd_K,
        inertia=inertia,
        snr=data.snr,
        dof=found.dof,
        preparation=(*data.notes, *_own_note(data), *found.notes),
        warnings=_warnings(samples, begun, found),
        details={"own_torque_rms": data.own.rms, **found.details},
    )


def _own_note(data: VaryingData) -> tuple[str, ...]:
    if not data.own.order:
        return ()
    return (
        f"beside the sensors' noise the torque holds one of the subject's own, {data.own.rms:.2g} "
        f"Nm (rms), an autoregression of order {data.own.order} by Whittle's likelihood",
    )


def _warnings(samples: JointSamples, begun: Beginning, found: Found) -> tuple[str, ...]:
    commanded = (COMMANDED,) if samples.torque_is == "commanded" else ()
    own = (*begun.warnings, *_limited(begun.data, found))
    return (*commanded, *_negative(found), *own, *found.warnings)


def _limited(data: VaryingData, found: Found) -> tuple[str, ...]:
    """The subject's own torque, where K's band is wide because of it."""
    half = float(np.median(t_factor(found.dof) * found.sd_K / np.abs(found.K)))
    if not data.own.order or half < WIDE:
        return ()
    return (
        f"a torque of the subject's own, {data.own.rms:.2g} Nm (rms), limits K: its 95 % band is "
        f"about +-{100 * half:.0f} %; a stronger perturbation at low frequencies, or a steadier "
        "subject, would narrow it",
    )


def _negative(found: Found) -> tuple[str, ...]:
    """A joint that pushes or feeds energy: more likely a sign or too much noise."""
    parts = {"B": float((found.B < 0).mean()), "K": float((found.K < 0).mean())}
    told = [
        f"{name} is negative in {_percent(part)} of the time: the sign of the torque, or too "
        "little motion for so fast a course"
        for name, part in parts.items()
        if part > 0
    ]
    if found.inertia < 0:
        told.append("the inertia is negative: the sign of the torque, or too much noise")
    return tuple(told)


def _percent(part: float) -> str:
    return "less than 1 %" if part < 0.01 else f"{100 * part:.0f} %"
