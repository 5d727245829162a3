"""The verb of the report: from a session or results to one file."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Literal

from armimpedance.app.report.door import report_page
from armimpedance.core.errors import InputError
from armimpedance.core.inputs import unchanged
from armimpedance.core.progress import Progress
from armimpedance.recordings import AnyRecording
from armimpedance.show.pages import Asked, Page, write_page

PathLike = str | os.PathLike[str]


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
    topic : str, optional
        A name of `TOPICS`; default: what the source is.
    by : str or sequence of str
        Columns of the trial table whose groups are reported.
    method : str, optional
        An estimator of the topic; "all" sets every method of the hand side by side.
    covariance, seed, force_by, despite
        See `estimate`.
    leave_out : path, optional
        A list of trials that are left out, as ``armimpedance trials`` saves it.
    robot, arm : path, optional
        ROBOT.json and ARM.json of a therapy session.
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
        return None, (Path(source),)
    if isinstance(source, Sequence):
        if not source:
            raise InputError("nothing to report", expected="a recording or results")
        return None, tuple(Path(one) for one in source)
    return source, (Path("session"),)
