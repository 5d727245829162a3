"""Logs of robots: MCAP and ROS bags, by their packages' writers and byte by byte."""

from __future__ import annotations

import dataclasses
import json
import math
import shutil
import sqlite3
import struct
import subprocess
import sys
import zlib

import log_bench as bench
import numpy as np
import pytest

import armimpedance as ai
from armimpedance.core.errors import InputError
from armimpedance.recordings.mapped.door import SOURCES, source_of
from manipulandum_sim.lab_files.mcap_log import START_NS, write_mcap


def read(path, wanted=bool):
    """What a source gives of a file."""
    source = source_of(path)
    assert source is not None
    return source.read(path, wanted)


def columns_of(raw):
    """All columns of the first run by name."""
    return {n: c for table in raw.runs[0].tables for n, c in table.columns.items()}


def table_of(raw, topic):
    return next(t for t in raw.runs[0].tables if any(n.startswith(topic + ".") for n in t.columns))


@pytest.fixture(scope="module")
def reference():
    return ai.estimate(bench.hand())


@pytest.mark.parametrize("name", bench.LOGS)
def test_a_simulated_session_gives_the_same_estimate_to_the_last_bit(name, tmp_path, reference):
    log = bench.LOGS[name]
    place = tmp_path / log.name
    log.write(bench.hand(), place)
    (place if place.is_dir() else tmp_path).joinpath("columns.toml").write_text(log.mapping)
    recording = ai.read(place)
    np.testing.assert_array_equal(recording.position, bench.hand().position)
    np.testing.assert_array_equal(recording.force, bench.hand().force)
    (found,), (known,) = ai.estimate(recording).estimates, reference.estimates
    np.testing.assert_array_equal(found.stiffness, known.stiffness)
    np.testing.assert_array_equal(found.covariance, known.covariance)


# MCAP, record by record


def record(kind, content):
    return struct.pack("<BQ", kind, len(content)) + content


def text(value):
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def schema(number, name, language, data):
    blob = data.encode()
    return record(
        3,
        struct.pack("<H", number)
        + text(name)
        + text(language)
        + struct.pack("<I", len(blob))
        + blob,
    )


def channel(number, of, topic, encoding):
    return record(
        4, struct.pack("<HH", number, of) + text(topic) + text(encoding) + struct.pack("<I", 0)
    )


def message(number, time_ns, data, publish_ns=None):
    stamp = time_ns if publish_ns is None else publish_ns
    return record(5, struct.pack("<HIQQ", number, 0, time_ns, stamp) + data)


def chunk(content, checksum=None, method="", claimed=None, packed=None):
    told = zlib.crc32(content) if checksum is None else checksum
    size = len(content) if claimed is None else claimed
    data = content if packed is None else packed
    return record(
        6,
        struct.pack("<QQQI", 0, 0, size, told) + text(method) + struct.pack("<Q", len(data)) + data,
    )


MAGIC = b"\x89MCAP0\r\n"
END = record(15, bytes(4)) + record(2, bytes(20)) + MAGIC


def mcap(path, *records, end=END):
    path.write_bytes(MAGIC + record(1, text("") + text("a test")) + b"".join(records) + end)
    return path


def json_log(path, *contents, **kwargs):
    messages = [message(1, 1000 * i, c.encode()) for i, c in enumerate(contents)]
    return mcap(path, schema(1, "s", "jsonschema", "{}"), channel(1, 1, "/a", "json"), *messages)


def test_json_comes_flat_and_bit_by_bit(tmp_path):
    values = [0.1, 1 / 3, 5e-324, -0.0, 1.7976931348623157e308]
    content = [
        {"x": v, "deep": {"list": [v, 2]}, "on": True, "name": "a", "gone": None} for v in values
    ]
    raw = read(json_log(tmp_path / "a.mcap", *map(json.dumps, content)))
    columns = columns_of(raw)
    assert columns["/a.x"].values.tobytes() == np.array(values).tobytes()
    assert columns["/a.deep.list[0]"].values.tobytes() == np.array(values).tobytes()
    assert columns["/a.on"].values.tolist() == [1.0] * 5
    assert columns["/a.name"].values.tolist() == ["a"] * 5
    assert np.isnan(columns["/a.gone"].values).all()
    np.testing.assert_array_equal(raw.runs[0].tables[0].time_s, np.arange(5) * 1e-6)


def test_a_key_that_is_missing_in_some_messages_is_missing_there_only(tmp_path):
    raw = read(json_log(tmp_path / "a.mcap", '{"x": 1}', '{"y": 2}', '{"x": 3}'))
    np.testing.assert_array_equal(columns_of(raw)["/a.x"].values, [1, np.nan, 3])
    np.testing.assert_array_equal(columns_of(raw)["/a.y"].values, [np.nan, 2, np.nan])


@pytest.mark.parametrize("content", ["[1]", "{", "nonsense", "[" * 100000, '{"x": 1, "x'])
def test_messages_that_are_no_json_objects_cost_their_topic_and_it_is_named(tmp_path, content):
    raw = read(json_log(tmp_path / "a.mcap", '{"x": 1}', content))
    assert not raw.runs[0].tables
    assert any("/a" in sentence for sentence in raw.not_taken)


def test_a_number_in_some_messages_and_a_text_in_others_is_no_column(tmp_path):
    raw = read(json_log(tmp_path / "a.mcap", '{"x": 1}', '{"x": "one"}'))
    assert "/a.x" not in columns_of(raw)
    assert any("/a" in sentence for sentence in raw.not_taken)


JOINTS = """\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def cdr(order, *parts):
    """A message in CDR: pairs of an alignment and bytes."""
    data = b""
    for alignment, part in parts:
        data += bytes(-len(data) % alignment) + part
    return (b"\x00\x01" if order == "<" else b"\x00\x00") + b"\x00\x00" + data


def joints(order, sec, names, positions):
    strings = []
    for name in names:
        data = name.encode() + b"\x00"
        strings.append((4, struct.pack(order + "I", len(data)) + data))
    return cdr(
        order,
        (4, struct.pack(order + "iI", sec, 500)),
        (4, struct.pack(order + "I", 1) + b"\x00"),
        (4, struct.pack(order + "I", len(names))),
        *strings,
        (4, struct.pack(order + "I", len(positions))),
        *((8, struct.pack(order + "d", p)) for p in positions),
        (4, struct.pack(order + "II", 0, 0)),
    )


@pytest.mark.parametrize("order", "<>")
def test_joints_come_under_their_names_in_whichever_order_a_message_lists_them(tmp_path, order):
    path = mcap(
        tmp_path / "a.mcap",
        schema(1, "sensor_msgs/msg/JointState", "ros2msg", JOINTS),
        channel(1, 1, "/joints", "cdr"),
        message(1, 7, joints(order, 10, ["elbow", "wrist"], [0.1, 0.2])),
        message(1, 8, joints(order, 11, ["wrist", "elbow"], [0.3, 0.4])),
        message(1, 9, joints(order, 12, ["wrist"], [0.5])),
    )
    raw = read(path)
    columns = columns_of(raw)
    np.testing.assert_array_equal(columns["/joints.position.elbow"].values, [0.1, 0.4, np.nan])
    np.testing.assert_array_equal(columns["/joints.position.wrist"].values, [0.2, 0.3, 0.5])
    # The joints' clock is that of their stamps, not of the log.
    np.testing.assert_array_equal(raw.runs[0].tables[0].time_s, [0, 1, 2])
    assert raw.runs[0].facts["clock of /joints"] != "log time"


def test_topics_of_different_rates_stay_different_tables_with_one_beginning(tmp_path):
    path = mcap(
        tmp_path / "a.mcap",
        schema(1, "std_msgs/msg/Float64", "ros2msg", "float64 data"),
        *(channel(i, 1, f"/t{i}", "cdr") for i in (1, 2)),
        *(message(1, 2 * 10**9 + i * 10**6, cdr("<", (8, struct.pack("<d", i)))) for i in range(5)),
        *(message(2, 10**9 + i * 10**7, cdr("<", (8, struct.pack("<d", i)))) for i in range(3)),
    )
    first, second = read(path).runs[0].tables
    np.testing.assert_array_equal(first.time_s, 1 + np.arange(5) / 1000)
    np.testing.assert_array_equal(second.time_s, np.arange(3) / 100)


def test_a_clock_since_1970_keeps_its_nanoseconds(tmp_path):
    times = START_NS + np.array([0, 1, 1_000_000, 123_456_789_012])
    path = mcap(
        tmp_path / "a.mcap",
        channel(1, 0, "/a", "json"),
        *(message(1, int(t), b'{"x": 1}') for t in times),
    )
    expected = [0.0, 1e-9, 1e-3, 123.456789012]
    np.testing.assert_array_equal(read(path).runs[0].tables[0].time_s, expected)


def test_messages_out_of_order_come_in_the_order_of_time(tmp_path):
    path = mcap(
        tmp_path / "a.mcap",
        channel(1, 0, "/a", "json"),
        *(message(1, t, json.dumps({"t": t}).encode()) for t in (3000, 1000, 2000)),
    )
    table = read(path).runs[0].tables[0]
    np.testing.assert_array_equal(table.columns["/a.t"].values, [1000, 2000, 3000])


def test_pictures_are_named_and_not_taken_while_their_small_fields_are(tmp_path):
    text = "uint32 height\nuint32 width\nuint8[] data\nfloat64 gain"
    data = cdr(
        "<",
        (4, struct.pack("<III", 3, 5, 100)),
        (1, bytes(100)),
        (8, struct.pack("<d", 0.25)),
    )
    path = mcap(
        tmp_path / "a.mcap",
        schema(1, "lab/msg/Picture", "ros2msg", text),
        channel(1, 1, "/camera", "cdr"),
        message(1, 0, data),
    )
    raw = read(path)
    assert {n: c.values.tolist() for n, c in columns_of(raw).items()} == {
        "/camera.height": [3.0],
        "/camera.width": [5.0],
        "/camera.gain": [0.25],
    }
    assert any("/camera.data" in sentence for sentence in raw.not_taken)


def test_what_lies_behind_a_long_array_of_messages_is_found(tmp_path):
    text = "Point[] points\nfloat64 after\n" + "=" * 80 + "\nMSG: lab/Point\nfloat32 x\nfloat64 y\n"
    parts = [(4, struct.pack("<I", 1000))]
    for i in range(1000):
        parts += [(4, struct.pack("<f", i)), (8, struct.pack("<d", i))]
    path = mcap(
        tmp_path / "a.mcap",
        schema(1, "lab/msg/Cloud", "ros2msg", text),
        channel(1, 1, "/cloud", "cdr"),
        message(1, 0, cdr("<", *parts, (8, struct.pack("<d", 0.125)))),
    )
    raw = read(path)
    assert columns_of(raw)["/cloud.after"].values.tolist() == [0.125]
    assert list(columns_of(raw)) == ["/cloud.after"]


def test_types_without_a_definition_and_other_encodings_are_named(tmp_path):
    path = mcap(
        tmp_path / "a.mcap",
        schema(1, "lab_msgs/msg/Own", "ros2msg", ""),
        schema(2, "lab.Own", "protobuf", ""),
        channel(1, 1, "/own", "cdr"),
        channel(2, 2, "/proto", "protobuf"),
        message(1, 0, b"\x00\x01\x00\x00"),
        message(2, 0, b"\x08\x01"),
    )
    raw = read(path)
    assert not raw.runs[0].tables
    told = " ".join(raw.not_taken)
    assert "/own" in told
    assert "/proto" in told
    assert "protobuf" in told


def test_a_standard_type_needs_no_definition(tmp_path):
    path = mcap(
        tmp_path / "a.mcap",
        schema(1, "std_msgs/msg/Float64", "ros2msg", ""),
        channel(1, 1, "/f", "cdr"),
        message(1, 0, cdr("<", (8, struct.pack("<d", math.pi)))),
    )
    assert columns_of(read(path))["/f.data"].values.tolist() == [math.pi]


def test_whole_numbers_that_float64_does_not_hold_are_told(tmp_path):
    path = mcap(
        tmp_path / "a.mcap",
        schema(1, "std_msgs/msg/Int64", "ros2msg", "int64 data"),
        channel(1, 1, "/f", "cdr"),
        message(1, 0, cdr("<", (8, struct.pack("<q", 2**53 + 1)))),
    )
    assert any("/f.data" in sentence for sentence in read(path).not_taken)


def test_a_text_that_is_long_in_one_message_is_no_column_of_the_others(tmp_path):
    raw = read(json_log(tmp_path / "a.mcap", '{"x": "a"}', json.dumps({"x": "a" * 1000})))
    assert "/a.x" not in columns_of(raw)
    assert any("/a.x" in sentence for sentence in raw.not_taken)


@pytest.mark.parametrize("method", ["", "lz4", "zstd"])
@pytest.mark.parametrize("chunked", [True, False])
def test_every_way_of_the_packages_writer_is_read_alike(tmp_path, method, chunked):
    from mcap.writer import CompressionType, IndexType, Writer

    for number, index in enumerate((IndexType.ALL, IndexType.NONE)):
        path = tmp_path / f"{number}.mcap"
        kind = CompressionType[method.upper() or "NONE"]
        with path.open("wb") as stream:
            writer = Writer(
                stream, compression=kind, use_chunking=chunked, index_types=index, chunk_size=500
            )
            writer.start()
            known = writer.register_schema("s", "jsonschema", b"{}")
            link = writer.register_channel("/a", "json", known)
            for i in range(50):
                writer.add_message(link, i * 10**9, json.dumps({"x": i / 7}).encode(), 0)
            writer.add_attachment(0, 0, "notes.txt", "text/plain", b"hello")
            writer.finish()
        raw = read(path)
        np.testing.assert_array_equal(columns_of(raw)["/a.x"].values, np.arange(50) / 7)
        assert any("notes.txt" in sentence for sentence in raw.not_taken)


def test_a_log_that_was_cut_is_read_up_to_there_and_that_is_said(tmp_path):
    whole = json_log(tmp_path / "a.mcap", *['{"x": 1}'] * 10).read_bytes()
    rows = set()
    for length in range(len(MAGIC), len(whole) - len(END) + 1):
        path = tmp_path / "cut.mcap"
        path.write_bytes(whole[:length])
        try:
            raw = read(path)
        except InputError:
            continue
        rows.add(sum(table.rows for table in raw.runs[0].tables))
        assert any("cut.mcap ends" in sentence for sentence in raw.not_taken)
    assert rows == set(range(11))


def test_what_was_damaged_inside_is_refused(tmp_path):
    inner = channel(1, 0, "/a", "json") + message(1, 0, b'{"x": 1}')
    with pytest.raises(InputError, match="checksum"):
        read(mcap(tmp_path / "a.mcap", chunk(inner, checksum=1)))
    with pytest.raises(InputError, match="checksum"):
        read(mcap(tmp_path / "a.mcap", chunk(inner, claimed=7)))
    with pytest.raises(InputError, match="damaged"):
        read(mcap(tmp_path / "a.mcap", chunk(inner, method="zstd")))
    with pytest.raises(InputError, match="channel 5"):
        read(mcap(tmp_path / "a.mcap", message(5, 0, b"{}")))
    assert columns_of(read(mcap(tmp_path / "a.mcap", chunk(inner))))


def test_a_small_chunk_that_unpacks_to_gigabytes_is_refused_before(tmp_path):
    import zstandard

    bomb = zstandard.compress(bytes(300_000_000))
    with pytest.raises(InputError, match="chunk that claims"):
        read(mcap(tmp_path / "a.mcap", chunk(b"", 0, "zstd", claimed=300_000_000, packed=bomb)))
    with pytest.raises(InputError, match="more than 100 bytes"):
        read(mcap(tmp_path / "a.mcap", chunk(b"", 0, "zstd", claimed=100, packed=bomb)))


def test_only_what_is_wanted_is_given_and_the_rest_is_named(tmp_path):
    path = tmp_path / "a.mcap"
    write_mcap(bench.short_hand(), path)
    raw = read(path, lambda name: name.endswith("force.x"))
    assert list(columns_of(raw)) == ["/ft_sensor/wrench.wrench.force.x"]
    assert any("/ft_sensor/wrench.wrench.force.y" in sentence for sentence in raw.not_taken)


def test_units_of_rs_standard_messages_are_known(tmp_path):
    path = tmp_path / "a.mcap"
    write_mcap(bench.short_hand(), path)
    columns = columns_of(read(path))
    assert columns["/ft_sensor/wrench.wrench.force.x"].unit == "N"
    assert columns["/robot/pose.pose.position.y"].unit == "m"
    assert columns["/robot/pose.pose.orientation.w"].unit is None


# Against the packages


def test_a_log_reads_as_the_package_reads_it(tmp_path):
    from mcap.reader import make_reader

    path = tmp_path / "a.mcap"
    write_mcap(bench.short_hand(), path, style="json")
    with path.open("rb") as stream:
        theirs = [json.loads(m.data) for _, _, m in make_reader(stream).iter_messages()]
    ours = columns_of(read(path))
    for name in ("x_m", "fy_N", "trial"):
        assert ours[f"/hand.{name}"].values.tolist() == [m[name] for m in theirs]


TYPES = (
    "geometry_msgs/msg/WrenchStamped",
    "sensor_msgs/msg/Imu",
    "trajectory_msgs/msg/JointTrajectoryPoint",
    "std_msgs/msg/Float64MultiArray",
    "sensor_msgs/msg/BatteryState",
    "geometry_msgs/msg/PoseArray",
)


def filled(store, name, rng, depth=0):
    """A message of a type, all its fields at random, as rosbags has it."""
    from rosbags.interfaces import Nodetype

    def one(kind, what):
        if kind == Nodetype.NAME:
            return filled(store, what, rng, depth + 1)
        base = what[0]
        if base == "string":
            return "abcdefg"[: int(rng.integers(8))]
        if base == "bool":
            return bool(rng.integers(2))
        if base.startswith("float"):
            return float(np.dtype(base).type(rng.normal()))
        return int(rng.integers(0, 100))

    def many(inner, count):
        kind, what = inner
        if kind == Nodetype.BASE and what[0] not in ("string",):
            base = {"bool": "bool", "byte": "uint8", "char": "uint8"}.get(what[0], what[0])
            return rng.integers(0, 100, count).astype(base)
        return [one(kind, what) for _ in range(count)]

    fields = {}
    for field, (kind, what) in store.fielddefs[name][1]:
        if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            fixed = kind == Nodetype.ARRAY
            fields[field] = many(what[0], what[1] if fixed else int(rng.integers(0, 4)))
        else:
            fields[field] = one(kind, what)
    return store.types[name](**fields)


def flat(value, path=""):
    """Paths and values of a message of rosbags."""
    if hasattr(value, "__dataclass_fields__"):
        # What has a default is a constant of the type.
        for field in (f for f in dataclasses.fields(value) if f.default is dataclasses.MISSING):
            yield from flat(getattr(value, field.name), f"{path}.{field.name}")
    elif isinstance(value, list | np.ndarray):
        for i, each in enumerate(value):
            yield from flat(each, f"{path}[{i}]")
    else:
        yield path, value


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("ros", [1, 2])
def test_any_message_is_decoded_as_rosbags_encodes_it(tmp_path, kind, ros):
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin, Writer as Writer2

    rng = np.random.default_rng(ros)
    store = bench.messages_of(ros)
    messages = [filled(store, kind, rng) for _ in range(20)]
    path = tmp_path / ("a.bag" if ros == 1 else "a")
    plugin = {"version": 9, "storage_plugin": StoragePlugin.MCAP} if ros == 2 else {}
    pack = store.serialize_ros1 if ros == 1 else store.serialize_cdr
    with Writer1(path) if ros == 1 else Writer2(path, **plugin) as writer:
        link = writer.add_connection("/t", kind, typestore=store)
        for i, each in enumerate(messages):
            writer.write(link, (i + 1) * 1000, pack(each, kind))
    raw = read(path)
    columns = columns_of(raw)
    # By their stamps, or by log time as they came.
    stamped = raw.runs[0].facts["clock of /t"] != "log time"
    rows = (
        sorted(messages, key=lambda m: (m.header.stamp.sec, m.header.stamp.nanosec))
        if stamped
        else messages
    )
    pairs = [(i, way, value) for i, m in enumerate(rows) for way, value in flat(m)]
    pairs = [each for each in pairs if not each[1].startswith(".header.stamp")]
    assert len(pairs) > 20
    for row, way, value in pairs:
        known = value if isinstance(value, str) else float(value)
        assert columns["/t" + way].values[row] == known, way


def test_a_bag_without_definitions_is_read_with_those_that_every_ros_has(tmp_path):
    bench.write_ros2_bag(bench.short_hand(), tmp_path / "bag")
    database = tmp_path / "bag" / "bag.db3"
    whole = columns_of(read(tmp_path / "bag"))
    with sqlite3.connect(database) as base:
        base.execute("DROP TABLE message_definitions")
    bare = columns_of(read(database))
    assert list(bare) == list(whole)
    for name, column in bare.items():
        np.testing.assert_array_equal(column.values, whole[name].values)


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE"])
@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_compressed_bag_is_the_same_bag(tmp_path, mode, storage):
    bench.write_ros2_bag(bench.short_hand(), tmp_path / "bag", storage)
    bench.write_ros2_bag(bench.short_hand(), tmp_path / "packed", storage, mode)
    packed = columns_of(read(tmp_path / "packed"))
    for name, column in columns_of(read(tmp_path / "bag")).items():
        np.testing.assert_array_equal(packed[name].values, column.values)


def test_a_part_that_unpacks_to_far_more_than_a_bag_does_is_refused(tmp_path):
    import zstandard

    bench.write_ros2_bag(bench.short_hand(), tmp_path / "bag", "sqlite3", "FILE")
    (part,) = (tmp_path / "bag").glob("*.zstd")
    part.write_bytes(zstandard.compress(bytes(70_000_000)))
    with pytest.raises(InputError, match="unpacks to more"):
        read(tmp_path / "bag")


def test_a_bag_of_several_files_is_one_run_and_a_missing_file_is_an_error(tmp_path):
    bench.write_ros2_bag(bench.short_hand(), tmp_path / "bag")
    folder = tmp_path / "bag"
    whole = columns_of(read(folder))
    shutil.copy(folder / "bag.db3", folder / "second.db3")
    for name, half in (("bag.db3", "> 600"), ("second.db3", "<= 600")):
        with sqlite3.connect(folder / name) as base:
            base.execute(f"DELETE FROM messages WHERE id {half}")  # noqa: S608
    metadata = folder / "metadata.yaml"
    # Where the folder was recorded, its name was part of the path.
    metadata.write_text(metadata.read_text().replace("- bag.db3", "- bag.db3\n  - old/second.db3"))
    for name, column in columns_of(read(folder)).items():
        np.testing.assert_array_equal(column.values, whole[name].values)
    (folder / "second.db3").unlink()
    with pytest.raises(InputError, match="second.db3"):
        read(folder)


def test_a_view_in_the_place_of_the_messages_is_not_run(tmp_path):
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as base:
        base.execute("CREATE TABLE topics(id, name, type, serialization_format)")
        base.execute(
            "CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i FROM n)"
            " SELECT i AS topic_id, i AS timestamp, i AS data FROM n"
        )
    with pytest.raises(InputError, match="no tables"):
        read(path)


def test_what_waits_in_a_write_ahead_log_is_told(tmp_path):
    bench.write_ros2_bag(bench.short_hand(), tmp_path / "bag")
    (tmp_path / "bag" / "bag.db3-wal").write_bytes(b"\x00" * 100)
    assert any("bag.db3-wal" in s for s in read(tmp_path / "bag").not_taken)


def test_a_bag_without_an_index_reads_as_with_it(tmp_path):
    path = tmp_path / "a.bag"
    bench.write_ros1_bag(bench.short_hand(), path)
    whole = columns_of(read(path))
    data = path.read_bytes()
    start = data.index(b"index_pos=") + len(b"index_pos=")
    (index,) = struct.unpack_from("<Q", data, start)
    path.write_bytes(data[:start] + bytes(8) + data[start + 8 : index])
    for name, column in columns_of(read(path)).items():
        np.testing.assert_array_equal(column.values, whole[name].values)


def test_a_bag_that_was_cut_is_read_up_to_its_last_whole_chunk(tmp_path):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    kind = store.types["std_msgs/msg/Float64"]
    path = tmp_path / "a.bag"
    with Writer(path) as writer:
        writer.chunk_threshold = 2000
        link = writer.add_connection("/t", "std_msgs/msg/Float64", typestore=store)
        for i in range(300):
            writer.write(link, i, store.serialize_ros1(kind(data=i / 3), kind.__msgtype__))
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    raw = read(path)
    values = columns_of(raw)["/t.data"].values
    assert 0 < len(values) < 300
    np.testing.assert_array_equal(values, np.arange(len(values)) / 3)
    assert any("a.bag ends" in sentence for sentence in raw.not_taken)


def test_hostile_names_do_not_reach_a_message(tmp_path):
    path = mcap(
        tmp_path / "a.mcap",
        channel(1, 0, "/a\nb\x1b[31m", "json"),
        channel(2, 0, "/" + "long" * 500, "json"),
        message(1, 0, b'{"x\\ny": 1, "z": 2}'),
        message(2, 0, b'{"x": 1}'),
    )
    raw = read(path)
    names = [*columns_of(raw), *raw.not_taken, *raw.runs[0].facts]
    assert all(name.isprintable() for name in names)
    assert all(len(name) <= 1000 for name in names)


def test_each_kind_is_recognised_by_one_source_without_any_package(tmp_path):
    short = bench.short_hand()
    write_mcap(short, tmp_path / "a.mcap")
    bench.write_ros1_bag(short, tmp_path / "a.bag")
    bench.write_ros2_bag(short, tmp_path / "folder")
    bench.write_nwb(short, tmp_path / "a.nwb")
    bench.write_tdms(short, tmp_path / "a.tdms")
    places = ["a.mcap", "a.bag", "folder", "folder/folder.db3", "a.nwb", "a.tdms"]
    for name in places:
        known = [key for key, source in SOURCES.items() if source.recognises(tmp_path / name)]
        assert len(known) == 1, (name, known)
    code = (
        "import sys\n"
        "for name in ('mcap', 'rosbags', 'h5py', 'nptdms', 'pynwb', 'zstandard'):\n"
        "    sys.modules[name] = None\n"
        "from pathlib import Path\n"
        "from armimpedance.core.errors import InputError\n"
        "from armimpedance.recordings.mapped.door import source_of\n"
        f"for name in {places!r}:\n"
        f"    path = Path({str(tmp_path)!r}) / name\n"
        "    try:\n"
        "        source_of(path).read(path, lambda name: True)\n"
        "    except InputError as error:\n"
        "        print(name, error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    told = {line.split()[0]: line for line in done.stdout.splitlines()}
    # Bags of ROS 1 and databases with definitions need no package; compressed MCAP needs one.
    assert set(told) == {"a.mcap", "a.nwb", "a.tdms"}
    assert "armimpedance[ros]" in told["a.mcap"]
    assert "armimpedance[nwb]" in told["a.nwb"]
    assert "armimpedance[tdms]" in told["a.tdms"]


def test_empty_messages_in_each_other_by_the_billion_are_not_walked(tmp_path):
    levels = [f"L{i + 1} " + f"\nL{i + 1} ".join("abcdefgh") for i in range(12)]
    rule = "\n" + "=" * 80 + "\n"
    text = rule.join([levels[0], *(f"MSG: x/L{i}\n{t}" for i, t in enumerate(levels[1:], 1))])
    text += rule + "MSG: x/L12\n"
    path = mcap(
        tmp_path / "a.mcap",
        schema(1, "x/L0", "ros1msg", text),
        channel(1, 1, "/deep", "ros1"),
        message(1, 0, b""),
    )
    assert any("/deep" in sentence for sentence in read(path).not_taken)


def test_texts_of_any_length_in_each_message_stay_with_their_message(tmp_path):
    words = ["abcdefghij"[: i % 11] + "x" * (i % 7) for i in range(500)]
    parts = [(w.encode() + b"\x00", f"{w}.".encode() + b"\x00") for w in words]
    messages = [
        message(
            1,
            i,
            cdr(
                "<",
                (4, struct.pack("<I", len(a)) + a),
                (4, struct.pack("<I", len(b)) + b),
                (8, struct.pack("<d", i / 7)),
            ),
        )
        for i, (a, b) in enumerate(parts)
    ]
    path = mcap(
        tmp_path / "a.mcap",
        schema(1, "x/msg/Two", "ros2msg", "string a\nstring b\nfloat64 c"),
        channel(1, 1, "/two", "cdr"),
        *messages,
    )
    columns = columns_of(read(path))
    assert columns["/two.a"].values.tolist() == words
    assert columns["/two.b"].values.tolist() == [f"{w}." for w in words]
    np.testing.assert_array_equal(columns["/two.c"].values, np.arange(500) / 7)
