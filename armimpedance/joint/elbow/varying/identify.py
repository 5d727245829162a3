"""Identify B(t) and K(t) of a joint under a random perturbation."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import count
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, InputError, check_number
from armimpedance.core.findings import warnings_of
from armimpedance.core.progress import Progress
from armimpedance.joint.elbow.elbow_result import NAMES, UNITS, VaryingImpedance
from armimpedance.joint.elbow.samples import COMMANDED, JointSamples
from armimpedance.joint.elbow.varying.beginning import Beginning, begin
from armimpedance.joint.elbow.varying.data import VaryingData, decimated_amplitudes, varying_data
from armimpedance.joint.elbow.varying.method import EstimatedCourse, VaryingMethod, VaryingOptions
from armimpedance.joint.elbow.varying.methods import VARYING_METHODS
from armimpedance.joint.elbow.varying.rivals import at_rest, beside_rivals
from armimpedance.numerics.criticism import check_joint_size
from armimpedance.numerics.regression import Parameters, t_factor
from armimpedance.numerics.signals import CUTOFF_HZ

#: Largest number of steps that progress reports: the data, the search for the subject's own torque,
#: and the method's own steps.
_STEPS: Final = 24
#: Half of K's 95 % band over K from which a warning names the subject's own torque as the limit.
WIDE: Final = 0.1


def identify_varying(
    samples: JointSamples,
    *,
    method: str | None = None,
    amplitude: FloatArray | None = None,
    amplitude_sd: FloatArray | None = None,
    amplitude_cutoff_hz: float = CUTOFF_HZ,
    window_s: float | None = None,
    cutoff_hz: float | None = None,
    every_s: float | None = None,
    progress: Progress | None = None,
) -> VaryingImpedance:
    """Identify ``tau = I theta'' + B(t) theta' + K(t) theta``, I constant.

    Parameters
    ----------
    samples : JointSamples
    method : str, optional
        A name in `VARYING_METHODS`; its default if none is given.
    amplitude : (N, m) or None
        EMG amplitudes at the samples' rate, 0..1; the first is the flexor, the second the
        extensor. For "emg" only.
    amplitude_sd : (m,) or None
        Their standard errors.
    amplitude_cutoff_hz : float
        Edge of the low-pass of the amplitudes, Hz; their errors lie below it.
    window_s : float or None
        Length of a window, s, for "windows" and "quadratic"; None: the method's own.
    cutoff_hz : float or None
        Highest frequency of the motion that is used, Hz; None: from the torque's spectrum.
    every_s : float or None
        Grid of the result, s; None: the method's own, 0.02 s or the windows' step.
    progress : callable, optional
        Called with the number of steps that are done and their total.

    Returns
    -------
    VaryingImpedance

    Raises
    ------
    InputError
        An unknown method, an option that it does not take, or samples that cannot be used.
    EstimationError
        The record does not determine B(t) and K(t), or a solver did not converge.
    """
    chosen = VARYING_METHODS.named(method)
    _refuse_times(chosen, window_s, every_s)
    tick = _ticks(progress)
    data = varying_data(samples, cutoff_hz)
    options = VaryingOptions(window_s, every_s, amplitude_cutoff_hz=amplitude_cutoff_hz, tick=tick)
    if chosen.needs == "amplitude":
        at_rate, sd = decimated_amplitudes(samples, data.every, amplitude, amplitude_sd)
        options = replace(options, amplitude=at_rate, amplitude_sd=sd)
    tick()
    begun, course = _with_rivals(chosen, begin(data, tick), options)
    rest = at_rest(samples, data, course, cutoff_hz)
    if rest.corrects:
        # if the corrected record does not converge, only the bands allow for the detected effect
        with suppress(EstimationError):
            corrected = varying_data(rest.corrected(samples), cutoff_hz)
            begun, course = _with_rivals(chosen, begin(corrected, tick), options)
    course = rest.beside(course)
    if progress is not None:
        progress(_STEPS, _STEPS)
    return _result(chosen, samples, begun, course)


def _with_rivals(
    chosen: VaryingMethod, begun: Beginning, options: VaryingOptions
) -> tuple[Beginning, EstimatedCourse]:
    """Course of the method, with a test for the subject's own torque if the method makes none."""
    course = chosen.identify(begun, options)
    # a course that follows the measured amplitudes cannot follow another torque
    free = chosen.needs != "amplitude"
    if free and not any(check.name == "voluntary" for check in course.checks):
        course = beside_rivals(course, begun, options.tick)
    return begun, course


def _ticks(progress: Progress | None) -> Callable[[], None]:
    """Return a function that reports one more step; the last step is reported at the end."""
    done = count(1)

    def tick() -> None:
        if progress is not None:
            progress(min(next(done), _STEPS - 1), _STEPS)

    return tick


def _refuse_times(method: VaryingMethod, window_s: float | None, every_s: float | None) -> None:
    for name, value in (("window_s", window_s), ("every_s", every_s)):
        if value is not None:
            check_number(value, f"{name} of {value:g} s", above=0)
    if window_s is not None and method.needs != "window":
        raise InputError(f"method {method.name!r} takes no window", expected="windows or quadratic")


def _result(
    method: VaryingMethod, samples: JointSamples, begun: Beginning, course: EstimatedCourse
) -> VaryingImpedance:
    data = begun.data if course.own is None else replace(begun.data, own=course.own)
    begun = replace(begun, data=data)
    expected = samples.expected_inertia
    size = check_joint_size("inertia", course.inertia, course.sd_inertia, expected)
    counts = np.bincount(data.trial_of[course.at], minlength=len(data.trials))
    inertia = Parameters(
        NAMES[:1], UNITS[:1], np.array([course.inertia]), np.array([[course.sd_inertia**2]])
    )
    return VaryingImpedance(
        method=method.name,
        trials=data.trials,
        offsets=np.concatenate([[0], np.cumsum(counts)]),
        time_s=data.time_s[course.at],
        B=course.B,
        K=course.K,
        sd_B=course.sd_B,
        sd_K=course.sd_K,
        parameters=inertia,
        snr=data.snr,
        joint=samples.joint,
        preparation=(*data.notes, *_own_note(data), *course.notes),
        warnings=(*_warnings(samples, begun, course), *warnings_of((size,))),
        checks=(*course.checks, size),
        details={"own_torque_rms": data.own.rms, **course.details},
    )


def _own_note(data: VaryingData) -> tuple[str, ...]:
    if not data.own.order:
        return ()
    return (
        f"beside the sensors' noise the torque holds one of the subject's own, {data.own.rms:.2g} "
        f"N m (rms), an autoregression of order {data.own.order} by Whittle's likelihood",
    )


def _warnings(samples: JointSamples, begun: Beginning, course: EstimatedCourse) -> tuple[str, ...]:
    commanded = (COMMANDED,) if samples.torque_is == "commanded" else ()
    own = _limited(begun.data, course)
    return (*commanded, *_negative(course), *own, *course.warnings, *warnings_of(course.checks))


def _limited(data: VaryingData, course: EstimatedCourse) -> tuple[str, ...]:
    """Warning on the subject's own torque if K's band is wide because of it."""
    half = float(np.median(t_factor(np.inf) * course.sd_K / np.abs(course.K)))
    if not data.own.order or half < WIDE:
        return ()
    return (
        f"a torque of the subject's own, {data.own.rms:.2g} N m (rms), limits K: its 95 % band is "
        f"about +-{100 * half:.0f} %; a stronger perturbation at low frequencies, or a steadier "
        "subject, would narrow it",
    )


def _negative(course: EstimatedCourse) -> tuple[str, ...]:
    """Warnings on negative I, B or K: probably a wrong sign or too much noise."""
    parts = {"B": float((course.B < 0).mean()), "K": float((course.K < 0).mean())}
    messages = [
        f"{name} is negative in {_percent(part)} of the time: the sign of the torque, or too "
        "little motion for so fast a course"
        for name, part in parts.items()
        if part > 0
    ]
    if course.inertia < 0:
        messages.append("the inertia is negative: the sign of the torque, or too much noise")
    return tuple(messages)


def _percent(part: float) -> str:
    return "less than 1 %" if part < 0.01 else f"{100 * part:.0f} %"
