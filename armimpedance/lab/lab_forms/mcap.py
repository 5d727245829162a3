"""The log of a robot that speaks ROS 2, with the mapping of its topics beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from armimpedance.core.records import Recording
from armimpedance.lab.parts.simulation import LabForm

#: Column of the simulator -> topic and field.
_TOPICS: Final = {f"{axis}_m": f"/robot/pose.pose.position.{axis}" for axis in "xyz"} | {
    f"f{axis}_N": f"/ft_sensor/wrench.wrench.force.{axis}" for axis in "xyz"
}


def _column(name: str) -> str:
    # The stamps of the messages tell the time.
    return "" if name == "time_s" else _TOPICS.get(name, f"/signals.{name.lower()}")


def _write(recording: Recording, folder: Path) -> None:
    from manipulandum_sim.lab_files import mapping_text, write_mcap

    write_mcap(recording, folder / "session.mcap")
    text = mapping_text(
        recording,
        _column,
        trials=['by = "column"', 'column = "/trial.number"', 'disturbance = "/trial.disturbance"'],
        condition="/trial.condition",
        facts=lambda name: "" if name in ("onset_s", "end_s") else f"/trial.{name.lower()}",
    )
    (folder / "columns.toml").write_text(text, encoding="utf-8")


FORM = LabForm(
    "the log of a robot in ROS 2 (.mcap)", ("hand",), ("session.mcap", "columns.toml"), _write
)
