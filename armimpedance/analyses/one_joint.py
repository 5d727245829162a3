"""One joint under a random perturbation: at one point, over time, over EMG (Ruiz 2011)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final, Literal

import numpy as np

from armimpedance.analyses.sources import PathLike, naming, of_condition, read_recording
from armimpedance.elbow import (
    VARYING_METHODS,
    ElbowFit,
    EmgLaw,
    ImcjCalibration,
    OperatingPoints,
    VaryingImpedance,
    calibrate_imcj,
    fit_emg_law_of,
    from_recording,
    identify_elbow,
    identify_varying,
    imcj as index_of,
)
from armimpedance.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.records import Recording
from armimpedance.signals import CUTOFF_HZ, emg_amplitude, segment_amplitude

Progress = Callable[[int, int], None]

#: How a part of a recording that is one trial is called.
_TRIAL: Final = "trial "
#: What a part of a recording that allows no fit of its own fails with.
_NO_FIT: Final = (InputError, EstimationError, NotIdentifiableError)


def elbow(
    recording: Recording | PathLike,
    *,
    method: str | None = None,
    cutoff_hz: float | None | Literal["auto"] = "auto",
    decimation: int | Literal["auto"] = "auto",
    lowest_hz: float | None = None,
    joint: int = 1,
    condition: str | None = None,
    progress: Progress | None = None,
) -> ElbowFit:
    """Fit inertia, viscosity and stiffness of one joint about an operating point.

    All trials are fitted together; where there are several conditions, each of them is fitted by
    itself too, else each trial: the result's `parts`.

    Parameters
    ----------
    recording : Recording or path
        Kind "joint", under a random perturbation.
    method : str, optional
        "iv" (the default), "output-error", "derivative" or "arx" (the source's).
    cutoff_hz : float, None or "auto"
        Edge of the zero-phase low-pass on torque and angle, Hz; None: no filter; "auto": chosen
        from the spectra. Only "arx" filters: for the others it ends the band.
    decimation : int or "auto"
        Every how many samples one is kept after the filter.
    lowest_hz : float, optional
        The motion below this frequency, Hz, is left out; not for "arx".
    joint : int
        Axis of the recording, counted from 1.
    condition : str, optional
        Only the trials of this condition.
    progress : callable, optional
        Called with the number of fits that are done and their total.

    Returns
    -------
    ElbowFit

    Raises
    ------
    InputError
        The recording cannot be read or used; an unknown method or condition.
    NotIdentifiableError
        The motion does not tell I, B and K apart.
    EstimationError
        What was fitted is no joint, or a search does not settle.

    Examples
    --------
    >>> from armimpedance.analyses import elbow
    >>> from manipulandum_sim.elbow import simulate_bench
    >>> recording, _ = simulate_bench(0.07, 1.2, 20.0, trials=2, duration_s=6.0, snr_db=40.0)
    >>> fit = elbow(recording)
    >>> fit.stiffness.unit, round(fit.stiffness.value)
    ('Nm/rad', 20)
    >>> sorted(fit.parts)
    ['trial 1', 'trial 2']
    """
    options: dict[str, Any] = {
        "method": method,
        "cutoff_hz": cutoff_hz,
        "decimation": decimation,
        "lowest_hz": lowest_hz,
    }
    with naming(recording):
        chosen = of_condition(read_recording(recording), condition)
        selections, tell = _parts(chosen), progress or (lambda *_: None)
        whole = identify_elbow(from_recording(chosen, joint), **options)
        parts = {}
        for done, (name, rows) in enumerate(selections.items(), start=1):
            tell(done, 1 + len(selections))
            try:
                parts[name] = identify_elbow(from_recording(chosen.select(rows), joint), **options)
            except _NO_FIT:
                continue
        tell(1 + len(selections), 1 + len(selections))
    return replace(whole, parts=parts, warnings=(*whole.warnings, *_pooled_though(parts)))


def _parts(recording: Recording) -> dict[str, np.ndarray]:
    """Which trials belong to each condition, where there are several, else to each trial."""
    trials = recording.trials
    label = trials["condition"].astype(str)
    if label.nunique() < 2:
        label = _TRIAL + trials["trial"].astype(str)
    names = label.unique() if label.nunique() > 1 else ()
    return {name: (label == name).to_numpy() for name in names}


def _pooled_though(parts: Mapping[str, ElbowFit]) -> tuple[str, ...]:
    """A warning where conditions differ by more than their intervals allow."""
    if not parts or any(label.startswith(_TRIAL) for label in parts):
        return ()
    limits = np.array([part.parameters.interval() for part in parts.values()])
    values = np.array([part.parameters.values for part in parts.values()])
    # limits (parts, 3, 2): no value of a parameter lies within all of its intervals
    disagree = np.flatnonzero(limits[..., 0].max(axis=0) > limits[..., 1].min(axis=0))
    lowest, highest = values.min(axis=0), values.max(axis=0)
    apart = [f"{'IBK'[j]} from {lowest[j]:.3g} to {highest[j]:.3g}" for j in disagree]
    told = f"pooled, though its conditions differ beyond their intervals: {', '.join(apart)}"
    return (told,) if apart else ()


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
    progress : callable, optional
        Called with the number of steps that are done and their total.

    Returns
    -------
    VaryingImpedance

    Raises
    ------
    InputError
        The recording cannot be read or used, or an option has no effect on this method.
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
        notes: tuple[str, ...] = ()
        if chosen.needs == "amplitude":
            edge_hz = emg_cutoff_hz or CUTOFF_HZ
            emg = emg_amplitude(two_muscles(trials, flexor, extensor), cutoff_hz=edge_hz)
            # one standard error per muscle: the mean square over time
            sd = (emg.sd**2).mean(axis=0) ** 0.5
            options |= {"amplitude": emg.amplitude, "amplitude_sd": sd}
            options |= {"amplitude_cutoff_hz": edge_hz}
            notes = (*emg.notes, *emg.warnings)
        course = identify_varying(samples, cutoff_hz=cutoff_hz, progress=progress, **options)
    return replace(course, notes=notes)


def emg_law(
    recording: Recording | PathLike,
    *,
    flexor: str | None = None,
    extensor: str | None = None,
    imcj: Recording | PathLike | None = None,
    roles: Mapping[str, Literal["flexor", "extensor"]] | None = None,
    method: str | None = None,
    cutoff_hz: float | None | Literal["auto"] = "auto",
    decimation: int | Literal["auto"] = "auto",
    lowest_hz: float | None = None,
    joint: int = 1,
    condition: str | None = None,
    progress: Progress | None = None,
) -> EmgLaw:
    """Fit viscosity and stiffness of one joint as linear laws of the EMG of its muscles.

    One I, B, K is fitted to each trial; trials that allow none are left out, and the result's notes
    say why.

    Parameters
    ----------
    recording : Recording or path
        Kind "joint", trials at several levels of contraction, with EMG.
    flexor, extensor : str, optional
        Muscles of the law; by default the two of the recording, in their order.
    imcj : Recording or path, optional
        Isometric trials that calibrate the index of co-contraction, which is then told of each
        trial.
    roles : mapping of muscle to "flexor" or "extensor", optional
        For muscles of `imcj` whose names do not say it.
    method, cutoff_hz, decimation, lowest_hz, joint, condition
        See `elbow`.
    progress : callable, optional
        Called with the number of trials that are done and their total.

    Returns
    -------
    EmgLaw

    Raises
    ------
    InputError
        A recording cannot be read or used, a muscle is not in it, or too few trials allow a fit.
    NotIdentifiableError
        Amplitudes that do not vary, that vary together, or that are errors for the most part.
    EstimationError
        Weights and slopes do not settle.

    Examples
    --------
    >>> from armimpedance.analyses import emg_law
    >>> from manipulandum_sim.elbow import simulate_elbow
    >>> recording, _ = simulate_elbow("cocontraction", repetitions=1, duration_s=6.0)
    >>> emg_law(recording).stiffness.parameters.names
    ('k0', 'k_biceps', 'k_triceps')
    """
    options: dict[str, Any] = {
        "method": method,
        "cutoff_hz": cutoff_hz,
        "decimation": decimation,
        "lowest_hz": lowest_hz,
    }
    calibration = None
    if imcj is not None:
        with naming(imcj):
            calibration = calibrate_imcj(read_recording(imcj), roles=roles, joint=joint)
    with naming(recording):
        trials = of_condition(read_recording(recording), condition)
        pair = two_muscles(trials, flexor, extensor)
        fits, left_out = _each_trial(trials, joint, options, progress)
        rows, levels = list(fits), segment_amplitude(pair)
        amplitude, sd = levels.amplitude[rows], levels.sd[rows]
        law = fit_emg_law_of(list(fits.values()), amplitude, sd, muscles=pair.muscles)
        numbers = trials.trials["trial"].to_numpy()[rows]
        points = OperatingPoints.of(fits.values(), numbers, pair.muscles, amplitude)
        notes = (*levels.notes, *levels.warnings, *left_out)
        if calibration is not None:
            points, gains = _with_index(points, trials, rows, calibration)
            notes = (*notes, *gains)
    return replace(law, points=points, notes=notes)


def _each_trial(
    recording: Recording, joint: int, options: Mapping[str, Any], progress: Progress | None
) -> tuple[dict[int, ElbowFit], list[str]]:
    """Fits by the rows of the trial table that they are of, and why other rows have none."""
    fits, left_out = {}, []
    for row in range(recording.n_trials):
        try:
            fits[row] = identify_elbow(from_recording(recording.select([row]), joint), **options)
        except _NO_FIT as error:
            reason = getattr(error, "problem", str(error))
            left_out.append(f"trial {recording.trials['trial'].iloc[row]} left out: {reason}")
        if progress is not None:
            progress(row + 1, recording.n_trials)
    return fits, left_out


def _with_index(
    points: OperatingPoints, recording: Recording, rows: list[int], calibration: ImcjCalibration
) -> tuple[OperatingPoints, tuple[str, ...]]:
    """The points with the index of co-contraction, and what a reader must know of it."""
    muscles = calibration.muscles
    if missing := sorted(set(muscles) - set(recording.muscles)):
        raise InputError(
            f"no EMG of {', '.join(missing)}",
            expected=f"the muscles of the isometric trials: {', '.join(muscles)}",
        )
    levels = segment_amplitude(recording)
    columns = [recording.muscles.index(m) for m in muscles]
    amplitude, sd = (values[rows][:, columns] for values in (levels.amplitude, levels.sd))
    index, error = index_of(calibration, amplitude, sd)
    gains = ", ".join(f"{m} {g:.3g}" for m, g in zip(muscles, calibration.gains, strict=True))
    notes = (f"|a_i| of the index (Nm): {gains}", *calibration.warnings)
    return replace(points, imcj=index, sd_imcj=error), notes


def two_muscles(recording: Recording, flexor: str | None, extensor: str | None) -> Recording:
    """The recording with the EMG of flexor and extensor alone, in this order.

    Raises
    ------
    InputError
        There is no EMG, no such muscle, or which is which is not known.
    """
    muscles = recording.muscles
    if recording.emg is None or not muscles:
        raise InputError("no EMG in the recording", expected="columns emg_<muscle>")
    named = muscles if (flexor, extensor) == (None, None) else (flexor, extensor)
    if len(set(named)) != 2 or not set(named) <= set(muscles):
        raise InputError(
            f"which muscle of {', '.join(muscles)} flexes and which extends?",
            expected="flexor and extensor, each naming one of them",
        )
    columns = [muscles.index(str(m)) for m in named]
    pair = tuple(map(str, named))
    return replace(recording, emg=recording.emg[:, columns], muscles=pair)
