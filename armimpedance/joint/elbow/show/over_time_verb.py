"""Stiffness and viscosity of one joint over time, with bands."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.joint.elbow.cascade.identify import identify_cascade
from armimpedance.joint.elbow.cascade.methods import CASCADE_METHODS
from armimpedance.joint.elbow.elbow_result import VaryingImpedance
from armimpedance.joint.elbow.emg.crosstalk import Crosstalk
from armimpedance.joint.elbow.samples import from_recording
from armimpedance.joint.elbow.show.emg_verb import two_muscles
from armimpedance.joint.elbow.show.options import ELBOW_OVER_TIME
from armimpedance.joint.elbow.varying.identify import identify_varying
from armimpedance.joint.elbow.varying.methods import VARYING_METHODS
from armimpedance.numerics.signals import CUTOFF_HZ, emg_amplitude
from armimpedance.show.verbs.checks import checked
from armimpedance.show.verbs.results import PathLike, naming, read_recording


@ELBOW_OVER_TIME.function
def elbow_over_time(
    recording: Recording | PathLike,
    *,
    method: str = "smoother",
    window_s: float | None = None,
    cutoff_hz: float | None = None,
    flexor: str | None = None,
    extensor: str | None = None,
    emg_cutoff_hz: float | None = None,
    over: str | None = None,
    aligned: bool = False,
    joint: int = 1,
    condition: str | None = None,
    despite: str | Collection[str] = (),
    every_s: float | None = None,
    progress: Progress | None = None,
) -> VaryingImpedance:
    """Estimate viscosity and stiffness of one joint over time, its inertia constant.

    Parameters
    ----------
    recording : Recording or path
        Kind "joint", under a random perturbation.
    {options}
    every_s : float, optional
        Grid of the result, s.
    progress : callable, optional
        Called with the number of steps that are done and their total.

    Returns
    -------
    VaryingImpedance
        B and K of every trial over time with their standard errors, and the constant I.

    Raises
    ------
    InputError
        The recording cannot be read or used, a check of `inspect` says STOP, or an option has no
        effect on this method.
    NotIdentifiableError
        EMG amplitudes that are mostly errors.
    EstimationError
        The record does not determine B(t) and K(t), or a solver did not converge.

    Examples
    --------
    >>> from armimpedance.joint.elbow.show import elbow_over_time
    >>> from manipulandum_sim.elbow import simulate_bench
    >>> recording, _ = simulate_bench(0.07, 1.2, 20.0, duration_s=6.0, snr_db=40.0)
    >>> course = elbow_over_time(recording, method="windows")
    >>> list(course.to_frame().columns[:3])
    ['time_s', 'B', 'K']
    """
    if method in CASCADE_METHODS.names:
        _refuse_others(method, window_s, flexor, extensor, emg_cutoff_hz)
        with naming(recording):
            trials = read_recording(recording, condition=condition)
            samples = from_recording(trials, joint)
            marks = checked(trials, despite)
            cascade = identify_cascade(
                samples,
                method=method,
                aligned=aligned,
                over=over,
                variable=_variable(trials, over),
                every_s=every_s,
                cutoff_hz=cutoff_hz,
                progress=progress,
            )
        return replace(cascade, warnings=(*marks, *cascade.warnings))
    chosen = _standing(method, over, aligned)
    options: dict[str, Any] = {"method": method, "window_s": window_s, "every_s": every_s}
    of_emg = {"flexor": flexor, "extensor": extensor, "emg_cutoff_hz": emg_cutoff_hz}
    emg_options = [name for name, value in of_emg.items() if value is not None]
    if emg_options and chosen.needs != "amplitude":
        raise InputError(
            f"{', '.join(emg_options)} with method {method!r}", expected="method 'emg'"
        )
    with naming(recording):
        trials = read_recording(recording, condition=condition)
        samples = from_recording(trials, joint)
        marks = checked(trials, despite)
        notes: tuple[str, ...] = ()
        checks: tuple[Finding, ...] = ()
        if chosen.needs == "amplitude":
            pair = two_muscles(trials, flexor, extensor)
            amplitudes, notes, checks = _amplitudes(pair, emg_cutoff_hz or CUTOFF_HZ)
            options |= amplitudes
        course = identify_varying(samples, cutoff_hz=cutoff_hz, progress=progress, **options)
    warnings = (*marks, *course.warnings, *warnings_of(checks))
    return replace(course, notes=notes, checks=(*checks, *course.checks), warnings=warnings)


def _standing(method: str, over: str | None, aligned: bool) -> Any:
    """Return a method for B and K only, which takes neither a variable nor realizations."""
    if method not in VARYING_METHODS.names:
        names = ", ".join((*VARYING_METHODS, *CASCADE_METHODS))
        raise InputError(f"unknown method {method!r}", expected=f"one of {names}")
    if over is not None or aligned:
        stated = "aligned" if over is None else f"over {over!r}"
        raise InputError(f"{stated} with method {method!r}", expected="method 'cascade'")
    return VARYING_METHODS.named(method)


def _refuse_others(method: str, *values: float | str | None) -> None:
    names = ("window_s", "flexor", "extensor", "emg_cutoff_hz")
    without_effect = [name for name, value in zip(names, values, strict=True) if value is not None]
    if without_effect:
        raise InputError(
            f"{', '.join(without_effect)} with method {method!r}", expected="it without"
        )


def _variable(recording: Recording, over: str | None) -> FloatArray | None:
    """Values (N,) of the variable; None if the samples hold it themselves."""
    if over in (None, "angle", "torque"):
        return None
    muscles = [f"emg_{muscle}" for muscle in recording.muscles]
    if over in muscles:
        return np.asarray(emg_amplitude(recording).amplitude[:, muscles.index(over)])
    if over not in recording.extra:
        names = ("angle", "torque", *muscles, *recording.extra)
        raise InputError(f"no variable {over!r}", expected=f"one of {', '.join(names)}")
    return np.asarray(recording.extra[over])


def _amplitudes(
    pair: Recording, edge_hz: float
) -> tuple[dict[str, Any], tuple[str, ...], tuple[Finding, ...]]:
    """EMG of two muscles as keywords of `identify_varying`, with notes and findings on it."""
    crosstalk = Crosstalk.of(pair)
    emg = emg_amplitude(crosstalk.own(pair), cutoff_hz=edge_hz)
    # one standard error per muscle: the mean square over time
    sd = (emg.sd**2).mean(axis=0) ** 0.5
    options = {
        "amplitude": emg.amplitude,
        "amplitude_sd": sd,
        "amplitude_cutoff_hz": edge_hz,
    }
    return options, (*emg.notes, *emg.warnings), (crosstalk.finding(pair.muscles),)
