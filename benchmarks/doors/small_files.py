"""The doors: for each format, how a small valid file comes to be and how it is opened."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import armimpedance as ai
from armimpedance.core.records import Recording
from armimpedance.hand.show import read_results, write_results
from armimpedance.lab.lab_forms import FORMS
from armimpedance.recordings import read_skeleton, write_recording
from armimpedance.show.files import read_left_out
from manipulandum_sim.hand import simulate
from manipulandum_sim.passive import simulate_passive

# The small files of the tests, written by other packages or byte by byte.
sys.path.append(str(Path(__file__).resolve().parents[2] / "tests" / "unit" / "recordings"))

import bids_bench
import capture_bench
import log_bench
import mapped_files
import opensim_bench


@dataclass(frozen=True)
class Door:
    """One format.

    Attributes
    ----------
    build : callable
        Writes a valid file into a folder.
    read : callable
        Opens what lies at the place.
    name : str
        Of the file or folder that `build` writes; "": the folder itself.
    """

    build: Callable[[Path], object]
    read: Callable[[Path], object]
    name: str = ""

    def place(self, folder: Path) -> Path:
        """The file or folder to damage and to open."""
        return folder / self.name if self.name else folder


@cache
def hand() -> Recording:
    """Three short trials of a simulated hand."""
    recording, _ = simulate(
        "cocontraction", seed=1, sets=1, conditions=["cocontraction_10"], noise="sensor"
    )
    return replace(recording.select([0, 1, 2]), provenance=(), joint_angles=None)


@cache
def filmed() -> Any:
    """One trial of a filmed arm."""
    recording, _ = simulate_passive("release", subject="1", seed=1, marker_noise_m=0.0, trials=1)
    return recording


def _form(form: str, **options: Any) -> Door:
    """A session in a laboratory's form."""
    record = FORMS[form]
    recording = filmed if "markers" in record.holds else hand
    build = lambda folder: record.write(recording(), folder)  # noqa: E731
    return Door(build, partial(ai.read, **options), record.names[0])


def _bytes(name: str, content: Callable[[], bytes], **options: Any) -> Door:
    return Door(
        lambda folder: (folder / name).write_bytes(content()), partial(ai.read, **options), name
    )


def _log(name: str) -> Door:
    log = log_bench.LOGS[name]

    def build(folder: Path) -> None:
        place = folder / log.name
        log.write(hand().select([0, 1]), place)
        home = place if place.is_dir() else folder
        (home / "columns.toml").write_text(log.mapping, encoding="utf-8")

    return Door(build, ai.read, log.name)


def _mapping(folder: Path) -> None:
    FORMS["csv"].write(hand(), folder)


def _read_mapping(file: Path) -> object:
    return ai.read(file.parent, mapping=file)


def _mat73(folder: Path) -> None:
    trials = mapped_files.trials_of(hand())
    mapped_files.write_mat73(folder / "a.mat", {"trials": trials, "fs": 1000.0})
    text = mapped_files.hand_mapping(
        ["trials.pos(:,1)", "trials.pos(:,2)"],
        ["trials.force(:,1)", "trials.force(:,2)"],
        time="trials.t",
        values='condition = "trials.cond"\nonset_s = "trials.onset"',
    )
    (folder / "columns.toml").write_text(text, encoding="utf-8")


def _results(name: str) -> Door:
    def build(folder: Path) -> None:
        write_results(list(ai.estimate(hand())), folder / name)

    return Door(build, read_results, name)


def _model(folder: Path) -> None:
    from armimpedance.muscles.models import write_model

    recording, _ = simulate("postures", seed=1, sets=1, noise="none")
    write_model(ai.fit_posture(ai.to_joint(ai.estimate(recording))), folder / "m.json")


def _skeleton(folder: Path) -> None:
    write_recording(filmed(), folder / "r")


def _left_out(folder: Path) -> None:
    (folder / "left_out.csv").write_text("trial,reason\n1,odd\n2,moved\n", encoding="utf-8")


EVENTS: Final = {"onset_event": "PERTURB_ON", "end_event": "PERTURB_OFF", "force_by": "limb"}

DOORS: Final[dict[str, Door]] = {
    "recording, Parquet": Door(lambda f: write_recording(hand(), f / "r"), ai.read, "r"),
    "recording, CSV": Door(lambda f: write_recording(hand(), f / "r", "csv"), ai.read, "r"),
    "recording of markers": Door(lambda f: write_recording(filmed(), f / "r", "csv"), ai.read, "r"),
    "skeleton.json": Door(_skeleton, read_skeleton, "r/skeleton.json"),
    "Kinarm archive": _form("kinarm", **EVENTS),
    "Kinarm C3D": _form("kinarm-c3d", **EVENTS),
    "marker C3D": _bytes("a.c3d", capture_bench.valid_file, emg_channels={"biceps": "biceps"}),
    "CSV by a mapping": _form("csv"),
    "columns.toml": Door(_mapping, _read_mapping, "trials/columns.toml"),
    "Parquet by a mapping": _form("parquet"),
    "MATLAB 5": _form("matlab"),
    "MATLAB 7.3": Door(_mat73, ai.read, "a.mat"),
    **{name: _log(name) for name in log_bench.LOGS},
    ".trc": _bytes("a.trc", opensim_bench.small_trc),
    "BIDS": Door(lambda f: bids_bench.write_dataset(f / "d"), ai.read, "d"),
    "RESULTS.csv": _results("hand.csv"),
    "MODEL.json": Door(_model, ai.read_model, "m.json"),
    "left_out.csv": Door(_left_out, read_left_out, "left_out.csv"),
}
