"""Stiffness and viscosity of one joint over EMG, trial by trial (Ruiz 2011, (4))."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any, Final, Literal

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.core.findings import Finding
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.joint.elbow.elbow_result import ElbowFit
from armimpedance.joint.elbow.emg.crosstalk import SUPPOSED, Crosstalk
from armimpedance.joint.elbow.emg.imcj import ImcjCalibration, calibrate_imcj, imcj as index_of
from armimpedance.joint.elbow.emg.law import fit_emg_law_of
from armimpedance.joint.elbow.emg.law_result import EmgLaw, OperatingPoints
from armimpedance.joint.elbow.samples import from_recording
from armimpedance.joint.elbow.show.options import EMG_LAW
from armimpedance.joint.elbow.stationary.identify import identify_elbow
from armimpedance.numerics.criticism import check_joint_size
from armimpedance.numerics.signals import segment_amplitude
from armimpedance.show.verbs.checks import checked
from armimpedance.show.verbs.results import PathLike, naming, read_recording

_Action = Literal["flexor", "extensor"]

#: Errors of a trial that cannot be fitted alone.
_NO_FIT: Final = (InputError, EstimationError, NotIdentifiableError)


@EMG_LAW.function
def emg_law(
    recording: Recording | PathLike,
    *,
    flexor: str | None = None,
    extensor: str | None = None,
    imcj: Recording | PathLike | None = None,
    method: str | None = None,
    cutoff_hz: float | None | Literal["auto"] = "auto",
    decimation: int | Literal["auto"] = "auto",
    lowest_hz: float | None = None,
    joint: int = 1,
    condition: str | None = None,
    despite: str | Collection[str] = (),
    roles: Mapping[str, _Action] | None = None,
    progress: Progress | None = None,
) -> EmgLaw:
    """Fit viscosity and stiffness of one joint as linear laws of the EMG of its muscles.

    I, B, K are fitted to each trial. Trials that cannot be fitted are left out; the result's notes
    give the reason.

    Parameters
    ----------
    recording : Recording or path
        Kind "joint", trials at several levels of contraction, with EMG.
    {options}
    roles : mapping of muscle to "flexor" or "extensor", optional
        For muscles of `imcj` whose names do not show their role.
    progress : callable, optional
        Called with the number of trials that are done and their total.

    Returns
    -------
    EmgLaw
        The laws of K and B, the trials' points that they were fitted to, and notes.

    Raises
    ------
    InputError
        A recording cannot be read or used, a check of `inspect` says STOP, a muscle is not in it,
        or too few trials allow a fit.
    NotIdentifiableError
        Amplitudes that do not vary, that vary together, or that are mostly errors.
    EstimationError
        Weights and slopes do not converge.

    Examples
    --------
    >>> from armimpedance.joint.elbow.show import emg_law
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
        trials = read_recording(recording, condition=condition)
        pair = two_muscles(trials, flexor, extensor)
        marks = checked(trials, despite)
        crosstalk = Crosstalk.of(pair)
        # EMG that cannot be used is refused before anything is fitted
        levels = segment_amplitude(crosstalk.own(pair))
        fits, left_out = _each_trial(trials, joint, options, progress)
        rows = list(fits)
        amplitude, sd = levels.amplitude[rows], levels.sd[rows]
        stated = {} if flexor is None or extensor is None else _told(flexor, extensor)
        torque = [trials.force[trials.samples_of(row), joint - 1].mean() for row in rows]
        expected = from_recording(trials, joint).expected_inertia
        law = _law_of(
            fits, pair, crosstalk, amplitude, sd, torque, {**stated, **(roles or {})}, expected
        )
        numbers = trials.trials["trial"].to_numpy()[rows]
        points = OperatingPoints.of(fits.values(), numbers, pair.muscles, amplitude)
        notes = (*levels.notes, *levels.warnings, *left_out)
        if calibration is not None:
            points, gains = _with_index(points, trials, rows, calibration)
            notes = (*notes, *gains)
    return replace(law, points=points, notes=(*marks, *notes))


def _law_of(
    fits: Mapping[int, ElbowFit],
    pair: Recording,
    crosstalk: Crosstalk,
    amplitude: FloatArray,
    amplitude_sd: FloatArray,
    held_Nm: list[float],
    roles: Mapping[str, _Action],
    expected: float | None,
) -> EmgLaw:
    """Law of the trials' fits, with crosstalk and the muscles' names checked."""
    rows, of_fits = list(fits), list(fits.values())

    def law_of(own: FloatArray, **more: Any) -> EmgLaw:
        remaining = 0.0 if crosstalk.told else SUPPOSED
        return fit_emg_law_of(
            of_fits, own, amplitude_sd, muscles=pair.muscles, crosstalk_sd=remaining, **more
        )

    law = law_of(amplitude, torque=held_Nm, roles=roles)
    for near in crosstalk.neighbours(pair):
        law = law.widened_to(law_of(segment_amplitude(near).amplitude[rows]))
    own = (crosstalk.finding(pair.muscles),) if crosstalk.told else ()
    return replace(law, of_trials=(*own, *law.of_trials, _size(fits, expected)))


def _told(flexor: str, extensor: str) -> dict[str, _Action]:
    """Roles of the two muscles, as stated by the caller."""
    return {flexor: "flexor", extensor: "extensor"}


def _size(fits: Mapping[int, ElbowFit], expected: float | None) -> Finding:
    """Check the trials' median inertia: of a joint's size, and this person's."""
    inertia = [fit.inertia for fit in fits.values()]
    middle = sorted(inertia, key=lambda value: value.value)[len(inertia) // 2]
    return check_joint_size("inertia", middle.value, middle.sd_robust, expected)


def _each_trial(
    recording: Recording, joint: int, options: Mapping[str, Any], progress: Progress | None
) -> tuple[dict[int, ElbowFit], list[str]]:
    """Fits by row of the trial table, and the reasons for rows without a fit."""
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
    """Return the points with the index of co-contraction, and notes on it."""
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
    notes = (f"|a_i| of the index (N m): {gains}", *calibration.warnings)
    return replace(points, imcj=index, sd_imcj=error), notes


def two_muscles(recording: Recording, flexor: str | None, extensor: str | None) -> Recording:
    """Return the recording with the EMG of only flexor and extensor, in this order.

    Raises InputError: there is no EMG, no such muscle, or their roles are not known.
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
