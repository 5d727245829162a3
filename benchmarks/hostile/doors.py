"""The doors: for each format, how a small valid file comes to be and how it is opened."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Final

import armimpedance as ai
from armimpedance.recordings import write_recording
from armimpedance.records import Recording
from manipulandum_sim.hand import simulate
from manipulandum_sim.passive import simulate_passive


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
    """A few short trials of a simulated hand."""
    recording, _ = simulate(
        "cocontraction", seed=1, sets=1, conditions=["cocontraction_10"], noise="sensor"
    )
    return replace(recording.select([0, 1, 2]), provenance=())


def _folder(table: str) -> Door:
    return Door(lambda folder: write_recording(hand(), folder / "r", table), ai.read, "r")


def _markers(folder: Path) -> None:
    recording, _ = simulate_passive("release", subject="1", seed=1, marker_noise_m=0.0)
    write_recording(recording.select([0]), folder / "r", "csv")


DOORS: Final[dict[str, Door]] = {
    "recording, Parquet": _folder("parquet"),
    "recording, CSV": _folder("csv"),
    "recording of markers": Door(_markers, ai.read, "r"),
}
