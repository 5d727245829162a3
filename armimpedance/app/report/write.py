"""The report of whatever a source is: its topic, its page, the file."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from armimpedance.app.inspection import inspect
from armimpedance.app.report.options import REPORT
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.inputs import unchanged
from armimpedance.core.json_text import read_json
from armimpedance.core.program import software
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.hand.show import is_results_file
from armimpedance.hand.still.show import plot_quality
from armimpedance.recordings import AnyRecording
from armimpedance.show.pages import (
    TOPICS,
    Asked,
    Block,
    Page,
    Printed,
    Section,
    methods_of,
    page_from,
    picture,
    reviewed,
    write_page,
)
from armimpedance.show.verbs.chosen import ChosenPath
from armimpedance.show.verbs.inspected import Inspection
from armimpedance.show.verbs.results import naming, without_trials

# Which topic a source belongs to, and its page.


def report_page(asked: Asked) -> Page:
    """The page of the topic that was asked for, or that the source belongs to.

    Returns: of a recording that a check stops, a page that says why and holds no result.
    Raises InputError: the source cannot be read, belongs to no topic, or several were given where
    one is reported.
    """
    if len(asked.sources) > 1:
        return _several(asked)
    if asked.source.suffix == ".json" or is_results_file(asked.source):
        chosen = ChosenPath.of(asked.source, None, None, asked.leave_out)
        if isinstance(chosen, ChosenPath):
            raise chosen.refused()
        return TOPICS.named(asked.topic or _of_results(asked.source)).page_of(asked)
    asked = _without_left_out(asked)
    inspection = _inspected(asked)
    asked = replace(asked, checks=inspection.checks)
    if any(stop.name not in asked.despite for stop in inspection.of_verdict("unusable")):
        return _stopped(asked, inspection)
    with naming(asked.source):
        return TOPICS.named(asked.topic or _of_recording(asked)).page_of(asked)


def _without_left_out(asked: Asked) -> Asked:
    """The recording is read once; what the checks see is what is analysed."""
    recording = asked.recording
    if asked.leave_out is None:
        return replace(asked, opened=recording)
    if not isinstance(recording, Recording):
        raise InputError(
            "trials of markers and motions", file=asked.source, expected="no list to leave out"
        )
    kept = without_trials(recording, asked.leave_out)
    return replace(asked, opened=kept, whole=recording)


def _inspected(asked: Asked) -> Inspection:
    """Inspect the recording; directions are judged here only if the groups are conditions."""
    inspection = inspect(asked.recording)
    if asked.by == ("condition",):
        return inspection
    kept = tuple(check for check in inspection.checks if check.name != "directions")
    return replace(inspection, checks=kept)


def _several(asked: Asked) -> Page:
    topic = asked.topic or "comparison"
    if topic != "comparison":
        raise InputError(
            f"{len(asked.sources)} sources of topic {topic}",
            expected="one source, or --topic comparison",
        )
    return TOPICS.named(topic).page_of(asked)


def _of_results(path: Path) -> str:
    """The topic of a file that a command wrote."""
    if path.suffix == ".json":
        return "muscle" if "model" in read_json(path, "a result") else "fit"
    return "hand"


def _of_recording(asked: Asked) -> str:
    recording: AnyRecording = asked.recording
    if asked.robot is not None or asked.arm is not None:
        return "therapy"
    if isinstance(recording, Recording):
        one_joint = recording.kind == "joint" and recording.perturbation == "stochastic"
        return "elbow" if one_joint else "hand"
    return "passive" if recording.wrenches is None else "body"


def _stopped(asked: Asked, inspection: Inspection) -> Page:
    """The page of a recording that cannot be analysed: what was seen, and why."""
    checks = inspection.checks
    contents = Section("What the recording holds", (Printed(inspection.contents),))
    return page_from(
        asked,
        checks,
        title="Not analysed",
        lead="A check says STOP: an analysis would give numbers without a meaning.",
        count="nothing was estimated",
        next_step="",
        reader=(*reviewed(checks), *_quality(asked.recording)),
        reviewer=[contents],
        methods=methods_of([f"The recording was checked with {software()}"], findings=checks),
    )


def _quality(recording: AnyRecording) -> Sequence[Section]:
    """The picture of the trials, where they can be drawn at all."""
    if not isinstance(recording, Recording):
        return ()
    caption = "All trials, as far as onsets are stated or seen."
    try:
        drawn: Block = picture(plot_quality(recording), "quality", caption)
    except ArmImpedanceError:
        return ()
    return (Section("Trials", (drawn,)),)


PathLike = str | os.PathLike[str]


@REPORT.function
def write_report(
    source: AnyRecording | PathLike | Sequence[PathLike],
    path: PathLike,
    *,
    topic: str | None = None,
    by: str | Sequence[str] = "condition",
    method: str | None = None,
    covariance: str = "cr3",
    seed: int = 0,
    force_by: Literal["limb", "device"] | None = None,
    despite: str | Collection[str] = (),
    leave_out: PathLike | None = None,
    robot: PathLike | None = None,
    arm: PathLike | None = None,
    command: str = "",
    progress: Progress | None = None,
) -> Page:
    """Analyse a session, or take results, and write one HTML file that needs no network.

    It says first whether the numbers can be trusted, then shows them with their intervals, then
    what a reviewer asks for, then how it was made, with a methods paragraph for a paper.

    Parameters
    ----------
    source : recording, path, or sequence of paths
        A recording, a RESULTS.csv, a FIT.json or a MODEL.json; several are compared.
    path : path
        The file to write; its name ends in .html.
    {options}
    command : str
        A command line that stands on the page.
    progress : function (done, all), optional
        Called while the analysis goes on.

    Returns
    -------
    Page
        What was written; `verdict` holds its three sentences.

    Raises
    ------
    InputError
        The source cannot be read or belongs to no topic, or the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=2, conditions=["cocontraction_10"])
    >>> with TemporaryDirectory() as folder:
    ...     page = ai.write_report(recording, Path(folder) / "report.html")
    >>> page.verdict.trust
    'The numbers can be used: 1 group, 16 trials.'
    """
    if Path(path).suffix != ".html":
        raise InputError(f"no ending {Path(path).suffix!r} here", file=path, expected=".html")
    opened, sources = _given(source)
    asked = Asked(
        sources=sources,
        topic=topic,
        by=(by,) if isinstance(by, str) else tuple(by),
        method=method,
        covariance=covariance,
        seed=seed,
        force_by=force_by,
        despite=(despite,) if isinstance(despite, str) else tuple(despite),
        leave_out=None if leave_out is None else Path(leave_out),
        robot=None if robot is None else Path(robot),
        arm=None if arm is None else Path(arm),
        command=command,
        opened=opened,
        progress=progress,
    )
    # The sums that stand on the page are of what was analysed.
    with unchanged(*(sources if opened is None else ()), leave_out, robot, arm):
        page = report_page(asked)
    write_page(page, Path(path))
    return page


def _given(
    source: AnyRecording | PathLike | Sequence[PathLike],
) -> tuple[AnyRecording | None, tuple[Path, ...]]:
    """A recording in memory under a name, or the paths."""
    if isinstance(source, str | os.PathLike):
        return None, (_as_path(source),)
    if isinstance(source, Sequence):
        if not source:
            raise InputError("nothing to report", expected="a recording or results")
        return None, tuple(map(_as_path, source))
    return source, (Path("session"),)


def _as_path(given: PathLike) -> Path:
    """A path as it is: one that says which trials are meant goes on saying it."""
    return given if isinstance(given, Path) else Path(given)
