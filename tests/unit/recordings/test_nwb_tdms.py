"""NWB and TDMS files by the packages that write them, and what a damaged one may not do."""

from __future__ import annotations

import datetime
import struct

import log_bench as bench
import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.recordings.hdf5 import attribute_text
from armimpedance.recordings.sources.nwb import SOURCE as NWB
from armimpedance.recordings.sources.tdms import SOURCE as TDMS

h5py = pytest.importorskip("h5py")


def columns_of(run):
    return {n: c for table in run.tables for n, c in table.columns.items()}


def new_nwb():
    from pynwb import NWBFile

    return NWBFile(
        session_description="a session",
        identifier="1",
        session_start_time=datetime.datetime(2024, 5, 1, 12, tzinfo=datetime.UTC),
    )


def saved(file, path):
    from pynwb import NWBHDF5IO

    with NWBHDF5IO(path, "w") as io:
        io.write(file)
    return NWB.read(path, bool)


def series(name, data, **clock):
    from pynwb import TimeSeries

    return TimeSeries(name=name, data=np.asarray(data), **({"unit": "N"} | clock))


@pytest.mark.study
def test_conversion_and_offset_are_applied_and_nothing_else_changes_a_bit(tmp_path):
    rng = np.random.default_rng(1)
    plain, whole = rng.normal(size=50), rng.integers(-2000, 2000, 50).astype(np.int16)
    file = new_nwb()
    file.add_acquisition(series("plain", plain, rate=100.0))
    file.add_acquisition(
        series("scaled", whole, rate=100.0, unit="volts", conversion=2.5e-6, offset=0.125)
    )
    (run,) = saved(file, tmp_path / "a.nwb").runs
    columns = columns_of(run)
    assert columns["acquisition/plain"].values.tobytes() == plain.tobytes()
    np.testing.assert_array_equal(columns["acquisition/scaled"].values, whole * 2.5e-6 + 0.125)
    assert columns["acquisition/scaled"].unit == "volts"
    (table,) = run.tables
    assert table.rate_hz == 100.0
    np.testing.assert_array_equal(table.time_s, np.arange(50) / 100)


def test_series_of_the_same_times_are_a_table_and_others_are_not(tmp_path):
    times = np.cumsum(np.random.default_rng(2).uniform(0.5e-3, 1.5e-3, 20))
    file = new_nwb()
    file.add_acquisition(series("a", np.arange(20.0), timestamps=times))
    file.add_acquisition(series("b", np.arange(20.0), timestamps=times.copy()))
    file.add_acquisition(series("c", np.arange(20.0), rate=1000.0))
    file.add_acquisition(series("d", np.arange(20.0), rate=1000.0, starting_time=0.5))
    (run,) = saved(file, tmp_path / "a.nwb").runs
    assert sorted(sorted(table.columns) for table in run.tables) == [
        ["acquisition/a", "acquisition/b"],
        ["acquisition/c"],
        ["acquisition/d"],
    ]
    clock = next(t for t in run.tables if "acquisition/a" in t.columns)
    assert clock.time_s.tobytes() == times.tobytes()
    assert clock.rate_hz is None


def test_emg_has_each_channels_own_conversion(tmp_path):
    from pynwb.ecephys import ElectricalSeries

    file = new_nwb()
    device = file.create_device("amplifier")
    group = file.create_electrode_group("arm", "surface", "arm", device)
    for _ in range(3):
        file.add_electrode(location="arm", group=group)
    region = file.create_electrode_table_region([0, 1, 2], "all")
    data = np.arange(30.0).reshape(10, 3)
    file.add_acquisition(
        ElectricalSeries(
            name="emg",
            data=data,
            electrodes=region,
            rate=2000.0,
            conversion=1e-6,
            channel_conversion=[1.0, 2.0, 4.0],
        )
    )
    (run,) = saved(file, tmp_path / "a.nwb").runs
    for i, factor in enumerate((1e-6, 2e-6, 4e-6)):
        found = columns_of(run)[f"acquisition/emg[{i}]"]
        np.testing.assert_array_equal(found.values, data[:, i] * factor)
        assert found.unit == "volts"


def test_trials_are_cut_at_their_times_and_bear_what_their_table_says(tmp_path):
    file = new_nwb()
    file.add_acquisition(series("fast", np.arange(1000.0), rate=1000.0))
    file.add_acquisition(series("slow", np.arange(100.0), rate=100.0))
    file.add_trial_column("condition", "condition")
    file.add_trial_column("load", "load")
    for start, stop, condition, load in (
        (0.1, 0.2, "a", 1.5),
        (0.2, 0.3, "b", 2.5),
        (0.5, 0.6, "a", 3.5),
    ):
        file.add_trial(start_time=start, stop_time=stop, condition=condition, load=load)
    raw = saved(file, tmp_path / "a.nwb")
    first, second, third = raw.runs
    # Where the next trial begins with the end of this one, that sample is the next one's.
    assert columns_of(first)["acquisition/fast"].values.tolist() == list(range(100, 200))
    assert columns_of(second)["acquisition/fast"].values.tolist() == list(range(200, 301))
    assert columns_of(third)["acquisition/slow"].values.tolist() == list(range(50, 61))
    assert [run.facts["condition"] for run in raw.runs] == ["a", "b", "a"]
    assert [run.facts["load"] for run in raw.runs] == [1.5, 2.5, 3.5]
    fast = next(table for table in third.tables if "acquisition/fast" in table.columns)
    np.testing.assert_array_equal(fast.time_s, np.arange(101) / 1000)
    assert any("outside" in sentence for sentence in raw.not_taken)


def test_what_is_not_taken_is_named_and_who_it_was_is_not_told(tmp_path):
    from pynwb.file import Subject
    from pynwb.image import ImageSeries

    file = new_nwb()
    file.subject = Subject(subject_id="Ann", description="Ann Smith", weight="70 kg", sex="F")
    file.add_acquisition(ImageSeries(name="film", data=np.zeros((3, 4, 4)), rate=1.0, unit="n.a."))
    file.add_acquisition(series("probe", np.zeros((10, 384)), rate=1.0))
    file.add_acquisition(series("force", np.zeros(10), rate=1.0))
    raw = saved(file, tmp_path / "a.nwb")
    (run,) = raw.runs
    assert list(columns_of(run)) == ["acquisition/force"]
    told = " ".join(raw.not_taken)
    assert "acquisition/film" in told
    assert "acquisition/probe" in told
    assert run.facts["subject.weight"] == "70 kg"
    assert "Ann" not in str(run.facts)


def test_only_what_is_wanted_is_read(tmp_path):
    bench.write_nwb(bench.short_hand(), tmp_path / "a.nwb")
    raw = NWB.read(tmp_path / "a.nwb", lambda name: name == "acquisition/force[1]")
    assert all(list(columns_of(run)) == ["acquisition/force[1]"] for run in raw.runs)
    assert any("acquisition/force[0]" in sentence for sentence in raw.not_taken)


def hdf5(path, make):
    with h5py.File(path, "w") as file:
        group = file.create_group("acquisition/a")
        start = group.create_dataset("starting_time", data=0.0)
        start.attrs["rate"] = 1000.0
        make(file, group)
    return NWB.read(path, bool)


def test_links_into_other_files_are_not_followed(tmp_path):
    with h5py.File(tmp_path / "secret.h5", "w") as other:
        other["data"] = np.arange(5.0)
    (tmp_path / "raw.bin").write_bytes(bytes(40))

    def linked(file, group):
        group["data"] = h5py.ExternalLink("secret.h5", "/data")

    def stored_elsewhere(file, group):
        where = [(str(tmp_path / "raw.bin"), 0, 40)]
        group.create_dataset("data", (5,), "f8", external=where)

    def put_together(file, group):
        layout = h5py.VirtualLayout((5,), "f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "secret.h5"), "data", (5,))
        group.create_virtual_dataset("data", layout)

    def linked_twice(file, group):
        file["elsewhere"] = h5py.ExternalLink("secret.h5", "/")
        group["data"] = h5py.SoftLink("/elsewhere/data")

    for number, make in enumerate((linked, linked_twice, stored_elsewhere, put_together)):
        raw = hdf5(tmp_path / f"{number}.nwb", make)
        assert not raw.runs[0].tables
        assert any("acquisition/a" in sentence for sentence in raw.not_taken)


def test_claims_without_data_behind_them_take_no_memory(tmp_path):
    def never_written(file, group):
        group.create_dataset("data", (50_000_000,), "f8", chunks=(1000,))

    def too_many(file, group):
        group.create_dataset("data", (10**12, 3), "f8", chunks=(1000, 3))

    for number, make in enumerate((never_written, too_many)):
        raw = hdf5(tmp_path / f"{number}.nwb", make)
        assert not raw.runs[0].tables
        assert any("acquisition/a" in sentence for sentence in raw.not_taken)


def test_an_attribute_that_claims_more_than_attributes_hold_is_not_read(tmp_path, monkeypatch):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.attrs["unit"] = "m"
        file.attrs["long"] = np.bytes_("x" * 60_000)
    with h5py.File(tmp_path / "a.h5") as file:
        assert attribute_text(file, "long")
        monkeypatch.setattr("armimpedance.recordings.hdf5._LARGEST_ATTRIBUTE", 59_999)
        assert attribute_text(file, "unit") == "m"
        assert attribute_text(file, "long") == attribute_text(file, "absent") == ""


def test_a_link_back_to_where_it_came_from_ends(tmp_path):
    def circle(file, group):
        file["acquisition/b"] = file["acquisition"]
        group.create_dataset("data", data=np.arange(3.0))

    raw = hdf5(tmp_path / "a.nwb", circle)
    assert list(columns_of(raw.runs[0])) == ["acquisition/a"]


def test_a_heap_that_hdf5_would_walk_for_ever_is_refused(tmp_path):
    path = tmp_path / "a.nwb"
    hdf5(path, lambda _, group: group.create_dataset("data", data=np.arange(3.0)))
    with h5py.File(path, "a") as file:
        file["acquisition/a"].attrs["comment"] = "a text in a heap"
    data = bytearray(path.read_bytes())
    heap = data.index(b"GCOL")
    # The part behind the first, whose number and length are wiped out.
    (length,) = struct.unpack_from("<Q", data, heap + 16 + 8)
    following = heap + 16 + 16 + (length + 7) // 8 * 8
    data[following : following + 16] = bytes(16)
    path.write_bytes(data)
    with pytest.raises(InputError, match="heap"):
        NWB.read(path, bool)


# TDMS


def tdms(path, *segments):
    from nptdms import TdmsWriter

    with TdmsWriter(path) as writer:
        for segment in segments:
            writer.write_segment(segment)
    return TDMS.read(path, bool)


def channels(group, start="2024-05-01T12:00:00", step=1e-3, **data):
    from nptdms import ChannelObject

    told = {
        "wf_increment": step,
        "wf_start_time": np.datetime64(start, "us"),
        "wf_start_offset": 0.0,
    }
    return [ChannelObject(group, name, np.asarray(values), told) for name, values in data.items()]


def test_groups_of_the_same_channels_are_trials(tmp_path):
    from nptdms import GroupObject

    rng = np.random.default_rng(3)
    truth = rng.normal(size=(2, 2, 30))
    raw = tdms(
        tmp_path / "a.tdms",
        *(
            [GroupObject(f"trial {i}", {"load": 1.5 * i}), *channels(f"trial {i}", x=x, f=f)]
            for i, (x, f) in enumerate(truth)
        ),
    )
    assert [run.name for run in raw.runs] == ["trial 0", "trial 1"]
    assert [run.facts["load"] for run in raw.runs] == [0.0, 1.5]
    for run, (x, f) in zip(raw.runs, truth, strict=True):
        assert columns_of(run)["x"].values.tobytes() == x.tobytes()
        assert columns_of(run)["f"].values.tobytes() == f.tobytes()
        (table,) = run.tables
        assert table.rate_hz == 1000.0
        np.testing.assert_array_equal(table.time_s, np.arange(30) / 1000)


def test_groups_of_different_channels_are_one_run_of_several_clocks(tmp_path):
    raw = tdms(
        tmp_path / "a.tdms",
        channels("robot", x=np.arange(10.0)),
        channels("emg", start="2024-05-01T12:00:00.25", step=5e-4, biceps=np.arange(20.0)),
    )
    (run,) = raw.runs
    first, second = run.tables
    assert list(first.columns) == ["robot/x"]
    assert list(second.columns) == ["emg/biceps"]
    np.testing.assert_array_equal(second.time_s, 0.25 + np.arange(20) / 2000)
    assert (first.rate_hz, second.rate_hz) == (1000.0, 2000.0)


def test_a_slower_copy_of_a_group_is_no_trial(tmp_path):
    raw = tdms(
        tmp_path / "a.tdms",
        channels("all", x=np.arange(100.0)),
        channels("decimated", step=1e-2, x=np.arange(10.0)),
    )
    (run,) = raw.runs
    assert sorted(columns_of(run)) == ["all/x", "decimated/x"]


def test_a_spectrum_has_no_time(tmp_path):
    from nptdms import ChannelObject

    told = {"wf_increment": 0.5, "wf_xunit_string": "Hz"}
    raw = tdms(tmp_path / "a.tdms", [ChannelObject("g", "power", np.arange(4.0), told)])
    (table,) = raw.runs[0].tables
    assert table.time_s is None
    assert table.rate_hz is None


def test_linear_scalings_units_and_appended_segments(tmp_path):
    from nptdms import ChannelObject

    told = {
        "NI_Number_Of_Scales": 1,
        "NI_Scaling_Status": "unscaled",
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 0.5,
        "NI_Scale[0]_Linear_Y_Intercept": 3.0,
        "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
        "unit_string": "N",
    }
    parts = [np.arange(4, dtype=np.int16), np.arange(4, 9, dtype=np.int16)]
    raw = tdms(tmp_path / "a.tdms", *([ChannelObject("g", "f", part, told)] for part in parts))
    column = columns_of(raw.runs[0])["f"]
    np.testing.assert_array_equal(column.values, 0.5 * np.arange(9) + 3.0)
    assert column.unit == "N"


def test_texts_times_and_an_index_of_another_file(tmp_path):
    from nptdms import ChannelObject

    times = np.datetime64("2024-05-01T12:00:00", "us") + np.arange(3) * np.timedelta64(250, "ms")
    path = tmp_path / "a.tdms"
    path.with_name("a.tdms_index").write_bytes(b"TDShnonsense")
    raw = tdms(
        path,
        [
            ChannelObject("g", "when", times),
            ChannelObject("g", "what", ["rest", "push", "rest"]),
        ],
    )
    columns = columns_of(raw.runs[0])
    np.testing.assert_array_equal(columns["when"].values, [0.0, 0.25, 0.5])
    assert columns["what"].values.tolist() == ["rest", "push", "rest"]


def test_a_count_that_the_file_cannot_hold_is_refused(tmp_path, capfd):
    path = tmp_path / "a.tdms"
    tdms(path, channels("g", x=np.arange(10.0)))
    data = path.read_bytes()
    # Type float64, one dimension, and then the number of samples.
    place = data.index(struct.pack("<III", 20, 10, 1)) + 12
    assert struct.unpack_from("<Q", data, place)[0] == 10
    for count in (2**40, 2**62, 2**64 - 1):
        path.write_bytes(data[:place] + struct.pack("<Q", count) + data[place + 8 :])
        try:
            raw = TDMS.read(path, bool)
        except InputError:
            continue
        assert all(table.rows <= 10 for table in raw.runs[0].tables)
    # What npTDMS logs to the console is heard, not shown.
    assert capfd.readouterr().err == ""


def test_a_recording_that_labview_did_not_close_is_read_up_to_there(tmp_path, capfd):
    path = tmp_path / "a.tdms"
    tdms(path, channels("g", x=np.arange(1000.0)))
    data = path.read_bytes()
    path.write_bytes(data[:-4000])
    raw = TDMS.read(path, bool)
    values = columns_of(raw.runs[0])["x"].values
    np.testing.assert_array_equal(values, np.arange(500.0))
    assert any("npTDMS" in sentence for sentence in raw.not_taken)
    assert capfd.readouterr().err == ""
