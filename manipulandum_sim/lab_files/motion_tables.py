"""Filmed markers as `.trc` and joint angles as `.mot`, one trial a file, in OpenSim's frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.motion import MarkerRecording, MotionRecording


def write_trc_files(recording: MarkerRecording, folder: Path) -> None:
    """Write the markers of each trial to ``<condition>_<trial>.trc``, in mm, y up.

    Parameters
    ----------
    recording : MarkerRecording
        In the world's frame: x forward, y left, z up.
    folder : Path
        It is made.
    """
    folder.mkdir()
    for row, name in enumerate(_names(recording)):
        part = slice(recording.offsets[row], recording.offsets[row + 1])
        places = recording.positions[part] * 1e3
        # OpenSim's frame: x forward, y up, z to the right.
        turned = np.stack([places[..., 0], places[..., 2], -places[..., 1]], axis=-1)
        text = _trc_text(f"{name}.trc", recording, recording.time_s[part], turned)
        (folder / f"{name}.trc").write_text(text, encoding="utf-8")


def _trc_text(name: str, recording: MarkerRecording, time_s: FloatArray, places: FloatArray) -> str:
    rate, frames, markers = recording.sample_rate_hz, len(time_s), len(recording.names)
    numbers = [rate, rate, frames, markers, "mm", rate, 1, frames]
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame"
        "\tOrigNumFrames",
        "\t".join(f"{n:g}" if isinstance(n, float) else str(n) for n in numbers),
        "Frame#\tTime\t" + "\t".join(f"{n}\t\t" for n in recording.names).rstrip("\t"),
        "\t\t" + "\t".join(f"{axis}{i + 1}" for i in range(markers) for axis in "XYZ"),
        "",
    ]
    rows = zip(time_s.tolist(), places.reshape(frames, -1).tolist(), strict=True)
    body = [
        f"{i}\t{t!r}\t" + "\t".join("" if v != v else repr(v) for v in values)
        for i, (t, values) in enumerate(rows, start=1)
    ]
    return "\n".join([*head, *body]) + "\n"


def write_mot_files(recording: MotionRecording, folder: Path) -> None:
    """Write the coordinates of each trial to ``<condition>_<trial>.mot``, in rad and m.

    Parameters
    ----------
    recording : MotionRecording
    folder : Path
        It is made.
    """
    folder.mkdir()
    columns = ["time", *recording.skeleton.coordinates]
    for row, name in enumerate(_names(recording)):
        part = slice(recording.offsets[row], recording.offsets[row + 1])
        table = np.column_stack([recording.time_s[part], recording.coordinates[part]])
        head = ["Coordinates", "version=1", f"nRows={len(table)}", f"nColumns={len(columns)}"]
        head += ["inDegrees=no", "endheader", "\t".join(columns)]
        body = ["\t".join(map(repr, values)) for values in table.tolist()]
        text = "\n".join([*head, *body]) + "\n"
        (folder / f"{name}.mot").write_text(text, encoding="utf-8")


def _names(recording: MarkerRecording | MotionRecording) -> list[str]:
    trials = recording.trials
    pairs = zip(trials["condition"], trials["trial"], strict=True)
    return [f"{condition}_{number:03d}" for condition, number in pairs]
