"""Stiffness and viscosity of one joint over time, with bands."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Any

from armimpedance.analyses.elbow_emg import two_muscles
from armimpedance.analyses.inspection import checked
from armimpedance.analyses.sources import PathLike, naming, of_condition, read_recording
from armimpedance.elbow import (
    VARYING_METHODS,
    Crosstalk,
    VaryingImpedance,
    from_recording,
    identify_varying,
)
from armimpedance.errors import InputError
from armimpedance.findings import Finding, warnings_of
from armimpedance.records import Recording
from armimpedance.signals import CUTOFF_HZ, emg_amplitude

Progress = Callable[[int, int], None]


def elbow_over_time(
    recording: Recording | PathLike,
    *,
    method: str = "smoother",
    window_s: float | None = None,
    every_s: float | None = None,
    cutoff_hz: float | None = None,
    flexor: str | None = None,
    extensor: str | None = None,
    emg_cutoff_hz: float | None = None,
    joint: int = 1,
    condition: str | None = None,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> VaryingImpedance:
    """Estimate viscosity and stiffness of one joint over time, its inertia constant.

    Parameters
    ----------
    recording : Recording or path
        Kind "joint", under a random perturbation.
    method : str
        "smoother", "spline", "windows" (the source's), "quadratic" or "emg".
    window_s : float, optional
        Length of a window, s, of "windows" and "quadratic".
    every_s : float, optional
        Grid of the result, s.
    cutoff_hz : float, optional
        Highest frequency of the motion that counts, Hz; by default read from the torque's spectrum.
    flexor, extensor : str, optional
        Muscles whose EMG method "emg" takes; by default the two of the recording, in their order.
    emg_cutoff_hz : float, optional
        Edge of the amplitudes' low-pass, Hz, of method "emg" (10).
    joint : int
        Axis of the recording, counted from 1.
    condition : str, optional
        Only the trials of this condition.
    despite : str or collection of str
        Names of checks of `inspect` whose STOP is overruled; the result says so.
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
        EMG amplitudes whose errors explain most of what is seen of them.
    EstimationError
        The record does not determine B(t) and K(t), or a solver did not get there.

    Examples
    --------
    >>> from armimpedance.analyses import elbow_over_time
    >>> from manipulandum_sim.elbow import simulate_bench
    >>> recording, _ = simulate_bench(0.07, 1.2, 20.0, duration_s=6.0, snr_db=40.0)
    >>> course = elbow_over_time(recording, method="windows")
    >>> list(course.to_frame().columns[:3])
    ['time_s', 'B', 'K']
    """
    chosen = VARYING_METHODS.named(method)
    options: dict[str, Any] = {"method": method, "window_s": window_s, "every_s": every_s}
    of_emg = {"flexor": flexor, "extensor": extensor, "emg_cutoff_hz": emg_cutoff_hz}
    given = [name for name, value in of_emg.items() if value is not None]
    if given and chosen.needs != "amplitude":
        raise InputError(f"{', '.join(given)} with method {method!r}", expected="method 'emg'")
    with naming(recording):
        trials = of_condition(read_recording(recording), condition)
        samples = from_recording(trials, joint)
        marks = checked(trials, despite)
        notes: tuple[str, ...] = ()
        checks: tuple[Finding, ...] = ()
        if chosen.needs == "amplitude":
            edge_hz = emg_cutoff_hz or CUTOFF_HZ
            pair = two_muscles(trials, flexor, extensor)
            heard = Crosstalk.of(pair)
            checks = (heard.finding(pair.muscles),)
            emg = emg_amplitude(heard.own(pair), cutoff_hz=edge_hz)
            # one standard error per muscle: the mean square over time
            sd = (emg.sd**2).mean(axis=0) ** 0.5
            options |= {"amplitude": emg.amplitude, "amplitude_sd": sd}
            options |= {"amplitude_cutoff_hz": edge_hz}
            notes = (*emg.notes, *emg.warnings)
        course = identify_varying(samples, cutoff_hz=cutoff_hz, progress=progress, **options)
    warnings = (*marks, *course.warnings, *warnings_of(checks))
    return replace(course, notes=notes, checks=(*checks, *course.checks), warnings=warnings)
