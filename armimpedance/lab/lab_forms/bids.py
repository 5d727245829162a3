"""A dataset of Motion-BIDS, with the mapping of its channels in `code`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.lab.parts.simulation import LabForm
from armimpedance.show.command.options import SHARED_FORMS

if TYPE_CHECKING:
    from armimpedance.recordings import AnyRecording


def _write(recording: AnyRecording, folder: Path) -> None:
    (folder / "dataset").mkdir()
    SHARED_FORMS["bids"].share([(Path("simulated"), recording)], [], folder / "dataset", said={})


FORM = LabForm("Motion-BIDS", ("hand", "joint", "markers", "motion"), ("dataset",), _write)
