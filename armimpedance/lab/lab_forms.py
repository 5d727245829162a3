"""The forms in which a simulated session is written as a laboratory's own files."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from armimpedance.core.errors import InputError
from armimpedance.core.method_table import RecordTable
from armimpedance.show.command.options import SHARED_FORMS

if TYPE_CHECKING:
    from armimpedance.core.motion import MarkerRecording, MotionRecording
    from armimpedance.core.records import Recording
    from armimpedance.recordings import AnyRecording


Holds = Literal["hand", "joint", "markers", "motion"]


@dataclass(frozen=True)
class LabForm:
    """Files as a laboratory has them.

    `line`: what the help says of it.
    `holds`: kinds of recordings that such files can hold.
    `names`: what is written into the folder, the file or folder to read first.
    `write`: writes a recording into an empty folder.
    """

    line: str
    holds: tuple[Holds, ...]
    names: tuple[str, ...]
    write: Callable[[Any, Path], None]


# A dataset of Motion-BIDS, with the mapping of its channels in `code`.


def _write_bids(recording: AnyRecording, folder: Path) -> None:
    (folder / "dataset").mkdir()
    SHARED_FORMS["bids"].share([(Path("simulated"), recording)], [], folder / "dataset", said={})


# One CSV file a trial, in a folder with the mapping of their columns.


def _write_csv(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import (
        column_name,
        mapping_text,
        numeric_facts,
        write_trial_files,
    )

    write_trial_files(recording, folder / "trials", facts=numeric_facts(recording))
    text = mapping_text(
        recording,
        column_name,
        head=['files = "*.csv"'],
        trials=['pattern = "{condition}_{trial}.csv"'],
        condition=None,
    )
    (folder / "trials" / "columns.toml").write_text(text, encoding="utf-8")


# An exam as Dexterit-E keeps it: a `.kinarm` archive.


def _write_kinarm(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import write_kinarm_archive

    write_kinarm_archive(recording, folder / "exam.kinarm")


# An exam as Dexterit-E exports it: a zip of C3D files.


def _write_kinarm_c3d(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import write_kinarm_c3d

    write_kinarm_c3d(recording, folder / "exam.zip")


# One MATLAB file with a struct array of trials, and the mapping of its fields beside it.


def _field(name: str) -> str:
    return f"trials.{name}"


def _write_matlab(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import mapping_text, write_matlab_trials

    write_matlab_trials(recording, folder / "session.mat")
    text = mapping_text(recording, _field, condition=_field("condition"), facts=_field)
    (folder / "columns.toml").write_text(text, encoding="utf-8")


# The same as arrays of frames in one struct, as experiments at a vBOT save them.


def _write_vbot(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import frame_column, mapping_text, write_frames

    write_frames(recording, folder / "session.mat")
    text = mapping_text(
        recording,
        lambda name: frame_column(recording, name),
        trials=['by = "columns"'],
        condition="D.Condition",
        facts=lambda name: f"D.{name}",
    )
    (folder / "columns.toml").write_text(text + 'trial = "D.TrialNumber"\n', encoding="utf-8")


# The log of a robot that speaks ROS 2, with the mapping of its topics beside it.

#: Column of the simulator -> topic and field.
_TOPICS: Final = {f"{axis}_m": f"/robot/pose.pose.position.{axis}" for axis in "xyz"} | {
    f"f{axis}_N": f"/ft_sensor/wrench.wrench.force.{axis}" for axis in "xyz"
}


def _topic(name: str) -> str:
    # The stamps of the messages tell the time.
    return "" if name == "time_s" else _TOPICS.get(name, f"/signals.{name.lower()}")


def _write_mcap(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import mapping_text, write_mcap

    write_mcap(recording, folder / "session.mcap")
    text = mapping_text(
        recording,
        _topic,
        trials=['by = "column"', 'column = "/trial.number"', 'disturbance = "/trial.disturbance"'],
        condition="/trial.condition",
        facts=lambda name: "" if name in ("onset_s", "end_s") else f"/trial.{name.lower()}",
    )
    (folder / "columns.toml").write_text(text, encoding="utf-8")


# Joint angles, one `.mot` file a trial.


def _write_mot(recording: MotionRecording, folder: Path) -> None:
    from manipulandum_sim.lab_files import write_mot_files

    write_mot_files(recording, folder / "motion")


# One Parquet table of all samples, with the mapping of its columns beside it.


def _write_parquet(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import mapping_text, write_parquet_table

    write_parquet_table(recording, folder / "session.parquet")
    text = mapping_text(recording, trials=['by = "column"', 'column = "trial"'])
    (folder / "columns.toml").write_text(text, encoding="utf-8")


# Filmed markers, one `.trc` file a trial, and the skeleton that they sit on.

_SKELETON: Final = "skeleton.json"


def _write_trc(recording: MarkerRecording, folder: Path) -> None:
    from armimpedance.recordings import write_recording
    from manipulandum_sim.lab_files import write_trc_files

    write_trc_files(recording, folder / "markers")
    if recording.skeleton is not None:
        whole = folder / "recording"
        write_recording(recording, whole)
        (whole / _SKELETON).rename(folder / _SKELETON)
        shutil.rmtree(whole)


#: The forms by their names.
FORMS: Final = RecordTable(
    {
        "bids": LabForm(
            "Motion-BIDS", ("hand", "joint", "markers", "motion"), ("dataset",), _write_bids
        ),
        "csv": LabForm("a CSV file for each trial", ("hand", "joint"), ("trials",), _write_csv),
        "kinarm": LabForm(
            "a Kinarm exam, as an archive (.kinarm)", ("hand",), ("exam.kinarm",), _write_kinarm
        ),
        "kinarm-c3d": LabForm(
            "a Kinarm exam, as a zip of C3D files", ("hand",), ("exam.zip",), _write_kinarm_c3d
        ),
        "matlab": LabForm(
            "a MATLAB file with a struct array of trials",
            ("hand", "joint"),
            ("session.mat", "columns.toml"),
            _write_matlab,
        ),
        "mcap": LabForm(
            "the log of a robot in ROS 2 (.mcap)",
            ("hand",),
            ("session.mcap", "columns.toml"),
            _write_mcap,
        ),
        "mot": LabForm(
            "joint angles, a .mot file for each trial", ("motion",), ("motion",), _write_mot
        ),
        "parquet": LabForm(
            "one Parquet table of all samples",
            ("hand", "joint"),
            ("session.parquet", "columns.toml"),
            _write_parquet,
        ),
        "trc": LabForm(
            "markers, a .trc file for each trial",
            ("markers",),
            ("markers", _SKELETON),
            _write_trc,
        ),
        "vbot": LabForm(
            "a MATLAB file with arrays of frames, as of a vBOT",
            ("hand",),
            ("session.mat", "columns.toml"),
            _write_vbot,
        ),
    },
    "form",
)


def form_for(name: str, recording: AnyRecording) -> LabForm:
    """The form of this name.

    Raises InputError: there is none, or it cannot hold such a recording.
    """
    form = FORMS.named(name)
    kind = holds_of(recording)
    if kind not in form.holds:
        able = ", ".join(each for each in FORMS if kind in FORMS[each].holds)
        raise InputError(f"--as {name} of a recording of kind {kind!r}", expected=f"one of {able}")
    return form


def holds_of(recording: AnyRecording) -> Holds:
    """The kind of a recording, as the folder's own form names it."""
    from armimpedance.core.motion import MarkerRecording
    from armimpedance.core.records import Recording

    if isinstance(recording, Recording):
        return recording.kind
    return "markers" if isinstance(recording, MarkerRecording) else "motion"
