"""Small folders of BIDS, written byte by byte: motion capture, EMG, a physiological record."""

from __future__ import annotations

import gzip
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

CHANNELS = ("name", "component", "type", "tracked_point", "units", "reference_frame")
RATE_HZ, EMG_HZ, PHYSIO_HZ, FRAMES = 50.0, 500.0, 25.0, 60


def places(seed: int = 0) -> np.ndarray:
    """Two points in mm, (FRAMES, 2, 3), whole so that every unit holds them exactly."""
    return np.random.default_rng(seed).integers(-900, 900, (FRAMES, 2, 3)).astype(float)


def write_tsv(file: Path, rows: Sequence[Sequence[object]], end: str = "\n") -> None:
    """Rows with tabs between the cells."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("".join("\t".join(map(str, row)) + end for row in rows), newline="")


def write_json(file: Path, content: object) -> None:
    """A JSON file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(content))


def write_edf(file: Path, signals: np.ndarray, unit: str = "uV", rate_hz: float = EMG_HZ) -> None:
    """An EDF file of one record: signals (N, m) as whole numbers, one digit a unit."""
    count, channels = signals.shape

    def cells(values: Sequence[object], width: int) -> bytes:
        return b"".join(str(value).ljust(width).encode() for value in values)

    own = [f"CH{i}" for i in range(1, channels + 1)]
    header = cells(["0"], 8) + cells(["X X X X", "Startdate X X X X"], 80)
    header += cells(["01.01.85", "00.00.00", 256 * (channels + 1)], 8) + cells([""], 44)
    header += cells([1, f"{count / rate_hz:g}"], 8) + cells([channels], 4)
    header += cells(own, 16) + cells([""] * channels, 80) + cells([unit] * channels, 8)
    for limit in (-32768, 32767, -32768, 32767):
        header += cells([limit] * channels, 8)
    header += cells([""] * channels, 80) + cells([count] * channels, 8)
    header += cells([""] * channels, 32)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(header + signals.T.astype("<i2").tobytes())


def write_dataset(root: Path, *, axes: str = "ALS", emg: bool = True, physio: bool = True) -> None:
    """A dataset of one person, one run: two points in mm, two EMG channels, one force."""
    rng = np.random.default_rng(1)
    write_json(root / "dataset_description.json", {"Name": "x", "BIDSVersion": "1.10.0"})
    write_tsv(
        root / "participants.tsv", [("participant_id", "weight", "height"), ("sub-01", 70, 180)]
    )
    units = {"weight": {"Units": "kg"}, "height": {"Units": "cm"}}
    write_json(root / "participants.json", units)
    own = root / "sub-01"
    write_tsv(
        own / "sub-01_scans.tsv",
        [
            ("filename", "acq_time"),
            ("motion/sub-01_task-reach_tracksys-omc_motion.tsv", "2020-01-01T10:00:00.000"),
            ("emg/sub-01_task-reach_emg.edf", "2020-01-01T09:59:59.900"),
        ],
    )
    write_motion(own / "motion" / "sub-01_task-reach_tracksys-omc", places(), axes)
    if emg:
        # begins a tenth of a second earlier than the motion
        write_edf(own / "emg" / "sub-01_task-reach_emg.edf", rng.integers(-999, 999, (700, 2)))
        rows = [("name", "type", "units"), ("flexor", "EMG", "V"), ("extensor", "EMG", "V")]
        write_tsv(own / "emg" / "sub-01_task-reach_channels.tsv", rows)
    if physio:
        stem = own / "motion" / "sub-01_task-reach_physio"
        told = {"SamplingFrequency": PHYSIO_HZ, "StartTime": 0.0, "Columns": ["push"]}
        write_json(stem.with_suffix(".json"), told | {"push": {"Units": "N"}})
        text = "".join(f"{i}\n" for i in range(30))
        stem.with_name(stem.name + ".tsv.gz").write_bytes(gzip.compress(text.encode(), mtime=0))


def write_motion(
    stem: Path, points: np.ndarray, axes: str | None = "ALS", unit: str = "mm"
) -> None:
    """A tracking system of these points (N, P, 3), and a channel of temperature."""
    names = [f"p{i}" for i in range(1, points.shape[1] + 1)]
    frame = "lab" if axes is not None else "n/a"
    rows = [(f"{n}_{a}", a, "POS", n, unit, frame) for n in names for a in "xyz"]
    rows += [("temperature", "n/a", "MISC", "n/a", "n/a", "n/a")]
    write_tsv(stem.with_name(stem.name + "_channels.tsv"), [CHANNELS, *rows])
    if axes is not None:
        levels = {"lab": {"SpatialAxes": axes}}
        content = {"reference_frame": {"Levels": levels}}
        write_json(stem.with_name(stem.name + "_channels.json"), content)
    flat = points.reshape(len(points), -1).tolist()
    cells = [[("n/a" if v != v else repr(v)) for v in row] + ["20.5"] for row in flat]
    write_tsv(stem.with_name(stem.name + "_motion.tsv"), cells)
    told = {"SamplingFrequency": RATE_HZ, "TaskName": "reach"}
    write_json(stem.with_name(stem.name + "_motion.json"), told)
