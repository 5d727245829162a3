"""Writers of the files that the readers are tested on: C3D byte by byte, exams, recordings."""

from __future__ import annotations

import json
import struct
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest


@dataclass
class Parameter:
    """A C3D parameter as it stands in the file: type code, dimensions, data."""

    code: int
    sizes: tuple[int, ...]
    data: bytes


def text(value: str) -> Parameter:
    """A text without a count dimension, as Dexterit-E writes it."""
    return Parameter(-1, (len(value.encode()),), value.encode())


def texts(*values: str) -> Parameter:
    coded = [value.encode() for value in values]
    width = max(map(len, coded), default=0)
    data = b"".join(value.ljust(width) for value in coded)
    return Parameter(-1, (width, len(values)), data)


def floats(*values: float, sizes: tuple[int, ...] | None = None) -> Parameter:
    sizes = (len(values),) if sizes is None else sizes
    return Parameter(4, sizes, struct.pack(f"<{len(values)}f", *values))


def shorts(*values: int, sizes: tuple[int, ...] | None = None) -> Parameter:
    sizes = (len(values),) if sizes is None else sizes
    return Parameter(2, sizes, struct.pack(f"<{len(values)}H", *(v & 0xFFFF for v in values)))


def parameter_section(groups: dict[str, dict[str, Parameter]]) -> bytes:
    entries = []
    for number, (group, parameters) in enumerate(groups.items(), start=1):
        head = struct.pack("<bb", len(group), -number) + group.encode()
        entries.append((head, b"\x00"))
        for name, p in parameters.items():
            head = struct.pack("<bb", len(name), number) + name.encode()
            body = struct.pack("<bB", p.code, len(p.sizes)) + bytes(p.sizes) + p.data + b"\x00"
            entries.append((head, body))
    written = b"".join(head + struct.pack("<H", 2 + len(body)) + body for head, body in entries)
    written += b"\x00\x00"
    blocks = -(-(len(written) + 4) // 512)
    return (bytes([1, 0x50, blocks & 0xFF, 84]) + written).ljust(512 * blocks, b"\x00")


def c3d_bytes(
    points: np.ndarray,
    analog: np.ndarray,
    groups: dict[str, dict[str, Parameter]],
    *,
    rate: float = 1000.0,
    last_frame: int | None = None,
    scale: float = -1.0,
    samples_per_frame: int = 1,
) -> bytes:
    """Points (F, P, 3) and analog (F * samples_per_frame, A) in the form that `scale` says."""
    frames, n_points = points.shape[:2]
    parameters = parameter_section(groups)
    start = 2 + len(parameters) // 512
    analog = analog.reshape(frames, analog.shape[1] * samples_per_frame)
    last = (frames if last_frame is None else last_frame) & 0xFFFF
    header = struct.pack(
        "<BB5HfHHf",
        2, 0x50, n_points, analog.shape[1], 1, last, 0,
        scale, start, samples_per_frame, rate,
    )  # fmt: skip
    with_residual = np.concatenate([points, np.zeros((frames, n_points, 1))], axis=2)
    words = np.concatenate([with_residual.reshape(frames, 4 * n_points), analog], axis=1)
    data = words.astype("<f4" if scale < 0 else "<i2").tobytes()
    data = data.ljust(-(-len(data) // 512) * 512, b"\x00")
    return header.ljust(512, b"\x00") + parameters + data


@dataclass
class Trial:
    """One trial of a made exam: what the files say of it, with every quirk of Dexterit-E."""

    name: str = "01_02_01.c3d"
    samples: int = 300
    trial_num: int | None = 1
    is_error: int = 0
    force: tuple[float, float] = (1.5, -2.5)
    events: tuple[tuple[str, float], ...] = (("PERT_ON", 0.1), ("PERT_OFF", 0.2))
    side: str = "Right"
    drop_channels: tuple[str, ...] = ()
    extra_channels: dict[str, float] = field(default_factory=dict)
    rate: float = 1000.0
    hand_offset: float = 0.0
    tp: str = ""
    links: np.ndarray | None = None
    forces: np.ndarray | None = None
    motors: np.ndarray | None = None
    tp_row: int | None = None

    def angles(self) -> np.ndarray:
        """Link angles from the x axis, (samples, 2), in single precision as in the file."""
        if self.links is not None:
            return self.links.astype(np.float32)
        t = np.arange(self.samples) / self.rate
        first = 0.9 + 0.02 * np.sin(20 * t)
        second = 2.3 + 0.03 * np.cos(15 * t)
        if self.side == "Left":
            first, second = np.pi - first, np.pi - second
        return np.column_stack([first, second]).astype(np.float32)


@dataclass
class Robot:
    """What `common.c3d` says of the robot."""

    version: str = "KINARM_EP_Rev1"
    shoulder: tuple[float, float] = (-0.1, 0.05)
    lengths: tuple[float, float] = (0.31, 0.34)
    pointer: float = 0.0
    handle: tuple[float, float] = (0.0, 0.0)  # beyond link 2, and across it
    inertias: dict[str, float] = field(default_factory=dict)
    tables: dict[str, dict[str, Parameter]] = field(default_factory=dict)

    @property
    def is_endpoint(self) -> bool:
        return self.version.startswith("KINARM_EP")

    def hand(self, trial: Trial) -> np.ndarray:
        """The hand by elementary geometry, (samples, 2)."""
        first, second = trial.angles().astype(float).T
        aside = self.handle[1] if self.is_endpoint else self.pointer
        aside *= -1 if trial.side == "Left" else 1
        length = self.lengths[1] + self.handle[0]
        x = self.shoulder[0] + self.lengths[0] * np.cos(first) + length * np.cos(second)
        y = self.shoulder[1] + self.lengths[0] * np.sin(first) + length * np.sin(second)
        return np.column_stack([x - aside * np.sin(second), y + aside * np.cos(second)])


Groups = dict[str, dict[str, Parameter]]


def trial_content(trial: Trial, robot: Robot) -> tuple[np.ndarray, dict[str, np.ndarray], Groups]:
    """Points (F, 2, 3), channels and parameters of a trial."""
    side, n = trial.side, trial.samples
    other = "Left" if side == "Right" else "Right"
    ramp = 1.0 + 0.1 * np.sin(np.arange(n) / 30.0)
    force = np.outer(ramp, trial.force) if trial.forces is None else trial.forces
    channels = {
        f"{side}_L1Ang": trial.angles()[:, 0],
        f"{side}_L2Ang": trial.angles()[:, 1],
        f"{side}_FS_ForceX": force[:, 0],
        f"{side}_FS_ForceY": force[:, 1],
        f"{side}_FS_ForceZ": np.zeros(n),
        f"{other}_FS_ForceX": np.zeros(n),
        f"{other}_FS_ForceY": np.zeros(n),
        "ACH0": np.full(n, 0.25),
        **{name: np.full(n, value) for name, value in trial.extra_channels.items()},
    }
    if trial.motors is not None:
        channels |= {f"{side}_M{i + 1}TorCMD": trial.motors[:, i] for i in (0, 1)}
    channels = {k: v for k, v in channels.items() if k not in trial.drop_channels}
    points = np.zeros((n, 2, 3))
    points[:, ("Right", "Left").index(side), :2] = robot.hand(trial) + trial.hand_offset
    labels = [label for label, _ in trial.events]
    groups = {
        "POINT": {
            "USED": shorts(2),
            "SCALE": floats(-1.0, sizes=()),
            "RATE": floats(trial.rate, sizes=()),
            "DATA_START": shorts(0, sizes=()),
            "FRAMES": shorts(n, sizes=()),
            "LABELS": texts("Right_Hand", "Left_Hand"),
            "UNITS": text("m"),
        },
        "ANALOG": {
            "USED": shorts(len(channels)),
            "LABELS": texts(*(name.ljust(20) for name in channels)),
            "GEN_SCALE": floats(1.0, sizes=()),
            "SCALE": floats(*[1.0] * len(channels)),
            "OFFSET": floats(*[0.0] * len(channels)),
            "BITS": text("16"),
        },
        "EVENTS": {
            "LABELS": texts(*labels),
            "TIMES": floats(*(t for _, t in trial.events)),
            "USED": shorts(len(labels), sizes=()),
        },
        "TRIAL": {
            "IS_ERROR": shorts(trial.is_error, sizes=()),
            "DATE": text("03/04/2021"),
            "TIME": text("11:12:13"),
            "TP_NUM": shorts(1, sizes=()),
            "TP": text(trial.tp) if trial.tp else shorts(2, sizes=()),
        },
    }
    if trial.tp_row is not None:
        groups["TRIAL"]["TP_ROW"] = shorts(trial.tp_row, sizes=())
    if trial.trial_num is not None:
        groups["TRIAL"]["TRIAL_NUM"] = shorts(trial.trial_num, sizes=())
    return points, channels, groups


def trial_c3d(trial: Trial, robot: Robot) -> bytes:
    points, channels, groups = trial_content(trial, robot)
    return c3d_bytes(points, np.column_stack(list(channels.values())), groups, rate=trial.rate)


def common_groups(robot: Robot) -> Groups:
    groups: Groups = {
        "EXPERIMENT": {"SUBJECT": text("Jane Doe"), "STUDY": text("Secret study")},
        "CALIBRATION": {},
    }
    for side in ("RIGHT", "LEFT"):
        groups[f"{side}_KINARM"] = {
            "IS_PRESENT": shorts(1, sizes=()),
            "VERSION": text(robot.version),
            "L1_L": floats(robot.lengths[0] if robot.is_endpoint else 0.5, sizes=()),
            "L2_L": floats(robot.lengths[1] if robot.is_endpoint else 0.6, sizes=()),
            **{name: floats(value, sizes=()) for name, value in robot.inertias.items()},
        }
        groups["CALIBRATION"] |= {
            f"{side}_SHO_X": floats(robot.shoulder[0], sizes=()),
            f"{side}_SHO_Y": floats(robot.shoulder[1], sizes=()),
            f"{side}_L1": floats(robot.lengths[0], sizes=()),
            f"{side}_L2": floats(robot.lengths[1], sizes=()),
            f"{side}_PTR_ANTERIOR": floats(robot.pointer, sizes=()),
        }
    return groups | robot.tables


def common_c3d(robot: Robot) -> bytes:
    # No points, no analog channels, last frame 0.
    return c3d_bytes(np.zeros((0, 0, 3)), np.zeros((0, 0)), common_groups(robot))


def exam_files(trials: list[Trial] | None = None, robot: Robot | None = None) -> dict[str, bytes]:
    robot = robot or Robot()
    files = {
        trial.name: trial_c3d(trial, robot) for trial in ([Trial()] if trials is None else trials)
    }
    return {"common.c3d": common_c3d(robot), **files}


def write_exam(folder: Path, files: dict[str, bytes], inside: str = "") -> Path:
    place = folder / inside
    place.mkdir(parents=True, exist_ok=True)
    for name, data in files.items():
        (place / name).write_bytes(data)
    return folder


def zip_exam(path: Path, files: dict[str, bytes], inside: str = "raw/") -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(inside + name, data)
    return path


@pytest.fixture(scope="session")
def c3d() -> SimpleNamespace:
    """Writers of C3D files and their parameters."""
    return SimpleNamespace(write=c3d_bytes, text=text, texts=texts, floats=floats, shorts=shorts)


@pytest.fixture(scope="session")
def exams() -> SimpleNamespace:
    """Writers of Kinarm exams."""
    return SimpleNamespace(
        Trial=Trial,
        Robot=Robot,
        files=exam_files,
        folder=write_exam,
        zip=zip_exam,
        trial=trial_c3d,
        content=trial_content,
        shared=common_groups,
    )


class TableFolder:
    """A recording's folder that is written as text, to be damaged."""

    def __init__(self, path: Path) -> None:
        self.path = path
        n = 50
        time = np.tile(np.arange(n) / 1000.0, 2)
        self.metadata: dict[str, object] = {
            "format": "armimpedance-recording",
            "version": 1,
            "kind": "hand",
            "sample_rate_hz": 1000,
        }
        self.trials = pd.DataFrame(
            {
                "trial": [1, 2],
                "condition": ["relaxed", "relaxed"],
                "direction_deg": [0.0, 90.0],
                "onset_s": [0.01, 0.01],
                "end_s": [0.04, 0.04],
            }
        )
        self.samples = pd.DataFrame(
            {
                "trial": np.repeat([1, 2], n),
                "time_s": time,
                "x_m": 0.1 + 0.005 * np.sin(time * 100),
                "y_m": 0.4 + 0.005 * np.cos(time * 100),
                "fx_N": np.cos(time * 100),
                "fy_N": np.sin(time * 100),
            }
        )

    def write(self, table: str = "csv") -> Path:
        self.path.mkdir(exist_ok=True)
        (self.path / "recording.json").write_text(json.dumps(self.metadata))
        self.trials.to_csv(self.path / "trials.csv", index=False)
        if table == "csv":
            self.samples.to_csv(self.path / "samples.csv", index=False)
        else:
            self.samples.to_parquet(self.path / "samples.parquet", index=False)
        return self.path


@pytest.fixture
def tables(tmp_path: Path) -> TableFolder:
    """A small sound recording, two trials of 50 samples, as tables to be damaged."""
    return TableFolder(tmp_path / "recording")


@pytest.fixture(scope="session")
def truth():
    """Eight disturbances of one condition, nominal noise."""
    from manipulandum_sim.hand import simulate

    recording, _ = simulate("cocontraction", seed=3, sets=1, conditions=["cocontraction_10"])
    return recording
