"""What a recording holds, whether it can be used, and what is missing."""

from __future__ import annotations

import os
from typing import Any, Final, Literal

from armimpedance.core.records import Recording
from armimpedance.hand.reaching import check_pushes
from armimpedance.hand.still import check_response
from armimpedance.joint.body import check_plates
from armimpedance.recordings import AnyRecording
from armimpedance.show.text import describe
from armimpedance.show.verbs.checks import TopicChecks, findings_of
from armimpedance.show.verbs.inspected import Fact, Inspection
from armimpedance.show.verbs.results import PathLike, read

#: What the topics judge; a new topic's check is added here.
OF_ALL_TOPICS: Final = TopicChecks(check_response, check_pushes, check_plates)


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
    """How much a recording holds."""
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
