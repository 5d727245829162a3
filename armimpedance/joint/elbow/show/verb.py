"""One joint under a random perturbation, at one operating point (Ruiz 2011)."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from typing import Any, Final, Literal

import numpy as np

from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.joint.elbow.elbow_result import ElbowFit
from armimpedance.joint.elbow.samples import JointSamples, from_recording, pieces_of
from armimpedance.joint.elbow.show.options import ELBOW
from armimpedance.joint.elbow.stationary.identify import estimate_joint, identify_elbow
from armimpedance.numerics.criticism import SessionWords, check_inertia_over, refuse_joint_size
from armimpedance.show.verbs.checks import checked
from armimpedance.show.verbs.results import PathLike, naming, read_recording

#: Start of the label of a part that is one trial.
_TRIAL: Final = "trial "
_WORDS: Final = SessionWords(
    "trial",
    "I",
    "a gain of the torque or the angle, or another person",
    "another limb, or another strap or posture",
)
#: Words for a record with few trials, whose pieces are compared instead.
_PIECES: Final = replace(_WORDS, part="piece")
#: Errors of a part of a recording that cannot be fitted alone.
_NO_FIT: Final = (InputError, EstimationError, NotIdentifiableError)


@ELBOW.function
def elbow(
    recording: Recording | PathLike,
    *,
    method: str | None = None,
    cutoff_hz: float | None | Literal["auto"] = "auto",
    decimation: int | Literal["auto"] = "auto",
    lowest_hz: float | None = None,
    imposed: str | None = None,
    joint: int = 1,
    condition: str | None = None,
    despite: str | Collection[str] = (),
    progress: Progress | None = None,
) -> ElbowFit:
    """Fit inertia, viscosity and stiffness of one joint about an operating point.

    All trials are fitted together. The result's `parts` are separate fits of each condition if
    there are several, else of each trial.

    Parameters
    ----------
    recording : Recording or path
        Kind "joint", under a random perturbation.
    {options}
    progress : callable, optional
        Called with the number of fits that are done and their total.

    Returns
    -------
    ElbowFit
        I, B and K of all trials together with their standard errors; `parts` holds the other fits.

    Raises
    ------
    InputError
        The recording cannot be read or used, a check of `inspect` says STOP; an unknown method or
        condition.
    NotIdentifiableError
        The motion does not allow I, B and K to be separated.
    EstimationError
        The result is not a joint's, or not of a person's size, or a search does not converge.

    Examples
    --------
    >>> from armimpedance.joint.elbow.show import elbow
    >>> from manipulandum_sim.elbow import simulate_bench
    >>> recording, _ = simulate_bench(0.07, 1.2, 20.0, trials=2, duration_s=6.0, snr_db=40.0)
    >>> fit = elbow(recording)
    >>> fit.stiffness.unit, round(fit.stiffness.value)
    ('N m/rad', 20)
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
        chosen = read_recording(recording, condition=condition)
        selections, tell = _parts(chosen), progress or (lambda *_: None)
        samples = from_recording(chosen, joint, imposed)
        marks = checked(chosen, despite)
        tell(0, 1 + len(selections))
        whole = identify_elbow(samples, **options)
        refuse_joint_size(whole.inertia.value, whole.inertia.sd_robust)
        pieces = {} if _has_conditions(selections) else pieces_of(samples)
        parts = {}
        for done, (name, rows) in enumerate(selections.items(), start=1):
            tell(done, 1 + len(selections))
            try:
                samples = from_recording(chosen.select(rows), joint, imposed)
                parts[name] = identify_elbow(samples, **options)
            except _NO_FIT:
                continue
        tell(1 + len(selections), 1 + len(selections))
    session = _session(parts) or _over_pieces(pieces)
    return replace(
        whole,
        parts=parts,
        checks=(*whole.checks, *session),
        warnings=(*marks, *whole.warnings, *warnings_of(session), *_pooled_though(parts)),
    )


def _parts(recording: Recording) -> dict[str, np.ndarray]:
    """Trials of each condition, if there are several, else of each trial, as masks."""
    trials = recording.trials
    label = trials["condition"].astype(str)
    if label.nunique() < 2:
        label = _TRIAL + trials["trial"].astype(str)
    names = label.unique() if label.nunique() > 1 else ()
    return {name: (label == name).to_numpy() for name in names}


def _has_conditions(names: Iterable[str]) -> bool:
    return any(not name.startswith(_TRIAL) for name in names)


def _session(parts: Mapping[str, ElbowFit]) -> tuple[Finding, ...]:
    """Return the finding "session": a limb's inertia does not change from trial to trial.

    Empty if the parts are not trials, or too few.
    """
    if not parts or _has_conditions(parts):
        return ()
    fits = [part.parameters for part in parts.values()]
    numbers = np.array([fit.values for fit in fits]), np.array([fit.sd for fit in fits])
    return check_inertia_over(list(parts), {"": numbers}, _WORDS)


def _over_pieces(pieces: Mapping[str, JointSamples]) -> tuple[Finding, ...]:
    """Same check for a record of one or two long trials, whose pieces are fitted without further
    tests.
    """
    labels, fits = [], []
    for label, samples in pieces.items():
        try:
            fits.append(estimate_joint(samples))
        except _NO_FIT:
            continue
        labels.append(label)
    numbers = np.array([fit.values for fit in fits]), np.array([fit.sd for fit in fits])
    return check_inertia_over(labels, {"": numbers}, _PIECES) if fits else ()


def _pooled_though(parts: Mapping[str, ElbowFit]) -> tuple[str, ...]:
    """Warning if conditions differ by more than their intervals allow."""
    if not _has_conditions(parts):
        return ()
    limits = np.array([part.parameters.interval() for part in parts.values()])
    values = np.array([part.parameters.values for part in parts.values()])
    # limits (parts, 3, 2): no value of a parameter lies within all of its intervals
    disagree = np.flatnonzero(limits[..., 0].max(axis=0) > limits[..., 1].min(axis=0))
    lowest, highest = values.min(axis=0), values.max(axis=0)
    apart = [f"{'IBK'[j]} from {lowest[j]:.3g} to {highest[j]:.3g}" for j in disagree]
    warning = f"pooled, though its conditions differ beyond their intervals: {', '.join(apart)}"
    return (warning,) if apart else ()
