"""Inspection of a recording: its contents, whether it can be used, and what is missing."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any, Final, Literal

import numpy as np

from armimpedance.core.errors import (
    ArmImpedanceError,
    EstimationError,
    InputError,
    NotIdentifiableError,
)
from armimpedance.core.findings import Finding, Verdict
from armimpedance.core.records import Recording
from armimpedance.core.workers import single_threaded
from armimpedance.hand.random import check_wrist, identify_random
from armimpedance.hand.reaching import check_pushes, identify_movement
from armimpedance.hand.still import check_response
from armimpedance.joint.body import check_plates
from armimpedance.joint.elbow import estimate_joint, from_recording
from armimpedance.numerics.criticism import refuse_joint_size
from armimpedance.recordings import AnyRecording
from armimpedance.show.text import describe
from armimpedance.show.verbs.checks import TopicChecks, findings_of
from armimpedance.show.verbs.inspected import Fact, Inspection
from armimpedance.show.verbs.results import PathLike, read


def _of_response(recording: Recording) -> Sequence[Finding]:
    """Findings on the response of a limb to any kind of perturbation."""
    if recording.perturbation != "stochastic":
        return check_response(recording)
    if recording.kind == "joint" and recording.torque is None:
        # which is said to be missing
        return ()
    if recording.axes > 1:
        return check_wrist(recording) or _fitted("random", recording, identify_random)
    return _fitted("elbow", recording, _fit_joint)


def _of_reaches(recording: Recording) -> Sequence[Finding]:
    """Findings on pushed reaches."""
    findings = check_pushes(recording)
    if any(one.verdict == "unusable" for one in findings):
        return findings
    return [*findings, *_fitted("movement", recording, identify_movement)]


def _fit_joint(recording: Recording) -> None:
    """Refuse a joint whose inertia no person has.

    Raises NotIdentifiableError: no fit, or no joint's, of a record that is moved at will, or held,
    and meant for its EMG, perhaps.
    """
    samples = from_recording(recording)
    try:
        parameters = estimate_joint(samples)
    except (EstimationError, InputError) as error:
        raise NotIdentifiableError(str(error), ("I", "B", "K")) from error
    refuse_joint_size(float(parameters.values[0]), float(parameters.sd[0]))


def _fitted(
    verb: str, recording: Recording, fit: Callable[[Recording], object]
) -> tuple[Finding, ...]:
    """The finding "fit": these experiments tell units, signs and axes only by their fit."""
    try:
        fit(recording)
    except (EstimationError, InputError) as error:
        # of several axes under random forces `elbow` may take one, and `estimate` asks no commands
        other = isinstance(error, InputError) and verb == "random"
        verdict: Verdict = "warning" if other else "unusable"
        return (Finding("fit", verdict, f"`{verb}` refuses it: {error}"),)
    except (ArmImpedanceError, np.linalg.LinAlgError) as error:
        return (Finding("fit", "warning", f"`{verb}` cannot fit it: {error}"),)
    return (Finding("fit", "ok", f"`{verb}` fits it, and finds the inertia of a person"),)


#: What the topics judge; a new topic's check is added here.
OF_ALL_TOPICS: Final = TopicChecks(_of_response, _of_reaches, check_plates)


@single_threaded
def inspect(
    recording: AnyRecording | PathLike,
    *,
    force_by: Literal["limb", "device"] | None = None,
    title: str | None = None,
    **options: Any,
) -> Inspection:
    """Say what a recording holds, whether it can be used, and what is missing.

    Parameters
    ----------
    recording : Recording, MarkerRecording, MotionRecording or path
        What is looked at; a path may be of any format that `read` opens.
    force_by : {"limb", "device"}, optional
        Whose force on the other a Kinarm's sensor holds.
    title : str, optional
        What the recording is called in the result; its path if absent.
    **options
        What the file does not say itself; see `read`.

    Returns
    -------
    Inspection
        It prints as the command ``armimpedance inspect`` does.

    Raises
    ------
    InputError
        It cannot be read. A recording that can be read but not used is no error: see
        `Inspection.usable`.

    Examples
    --------
    >>> from armimpedance.app.inspection import inspect
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> inspected = inspect(recording)
    >>> inspected.usable
    True
    >>> list(inspected.to_frame().columns)
    ['check', 'verdict', 'message']
    """
    opened = read(recording, force_by=force_by, **options)
    if title is None:
        title = os.fspath(recording) if isinstance(recording, str | os.PathLike) else "A recording"
    return Inspection(
        describe(opened, title), tuple(findings_of(opened, OF_ALL_TOPICS)), tuple(_facts(opened))
    )


def _facts(recording: AnyRecording) -> list[Fact]:
    """Counts of a recording: trials, conditions, duration, rate."""
    rate = float(recording.sample_rate_hz)
    facts = [
        Fact("subject", str(recording.subject.id)),
        Fact("trials", int(recording.n_trials)),
        Fact("conditions", int(recording.trials["condition"].nunique())),
        Fact("duration", len(recording.time_s) / rate, "s"),
        Fact("sample rate", rate, "Hz"),
    ]
    if not isinstance(recording, Recording):
        return facts
    limb = [Fact("limb", recording.kind), Fact("perturbation", recording.perturbation)]
    return [*limb, *facts, Fact("axes", int(recording.axes)), Fact("muscles", _muscles(recording))]


def _muscles(recording: Recording) -> int:
    return 0 if recording.emg is None else len(recording.muscles)
