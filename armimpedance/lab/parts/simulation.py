"""Common parts of the rigs behind `armimpedance simulate`: record, options, files."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol

from armimpedance.core.method_table import MethodTable
from armimpedance.core.progress import Progress
from armimpedance.lab.lab_forms import FORMS, form_for
from armimpedance.show.command.outputs import OutputPath, add_replace, check_folder, check_seed

if TYPE_CHECKING:
    from armimpedance.recordings import AnyRecording

TRUTH_FILE: Final = "truth.json"

#: The robot of a therapy session before it was identified.
DRAWINGS_FILE: Final = "drawings.json"

#: Moment arms of another person, as anatomy has them, beside a session with EMG in space.
MOMENT_ARMS_FILE: Final = "moment_arms.csv"

#: What may lie beside the files of a session.
BESIDE: Final = (TRUTH_FILE, DRAWINGS_FILE, MOMENT_ARMS_FILE)

#: Level of noise -> noise of a filmed marker, m.
MARKER_NOISE_M: Final = {"nominal": 0.5e-3, "sensor": 0.5e-3, "none": 0.0}


class Truth(Protocol):
    """Truth of a simulated subject."""

    def write(self, path: Path, /) -> None:
        """Write it to a JSON file."""


@dataclass(frozen=True)
class Simulated:
    """Output of a rig: a recording, its truth, and further files.

    `beside`: further files of the folder: name -> what writes it to a path.
    """

    recording: AnyRecording
    truth: Truth
    beside: Mapping[str, Callable[[Path], None]] = field(default_factory=dict)


#: What a rig is told of its own name, the options and the progress, and what it gives.
Simulate = Callable[[Any, argparse.Namespace, Progress], Simulated]


@dataclass(frozen=True)
class SimulatedRig:
    """A simulated experiment: one subcommand of `armimpedance simulate`.

    `name`, `line`: the subcommand and its line in the overview.
    `options`: an example's options.
    `simulate`: the rig's name, the options and a callback for the progress -> `Simulated`.
    `add_options`: adds the options that this rig has beside those of all.
    `subjects`: how the help lists its subjects; "" where there is none to choose.
    `noise`: names of its levels of noise, the default first.
    """

    name: str
    line: str
    options: str
    simulate: Simulate
    add_options: Callable[[argparse.ArgumentParser], None] | None = None
    subjects: str = ""
    noise: tuple[str, ...] = tuple(MARKER_NOISE_M)

    @property
    def about(self) -> str:
        """First lines of the subcommand's help."""
        sentence = self.line[0].upper() + self.line[1:]
        return f"{sentence}.\n\nExample:\n  armimpedance simulate {self.name} {self.options}"

    def configure(self, parser: argparse.ArgumentParser) -> None:
        """Arguments of the subcommand."""
        parser.add_argument("--out", type=OutputPath, required=True, metavar="FOLDER")
        if self.subjects:
            parser.add_argument("--subject", metavar="NAME", help=self.subjects)
        parser.add_argument("--seed", type=int, default=0, help="of all random numbers (0)")
        parser.add_argument("--noise", choices=self.noise, default=self.noise[0])
        if self.add_options is not None:
            self.add_options(parser)
        parser.add_argument("--table", choices=("parquet", "csv"), default="parquet")
        parser.add_argument(
            "--as",
            dest="form",
            choices=FORMS.names,
            help="write a laboratory's own files instead of a recording, beside their truth",
        )
        add_replace(parser)
        parser.set_defaults(run=partial(run, self))


#: Each family of rigs is a file in the folder, with the record RIGS.
FAMILIES: Final = MethodTable[tuple[SimulatedRig, ...]](
    "armimpedance.lab.simulated", "RIGS", "family", default="hand"
)


def run(rig: SimulatedRig, arguments: argparse.Namespace) -> int:
    """Simulate, write recording and truth, say what is there."""
    from armimpedance.show.command.screen import bar
    from armimpedance.show.text import describe

    check_seed(arguments.seed)
    if arguments.form is None:
        check_folder(arguments.out, simulated_files(), replace=arguments.replace)
    else:
        names = (*FORMS[arguments.form].names, *BESIDE)
        check_folder(arguments.out, names, replace=arguments.replace, mark=TRUTH_FILE)
    with bar("simulating") as progress:
        made = rig.simulate(rig.name, arguments, progress)
    if arguments.form is None:
        write_simulated(made.recording, made.truth, arguments.out, arguments.table, made.beside)
        place = arguments.out
    else:
        place = write_as(arguments.form, made, arguments.out)
    print(describe(made.recording, str(place)))
    for name in made.beside:
        print(f"\nbeside it: {arguments.out / name}")
    return 0


def write_as(name: str, made: Simulated, folder: Path) -> Path:
    """Write a laboratory's own files and their truth, all or none; the file to read.

    `name`: of the form.
    Raises InputError: such files cannot hold the recording, or the folder holds something else.
    """
    from armimpedance.core.outputs import staged_folder

    form = form_for(name, made.recording)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with staged_folder(folder, TRUTH_FILE, (*form.names, *BESIDE)) as staged:
        form.write(made.recording, staged)
        _write_beside(made.truth, made.beside, staged)
    return folder / form.names[0]


def write_simulated(
    recording: AnyRecording,
    truth: Truth,
    folder: Path,
    table: Literal["parquet", "csv"] = "parquet",
    beside: Mapping[str, Callable[[Path], None]] | None = None,
) -> None:
    """Write a recording with its truth and further files beside it, all or none."""
    from armimpedance.core.outputs import staged_folder
    from armimpedance.recordings import write_recording

    folder.parent.mkdir(parents=True, exist_ok=True)
    with staged_folder(folder, known=simulated_files()) as staged:
        write_recording(recording, staged, table)
        _write_beside(truth, beside or {}, staged)


def _write_beside(truth: Truth, beside: Mapping[str, Callable[[Path], None]], folder: Path) -> None:
    for name, write in beside.items():
        write(folder / name)
    truth.write(folder / TRUTH_FILE)


def simulated_files() -> tuple[str, ...]:
    """Names that the folder of a simulated recording may hold."""
    from armimpedance.recordings import FOLDER_FILES

    return (*FOLDER_FILES, *BESIDE)


def given(**options: Any) -> dict[str, Any]:
    """The options that were given; those that are None stay the simulator's own defaults."""
    return {name: value for name, value in options.items() if value is not None}
