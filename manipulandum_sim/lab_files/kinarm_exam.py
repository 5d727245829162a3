"""A simulated session as a Kinarm exam, and as the C3D files that Dexterit-E exports of it.

The hand is held by a Kinarm End-Point robot (`kinarm_robot`); its sensor holds the limb's force,
its motors do what the links need, and the EMG is on the analog inputs ACH1, ACH2 ... in the order
of the muscles. A protocol is a condition in one direction; its events are PERTURB_ON and
PERTURB_OFF. What a Kinarm does not record is not written: the arm's joint angles, its shoulder, the
motion that was commanded, further columns of the trial table.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.outputs import staged_file, staged_folder
from armimpedance.core.records import Recording, trial_slices
from manipulandum_sim.lab_files.c3d_bytes import Groups, Value, c3d_bytes
from manipulandum_sim.lab_files.kinarm_robot import (
    LENGTHS,
    LINKS,
    MOTORS,
    VERSION,
    link_motion,
    motor_torques,
    shoulder_for,
)

Side = Literal["right", "left"]
Single = NDArray[np.float32]

#: Channels of a robot and their units.
UNITS: Final = {
    "L1Ang": "Rad", "L2Ang": "Rad", "L1Vel": "Rad/s", "L2Vel": "Rad/s",
    "L1Acc": "Rad/s**2", "L2Acc": "Rad/s**2", "M1TorCMD": "Nm", "M2TorCMD": "Nm",
    "FS_ForceX": "N", "FS_ForceY": "N", "FS_ForceZ": "N",
    "FS_TorqueX": "Nm", "FS_TorqueY": "Nm", "FS_TorqueZ": "Nm",
    "FS_TimeStamp": "s", "FS_Status": "none",
}  # fmt: skip


@dataclass(frozen=True)
class KinarmTrial:
    """One trial of an exam.

    Attributes
    ----------
    name : str
        Block, protocol, repetition: ``01_02_03``.
    hand : (F, 2)
        m.
    channels : mapping
        Label -> samples (F,).
    events : tuple of (str, float)
        Label and time in s.
    groups : mapping
        What the file says of the trial.
    """

    name: str
    hand: Single
    channels: Mapping[str, Single]
    events: tuple[tuple[str, float], ...]
    groups: Groups


@dataclass(frozen=True)
class KinarmExam:
    """An exam of one arm: the recording, the robot's place, and the protocol of each trial.

    Attributes
    ----------
    recording : Recording
    side : {"right", "left"}
    shoulder : (2,)
        The robot's first axis in the recording's frame, m.
    protocols : DataFrame
        ``condition`` and ``direction_deg`` (NaN: none), one row a protocol.
    protocol : (T,)
        The row of each trial, from 0.
    """

    recording: Recording
    side: Side
    shoulder: FloatArray
    protocols: pd.DataFrame
    protocol: NDArray[np.integer[Any]]

    @property
    def mirror(self) -> float:
        """-1 for a left arm, which is the mirror image of the recorded one."""
        return -1.0 if self.side == "left" else 1.0

    def common(self) -> Groups:
        """Facts that all trials share."""
        side, other = self.side.upper(), "LEFT" if self.side == "right" else "RIGHT"
        names = ("I", "M", "C_AXIAL", "C_ANTERIOR")
        links: dict[str, Value] = {
            f"L{i}_{name}": float(value)
            for i, link in enumerate(LINKS, start=1)
            for name, value in zip(names, link, strict=True)
        }
        lengths: dict[str, Value] = {f"L{i}_L": length for i, length in enumerate(LENGTHS, start=1)}
        motors: dict[str, Value] = {
            f"MOTOR{i}_I": inertia for i, inertia in enumerate(MOTORS, start=1)
        }
        present: dict[str, Value] = {"IS_PRESENT": _whole(1), "VERSION": VERSION}
        x, y = self.shoulder
        return {
            "EXPERIMENT": {"STUDY": "a simulated study", "SUBJECT_ID": "simulated"},
            f"{side}_KINARM": present | lengths | links | motors,
            f"{other}_KINARM": {"IS_PRESENT": _whole(0)},
            "CALIBRATION": {f"{side}_SHO_X": self.mirror * x, f"{side}_SHO_Y": float(y)},
            "TP_TABLE": self._table(),
        }

    def trials(self) -> Iterator[KinarmTrial]:
        """The trials in the order in which they were run, one made after another."""
        counts: dict[str, int] = {}
        table = self.recording.trials
        for row, part in enumerate(trial_slices(self.recording.offsets)):
            block = int(table["set"].iloc[row]) if "set" in table else 1
            place = f"{block:02d}_{self.protocol[row] + 1:02d}"
            counts[place] = counts.get(place, 0) + 1
            name = f"{place}_{counts[place]:02d}"
            yield self._trial(name, table.iloc[row], int(self.protocol[row]), part)

    def _trial(self, name: str, row: pd.Series, protocol: int, part: slice) -> KinarmTrial:
        recording = self.recording
        start = recording.time_s[part][0]
        events = tuple(
            (label, float(row[column] - start))
            for label, column in (("PERTURB_ON", "onset_s"), ("PERTURB_OFF", "end_s"))
            if column in row and np.isfinite(row[column])
        )
        facts = {
            "TP_ROW": _whole(protocol + 1),
            "TP_NUM": _whole(protocol + 1),
            "TRIAL_NUM": _whole(int(row["trial"])),
            "IS_ERROR": _whole(0),
        }
        hand = recording.position[part] * [self.mirror, 1.0]
        return KinarmTrial(
            name, hand.astype(np.float32), self._channels(part), events, {"TRIAL": facts}
        )

    def _channels(self, part: slice) -> dict[str, Single]:
        recording = self.recording
        motion = link_motion(recording.position[part], self.shoulder, recording.sample_rate_hz)
        force = recording.force[part]
        # A mirrored link stands at pi - a: it turns, and is turned, the other way.
        straight = np.pi if self.side == "left" else 0.0
        columns = {"Ang": straight + self.mirror * motion.angle}
        columns |= {"Vel": self.mirror * motion.velocity, "Acc": self.mirror * motion.acceleration}
        torque = self.mirror * motor_torques(motion, force)
        own = {f"L{i + 1}{name}": values[:, i] for name, values in columns.items() for i in (0, 1)}
        own |= {f"M{i + 1}TorCMD": torque[:, i] for i in (0, 1)}
        own |= {"FS_ForceX": self.mirror * force[:, 0], "FS_ForceY": force[:, 1]}
        own |= {"FS_TimeStamp": np.arange(len(force)) / recording.sample_rate_hz}
        nothing = np.zeros(len(force))
        names = (self.side.title(), "Left" if self.side == "right" else "Right")
        channels = {f"{names[0]}_{name}": own.get(name, nothing) for name in UNITS}
        channels |= {f"{names[1]}_{name}": nothing for name in UNITS}
        if recording.emg is not None:
            channels |= {f"ACH{i}": emg for i, emg in enumerate(recording.emg[part].T, start=1)}
        return {label: values.astype(np.float32) for label, values in channels.items()}

    def _table(self) -> dict[str, Value]:
        table: dict[str, Value] = {
            "USED": _whole(len(self.protocols)),
            "NAME": tuple(map(str, self.protocols["condition"])),
        }
        direction = self.protocols["direction_deg"].to_numpy(dtype=np.float64)
        if np.isfinite(direction).any():
            turned = (180.0 - direction) % 360.0 if self.side == "left" else direction
            table["PERTURB_DIRECTION_DEG"] = turned.astype(np.float32)
        return table


def kinarm_exam(recording: Recording, side: Side = "right") -> KinarmExam:
    """A recording of the hand as the exam of one arm.

    Raises
    ------
    InputError
        It is no recording of the hand in a plane, a Kinarm does not reach its places, or its
        trials are of more kinds than a table holds.
    """
    if recording.kind != "hand" or recording.axes != 2:
        raise InputError("no recording of the hand in a plane", expected="one, for a Kinarm exam")
    keys = recording.trials[["condition"]].assign(direction_deg=np.nan)
    if "direction_deg" in recording.trials:
        keys["direction_deg"] = recording.trials["direction_deg"].astype(np.float64)
    groups = keys.groupby(["condition", "direction_deg"], dropna=False, sort=False)
    protocol = groups.ngroup().to_numpy()
    protocols = keys.loc[~pd.Series(protocol).duplicated().to_numpy()].reset_index(drop=True)
    if len(protocols) > MOST_PROTOCOLS:
        problem = f"{len(protocols)} conditions and directions"
        raise InputError(problem, expected=f"at most {MOST_PROTOCOLS}, for a table of a C3D file")
    return KinarmExam(recording, side, shoulder_for(recording.position), protocols, protocol)


#: A dimension of a table is one byte in a C3D file.
MOST_PROTOCOLS: Final = 255


def write_kinarm_c3d(recording: Recording, path: Path, side: Side = "right") -> None:
    """Write an exam of C3D files as Dexterit-E exports it.

    Parameters
    ----------
    recording : Recording
        Of the hand in a plane.
    path : Path
        A `.zip`; any other name is that of a folder.
    side : {"right", "left"}
        The arm; a left one is the mirror image.

    Raises
    ------
    InputError
        The recording is of another kind, or the output cannot be written.
    """
    exam = kinarm_exam(recording, side)
    if path.suffix.lower() == ".zip":
        with staged_file(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
            for name, data in _files(exam):
                write_member(archive, f"raw/{name}", data)
        return
    names = [f"{trial.name}.c3d" for trial in exam.trials()]
    with staged_folder(path, mark="common.c3d", known=names) as folder:
        for name, data in _files(exam):
            (folder / name).write_bytes(data)


def write_member(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    """Add a member to a zip; the same content always gives the same bytes."""
    info = zipfile.ZipInfo(name)
    info.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(info, data, compresslevel=1)


def _files(exam: KinarmExam) -> Iterator[tuple[str, bytes]]:
    rate_hz = exam.recording.sample_rate_hz
    nothing = np.zeros((0, 0, 4)), np.zeros((0, 0))
    yield "common.c3d", c3d_bytes(*nothing, exam.common(), rate_hz=rate_hz)
    for trial in exam.trials():
        yield f"{trial.name}.c3d", _trial_file(exam, trial)


def _trial_file(exam: KinarmExam, trial: KinarmTrial) -> bytes:
    rate_hz, frames = exam.recording.sample_rate_hz, len(trial.hand)
    points = np.zeros((frames, 2, 4))
    points[:, ("right", "left").index(exam.side), :2] = trial.hand
    labels = tuple(trial.channels)
    units = tuple(UNITS.get(label.split("_", 1)[-1], "V") for label in labels)
    groups: dict[str, Mapping[str, Value]] = {
        "POINT": {
            "USED": _whole(2),
            "SCALE": -1.0,
            "RATE": rate_hz,
            "DATA_START": _whole(0),
            "FRAMES": _whole(min(frames, 32767)),
            "LABELS": ("Right_Hand", "Left_Hand"),
            "UNITS": "m",
        },
        "ANALOG": {
            "USED": _whole(len(labels)),
            "LABELS": labels,
            "UNITS": units,
            "GEN_SCALE": 1.0,
            "SCALE": np.ones(len(labels)),
            "OFFSET": np.zeros(len(labels)),
            "RATE": rate_hz,
        },
        "EVENTS": {
            "USED": _whole(len(trial.events)),
            "LABELS": tuple(label for label, _ in trial.events),
            "TIMES": np.array([time_s for _, time_s in trial.events], dtype=np.float32),
        },
        **trial.groups,
    }
    analog = np.column_stack(list(trial.channels.values())).astype(np.float64)
    return c3d_bytes(points, analog, groups, rate_hz=rate_hz)


def _whole(value: int) -> NDArray[Any]:
    return np.array(value, dtype=np.int32)
