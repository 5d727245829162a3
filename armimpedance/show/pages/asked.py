"""The caller's options of a report, and the parts that the pages of all topics share."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import file_digest
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from armimpedance.core.findings import Finding, gravity
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.recordings import AnyRecording
from armimpedance.show.pages.page import Checks, Methods, Page, Printed, Section, Verdict
from armimpedance.show.verbs.results import read

if TYPE_CHECKING:
    import pandas as pd

#: Packages whose versions stand on the page beside the project's own.
NAMED: Final = ("armimpedance", "numpy", "scipy", "pandas", "matplotlib")
#: Files of a folder that are hashed one by one; a folder of more is said by its number of files.
MOST_HASHED: Final = 12


@dataclass(frozen=True)
class Asked:
    """The sources of a report and the options of its analysis.

    Attributes
    ----------
    sources : tuple of Path
        Recordings or results.
    topic : str or None
        None: found from the sources.
    by : tuple of str
        Columns whose groups are reported.
    method : str or None
        Estimator; "all" sets every method beside the default; None is the default.
    covariance : str
        How intervals of the hand follow from the spread between trials.
    seed : int
    force_by : {"limb", "device"} or None
    despite : tuple of str
        Checks whose STOP is overruled.
    leave_out : Path or None
        A list of trials that are left out, of the hand.
    robot, arm : Path or None
        What a therapy session needs beside itself.
    command : str
        The command line, as it stands on the page.
    opened : recording or None
        The only source, where it is a recording that was read already.
    whole : Recording or None
        The same with the trials that `leave_out` takes from it.
    checks : tuple of Finding
        What the checks of that recording found.
    progress : function (done, all) or None
    """

    sources: tuple[Path, ...]
    topic: str | None = None
    by: tuple[str, ...] = ("condition",)
    method: str | None = None
    covariance: str = "cr3"
    seed: int = 0
    force_by: Literal["limb", "device"] | None = None
    despite: tuple[str, ...] = ()
    leave_out: Path | None = None
    robot: Path | None = None
    arm: Path | None = None
    command: str = ""
    opened: AnyRecording | None = None
    whole: Recording | None = None
    checks: tuple[Finding, ...] = ()
    progress: Progress | None = None

    @property
    def source(self) -> Path:
        """The only source, or the first of several."""
        return self.sources[0]

    @property
    def checks_without_emg(self) -> tuple[Finding, ...]:
        """The checks of the recording that matter where its EMG is not used."""
        return tuple(check for check in self.checks if not check.name.startswith("EMG"))

    @property
    def recording(self) -> AnyRecording:
        """The only source as a recording.

        Raises
        ------
        InputError
            It cannot be read.
        """
        return read(self.source, force_by=self.force_by) if self.opened is None else self.opened


def made_from(asked: Asked, options: Sequence[tuple[str, Any]] = ()) -> tuple[tuple[str, str], ...]:
    """Versions, command, options and hashes: what the page says of how it was made.

    `options` sequence of (str, value): what the topic adds, such as the method; None is left out.
    """
    versions = ", ".join(f"{name} {version(name)}" for name in NAMED)
    pairs = [(name, str(value)) for name, value in options if value not in (None, (), "")]
    inputs = [(f"SHA-256 of {name}", digest) for name, digest in _hashes(asked)]
    command = [("command", asked.command)] if asked.command else []
    python = f"{platform.python_implementation()} {platform.python_version()}"
    return (*command, *pairs, ("versions", f"{versions}, {python}"), *inputs)


def _hashes(asked: Asked) -> Iterator[tuple[str, str]]:
    """The name and the SHA-256 of every file that was read."""
    paths = (*asked.sources, asked.leave_out, asked.robot, asked.arm)
    # a recording that lives in memory has a name, no file
    for path in (path for path in paths if path is not None and path.exists()):
        files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
        for file in files[:MOST_HASHED]:
            with file.open("rb") as stream:
                name = f"{path.name}/{file.relative_to(path)}" if path.is_dir() else path.name
                yield name, file_digest(stream, "sha256").hexdigest()
        if len(files) > MOST_HASHED:
            yield f"{path.name}: {len(files) - MOST_HASHED} more files", "not listed"


# The three sentences that a reader wants first, from what the checks found.

#: Name of a check -> what to do where it is violated or cannot tell; names that several topics
#: share mean the same in each.
ADVICE: Final = {
    "units": "Give SI units (N, N m, m, rad) and analyse again.",
    "clipping": "Use a sensor with more range, or leave the trials out that are clipped.",
    "force sign": "Say whose force the sensor holds (--force-by), or turn the sign of all axes.",
    "force scale": "Hang a known weight on the sensor and give the force in newtons.",
    "axes": "Push the handle by hand along each axis and see which column answers.",
    "force axes": "Push the handle by hand along each axis and see which column answers.",
    "delay": "Record force and motion on one clock, or say how much later one of them is.",
    "filter": "Record force and position through one filter, or through none.",
    "session": "Look at the trial that is named, calibrate the sensor, and analyse the parts apart "
    "(--by set).",
    "labels": "Look at the protocol of the set that is named, and at its labels.",
    "skew": "Record all channels on one clock, or say how much later one of them is.",
    "reflex": "Take the limb's own part with its interval; shorter disturbances, or random ones "
    "of a wider band, part it better.",
    "own motion": "Take --method instruments or frequency, repeat each direction more often, or a "
    "robot that imposes the motion.",
    "amplitude": "Use smaller motions, and say at which amplitude the numbers hold.",
    "lack of fit": "Look at the residuals, and at what the message names.",
    "copies": "Take the copies out: each trial counts once.",
    "imposed": "Say in recording.json what the rig imposes, and record its command.",
    "voluntary": "Ask for a steady contraction, record longer, or disturb more strongly.",
    "muscles": "Leave out the trials in which a muscle works.",
    "muscles silent": "Record EMG, or leave out the trials in which a muscle works.",
    "mass": "Weigh or scale the segments, and say how well the masses are known.",
    "lengths": "Measure both lengths from bony landmarks.",
    "reach": "Measure where the shoulder is in the robot's frame, in metres.",
    "directions": "Disturb in all directions in every condition, or group trials by another column "
    "(--by).",
    "disturbance": "Look at the trials that the message names; leave them out.",
    "returns to start": "Any method but `paper` allows for a hand that does not return.",
    "coherence": "Look whether something disturbed the limb at all, and at its units.",
    "up axis": "Name the file's axes forward, left and up where it is converted (--axes).",
    "inner mode": "Hold the elbow, or stay out for 0.3 s and longer.",
    "crosstalk": "Move the electrodes apart, or record the raw EMG.",
    "curvature": "Fit the law over a smaller range.",
    "rest angle": "Leave the rest angle free unless it was measured.",
    "trials": "Record more trials.",
}
_OTHERWISE: Final = "Read the check below and decide whether it matters for your question."
_UNCHECKED: Final = (
    "No result carries a warning; a file of results holds no trials that could be checked again."
)
#: What weighs most comes first.
_BAD: Final = ("unusable", "warning", "cannot tell")
_ORDER: Final = (*_BAD, "missing", "ok")


def gravest_first(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Sort findings: those that stop an analysis, warnings, missing facts, passed checks.

    Parameters
    ----------
    findings : iterable of Finding

    Returns
    -------
    tuple of Finding
        Those of one verdict by the gravity of what was looked at.
    """
    return tuple(sorted(findings, key=lambda f: (_ORDER.index(f.verdict), gravity(f.name))))


def verdict_of(findings: Sequence[Finding], next_step: str, count: str) -> Verdict:
    """The verdict of a page: can the numbers be trusted, what is wrong, what to do next.

    `findings`: all checks, of the data and of the fits.
    `next_step`: what to do where nothing is wrong.
    `count`: what is judged, such as "7 conditions".
    """
    bad = [f for f in gravest_first(findings) if f.verdict in _BAD]
    passed = sum(f.verdict == "ok" for f in findings)
    if not bad:
        looked = f"{passed} checks looked for violations and found none." if passed else _UNCHECKED
        return Verdict("ok", f"The numbers can be used: {count}.", looked, next_step)
    first = bad[0]
    advice = ADVICE.get(first.name, _OTHERWISE)
    names = list(dict.fromkeys(f.name or "a check" for f in bad))
    more = f" (also: {', '.join(names[1:])})" if len(names) > 1 else ""
    wrong = f"{first.sentence.rstrip('.')}{more}."
    if first.verdict == "unusable":
        return Verdict("unusable", f"These numbers cannot be used: {count}.", wrong, advice)
    trust = f"Use the numbers with care: {_why(first)}; {count}."
    return Verdict("warning", trust, wrong, advice)


def _why(first: Finding) -> str:
    if not first.name:
        return "there is a warning"
    if first.verdict == "cannot tell":
        return f"{first.name} could not be told from these data"
    return f"the check of {first.name} failed"


# How a page is put together: what stands on the pages of all topics, and where.


def page_from(
    asked: Asked,
    findings: Sequence[Finding],
    *,
    title: str,
    lead: str,
    count: str,
    next_step: str,
    reader: Sequence[Section],
    reviewer: Sequence[Section],
    methods: Methods,
    options: Sequence[tuple[str, Any]] = (),
    data: Mapping[str, pd.DataFrame] | None = None,
) -> Page:
    """A page whose verdict follows from the findings, and that says how it was made.

    Parameters
    ----------
    asked : Asked
    findings : sequence of Finding
        All checks, of the data and of the fits.
    title : str
        What is reported; the names of the sources follow it.
    lead : str
    count, next_step : str
        See `verdict_of`.
    reader, reviewer : sequence of Section
    methods : Methods
    options : sequence of (str, value)
        See `made_from`.
    data : mapping from a name to a DataFrame, optional

    Returns
    -------
    Page
    """
    return Page(
        title=f"{title}: {', '.join(path.stem for path in asked.sources)}",
        lead=lead,
        verdict=verdict_of(findings, next_step, count),
        reader=tuple(reader),
        reviewer=tuple(reviewer),
        methods=methods,
        made=made_from(asked, options),
        data=data or {},
    )


def reviewed(findings: Sequence[Finding], printed: str = "", caption: str = "") -> list[Section]:
    """The checks with their caption, the gravest first, and the command's own text, if any."""
    checks = [Section("Checks", (Checks(gravest_first(findings), caption),))] if findings else []
    text = [Section("As the command prints it", (Printed(printed),))] if printed else []
    return checks + text


# A topic of the report: which sources are its own, and how they become a page.


@dataclass(frozen=True)
class Topic:
    """One topic; its name is that of its file.

    Attributes
    ----------
    what : str
        What it reports, for help texts.
    page_of : function
        From what was asked to the page; an `InputError` says what cannot be read, or which check
        stops the analysis.
    """

    what: str
    page_of: Callable[[Asked], Page]
