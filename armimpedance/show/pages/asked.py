"""What the caller of a report asked for, and what it was made from."""

from __future__ import annotations

import platform
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from hashlib import file_digest
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, Literal

from armimpedance.core.findings import Finding
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.recordings import AnyRecording
from armimpedance.show.verbs.sources import read

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

    Parameters
    ----------
    asked : Asked
    options : sequence of (str, value)
        What the topic adds, such as the method; None is left out.

    Returns
    -------
    tuple of (str, str)
    """
    versions = ", ".join(f"{name} {version(name)}" for name in NAMED)
    said = [(name, str(value)) for name, value in options if value not in (None, (), "")]
    inputs = [(f"SHA-256 of {name}", digest) for name, digest in _hashes(asked)]
    command = [("command", asked.command)] if asked.command else []
    python = f"{platform.python_implementation()} {platform.python_version()}"
    return (*command, *said, ("versions", f"{versions}, {python}"), *inputs)


def _hashes(asked: Asked) -> Iterator[tuple[str, str]]:
    """The name and the SHA-256 of every file that was read."""
    given = (*asked.sources, asked.leave_out, asked.robot, asked.arm)
    # a recording that lives in memory has a name, no file
    for path in (path for path in given if path is not None and path.exists()):
        files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
        for file in files[:MOST_HASHED]:
            with file.open("rb") as stream:
                name = f"{path.name}/{file.relative_to(path)}" if path.is_dir() else path.name
                yield name, file_digest(stream, "sha256").hexdigest()
        if len(files) > MOST_HASHED:
            yield f"{path.name}: {len(files) - MOST_HASHED} more files", "not listed"
