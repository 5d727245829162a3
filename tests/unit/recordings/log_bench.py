"""Small logs of every kind, by the writers of the packages that labs use, and their mappings."""

from __future__ import annotations

import datetime
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from armimpedance.core.records import Recording
from manipulandum_sim.hand import IDEAL, simulate
from manipulandum_sim.lab_files.mcap_log import PAUSE_NS, START_NS, write_mcap
from manipulandum_sim.lab_files.trial_columns import TrialColumns, trials_of

FORCE, POSE, MARK, PUSH = "/ft_sensor/wrench", "/robot/pose", "/trial_number", "/push"


@cache
def hand() -> Recording:
    """Four trials of a simulated hand."""
    recording, _ = simulate(
        "cocontraction",
        seed=1,
        sets=1,
        conditions=["cocontraction_10"],
        noise="sensor",
        servo=IDEAL,
    )
    return recording.select([0, 1, 2, 3])


@cache
def short_hand() -> Recording:
    """Two of them, a tenth of a second each: for files that are damaged by the thousand."""
    return _shortened(hand().select([0, 1]), 100)


def _shortened(recording: Recording, samples: int) -> Recording:
    from dataclasses import replace

    firsts = recording.offsets[:-1]
    rows = np.concatenate([first + np.arange(samples) for first in firsts])
    return replace(
        recording,
        offsets=np.arange(len(firsts) + 1) * samples,
        time_s=recording.time_s[rows],
        position=recording.position[rows],
        force=recording.force[rows],
        joint_angles=None,
        emg=None,
        muscles=(),
        extra={},
    )


@cache
def messages_of(ros: int):
    """The messages of ROS 1 or 2 as rosbags knows them."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_HUMBLE)


def write_ros2_bag(
    recording: Recording, folder: Path, storage: str = "sqlite3", packed: str = ""
) -> None:
    """A bag of ROS 2 by rosbags: a folder with a database or an MCAP file."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    store = messages_of(2)
    plugin = {"sqlite3": StoragePlugin.SQLITE3, "mcap": StoragePlugin.MCAP}[storage]
    writer = Writer(folder, version=9, storage_plugin=plugin)
    if packed:
        writer.set_compression(CompressionMode[packed], CompressionFormat.ZSTD)
    with writer:
        _write_messages(recording, writer, store, store.serialize_cdr)


def write_ros1_bag(recording: Recording, path: Path, compression: str = "") -> None:
    """A bag of ROS 1 by rosbags."""
    from rosbags.rosbag1 import Writer

    store = messages_of(1)
    writer = Writer(path)
    if compression:
        writer.set_compression(Writer.CompressionFormat[compression])
    with writer:
        _write_messages(recording, writer, store, store.serialize_ros1)


def _write_messages(recording, writer, store, serialize):
    types = store.types
    kinds = {
        FORCE: "geometry_msgs/msg/WrenchStamped",
        POSE: "geometry_msgs/msg/PoseStamped",
        MARK: "std_msgs/msg/Int32",
        PUSH: "std_msgs/msg/Bool",
    }
    links = {t: writer.add_connection(t, kind, typestore=store) for t, kind in kinds.items()}
    vector, point = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Point"]
    turned = types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
    header, time = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    extra = {"seq": 0} if "seq" in header.__dataclass_fields__ else {}
    for trial, times in trial_times(recording):
        rows = np.column_stack([trial.columns[n] for n in ("x_m", "y_m", "fx_N", "fy_N")])
        time_s, (onset, end) = (
            trial.columns["time_s"],
            (trial.facts[n] for n in ("onset_s", "end_s")),
        )
        pushed = ((time_s > onset + 1e-4) & (time_s < end - 1e-4)).tolist()
        for (x, y, fx, fy), on, ns in zip(rows.tolist(), pushed, times, strict=True):
            stamp = time(sec=ns // 10**9, nanosec=ns % 10**9)
            wrench = types["geometry_msgs/msg/Wrench"](
                force=vector(x=fx, y=fy, z=0.0), torque=vector(x=0.0, y=0.0, z=0.0)
            )
            pose = types["geometry_msgs/msg/Pose"](
                position=point(x=x, y=y, z=0.0), orientation=turned
            )
            messages = {
                FORCE: types[kinds[FORCE]](
                    header=header(stamp=stamp, frame_id="ft", **extra), wrench=wrench
                ),
                POSE: types[kinds[POSE]](
                    header=header(stamp=stamp, frame_id="base", **extra), pose=pose
                ),
                MARK: types[kinds[MARK]](data=trial.number),
                PUSH: types[kinds[PUSH]](data=on),
            }
            for topic, message in messages.items():
                writer.write(links[topic], ns, serialize(message, kinds[topic]))


def trial_times(recording: Recording) -> Iterable[tuple[TrialColumns, list[int]]]:
    """Trials one after another, and the times of their samples in ns."""
    start = START_NS
    for trial in trials_of(recording):
        times = [start + round(t * 1e9) for t in trial.columns["time_s"].tolist()]
        yield trial, times
        start = times[-1] + PAUSE_NS


def write_nwb(recording: Recording, path: Path, compressed: bool = True) -> None:
    """An NWB file by pynwb: position and force as series, the trials as its table."""
    from hdmf.backends.hdf5.h5_utils import H5DataIO
    from pynwb import NWBHDF5IO, NWBFile, TimeSeries
    from pynwb.behavior import Position, SpatialSeries

    file = NWBFile(
        session_description="a session of the hand",
        identifier="1",
        session_start_time=datetime.datetime(2024, 5, 1, 12, tzinfo=datetime.UTC),
    )
    trials = list(trial_times(recording))
    # At the rate of the samples, with the pauses in it.
    count = [round((times[0] - START_NS) * recording.sample_rate_hz / 1e9) for _, times in trials]
    rows = count[-1] + len(trials[-1][1])
    place, force = np.zeros((rows, 2)), np.zeros((rows, 2))
    for (trial, _), first in zip(trials, count, strict=True):
        stop = first + len(trial.columns["time_s"])
        place[first:stop] = np.column_stack([trial.columns["x_m"], trial.columns["y_m"]])
        force[first:stop] = np.column_stack([trial.columns["fx_N"], trial.columns["fy_N"]])
    packed = (lambda v: H5DataIO(v, compression="gzip")) if compressed else (lambda v: v)
    rate = recording.sample_rate_hz
    hand_place = SpatialSeries(
        name="hand", data=packed(place), rate=rate, starting_time=0.0, reference_frame="robot"
    )
    module = file.create_processing_module("behavior", "the hand")
    module.add(Position(spatial_series=hand_place))
    file.add_acquisition(
        TimeSeries(name="force", data=packed(force), unit="newtons", rate=rate, starting_time=0.0)
    )
    for name in ("condition", "onset_s", "end_s"):
        file.add_trial_column(name, name)
    for (trial, times), first in zip(trials, count, strict=True):
        start = first / rate
        file.add_trial(
            start_time=start,
            stop_time=start + (len(times) - 1) / rate,
            condition=trial.condition,
            onset_s=float(trial.facts["onset_s"]),
            end_s=float(trial.facts["end_s"]),
        )
    with NWBHDF5IO(path, "w") as io:
        io.write(file)


def write_tdms(recording: Recording, path: Path) -> None:
    """A TDMS file by npTDMS: a group a trial."""
    from nptdms import ChannelObject, GroupObject, TdmsWriter

    with TdmsWriter(path) as writer:
        for trial, times in trial_times(recording):
            name = f"trial {trial.number}"
            facts = {"condition": trial.condition}
            facts |= {n: float(trial.facts[n]) for n in ("onset_s", "end_s")}
            told = {
                "wf_increment": 1.0 / recording.sample_rate_hz,
                "wf_start_time": np.datetime64(times[0], "ns").astype("datetime64[us]"),
                "wf_start_offset": 0.0,
            }
            units = {"x_m": "m", "y_m": "m", "fx_N": "N", "fy_N": "N"}
            channels = [
                ChannelObject(name, n, trial.columns[n], {**told, "unit_string": unit})
                for n, unit in units.items()
            ]
            writer.write_segment([GroupObject(name, facts), *channels])


def mapping(
    position: list[str],
    force: list[str],
    by: str,
    values: dict[str, str],
    time: str = "",
    more: str = "",
) -> str:
    """A mapping of the hand's recording in the units of SI."""
    recording = hand()
    lines = [
        'kind = "hand"',
        'perturbation = "returning"',
        f"handle_mass_kg = {recording.handle_mass_kg!r}",
        "shoulder_m = [0.0, 0.0]",
        f"sample_rate_hz = {recording.sample_rate_hz!r}",
        "[subject]",
        *(f"{n} = {v!r}" for n, v in vars(recording.subject).items() if v is not None),
        *(["[time]", f"column = {time!r}", 'unit = "s"'] if time else []),
        "[position]",
        f"columns = {position!r}",
        'unit = "m"',
        "[force]",
        f"columns = {force!r}",
        'unit = "N"',
        'by = "limb"',
        "[trials]",
        by,
        "[trials.columns]",
        *(f"{name} = {column!r}" for name, column in values.items()),
        more,
    ]
    return "\n".join(lines) + "\n"


VALUES = ("condition", "onset_s", "end_s")

#: Name -> what writes it, the file's name, and its mapping.
LOGS = {
    "MCAP, CDR": SimpleNamespace(
        write=write_mcap,
        name="log.mcap",
        mapping=mapping(
            [f"{POSE}.pose.position.{a}" for a in "xy"],
            [f"{FORCE}.wrench.force.{a}" for a in "xy"],
            'by = "column"\ncolumn = "/trial.number"\ndisturbance = "/trial.disturbance"',
            {"condition": "/trial.condition"},
        ),
    ),
    "MCAP, JSON": SimpleNamespace(
        write=lambda recording, path: write_mcap(recording, path, style="json", compression="lz4"),
        name="log.mcap",
        mapping=mapping(
            ["/hand.x_m", "/hand.y_m"],
            ["/hand.fx_N", "/hand.fy_N"],
            'by = "column"\ncolumn = "/hand.trial"',
            {name: f"/hand.{name}" for name in VALUES},
            time="/hand.time_s",
        ),
    ),
    "NWB": SimpleNamespace(
        write=write_nwb,
        name="session.nwb",
        mapping=mapping(
            [f"processing/behavior/Position/hand.{a}" for a in "xy"],
            ["acquisition/force[0]", "acquisition/force[1]"],
            'by = "run"',
            {name: name for name in VALUES},
        ),
    ),
    "TDMS": SimpleNamespace(
        write=write_tdms,
        name="session.tdms",
        mapping=mapping(
            ["x_m", "y_m"], ["fx_N", "fy_N"], 'by = "run"', {name: name for name in VALUES}
        ),
    ),
}
_BAG = mapping(
    [f"{POSE}.pose.position.{a}" for a in "xy"],
    [f"{FORCE}.wrench.force.{a}" for a in "xy"],
    f'by = "column"\ncolumn = "{MARK}.data"\ndisturbance = "{PUSH}.data"',
    {},
    more='condition = { value = "cocontraction_10" }',
)
BAGS = {
    "ROS 2, database": (write_ros2_bag, "bag"),
    "ROS 2, MCAP": (lambda r, p: write_ros2_bag(r, p, "mcap"), "bag"),
    "ROS 1": (write_ros1_bag, "log.bag"),
    "ROS 1, bz2": (lambda r, p: write_ros1_bag(r, p, "BZ2"), "log.bag"),
    "ROS 1, lz4": (lambda r, p: write_ros1_bag(r, p, "LZ4"), "log.bag"),
}
LOGS |= {
    name: SimpleNamespace(write=write, name=file, mapping=_BAG)
    for name, (write, file) in BAGS.items()
}
