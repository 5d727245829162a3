"""Files of any layout with a mapping: what was simulated comes back, and every way to be wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
from mapped_files import (
    BY_TRIAL,
    FXY,
    ONSETS,
    XY,
    cells,
    hand_mapping,
    long_table,
    struct_array,
    trials_of,
    write_mat73,
)

from armimpedance.core.errors import InputError
from armimpedance.core.findings import told_not_taken
from armimpedance.core.records import Recording
from armimpedance.hand.still.show import estimate
from armimpedance.recordings import ReadOptions, open_recording
from armimpedance.recordings.mapped.columns_toml import read_mapping
from armimpedance.recordings.sources.csv import SOURCE


@pytest.fixture(scope="module")
def truth(truth: Recording) -> Recording:
    """Four of the eight pushes."""
    return truth.select([0, 1, 2, 3])


def with_mapping(path: Path, text: str) -> Path:
    (path if path.is_dir() else path.parent).joinpath("columns.toml").write_text(text)
    return path


def comma(recording: Recording, folder: Path) -> Path:
    long_table(recording).to_csv(folder / "a.csv", index=False)
    text = hand_mapping(XY, FXY, time="t", trials=BY_TRIAL, values=ONSETS)
    return with_mapping(folder / "a.csv", text)


def excel(recording: Recording, folder: Path) -> Path:
    names = ["trial", "cond", "Zeit [s]", "Weg x / m", "Weg y / m", "Kraft x in N", "Kraft y in N"]
    table = long_table(recording, [*names, "onset", "end"])
    body = table.to_csv(sep=";", decimal=",", index=False, lineterminator="\r\n", encoding=None)
    (folder / "a.csv").write_bytes(f"sep=;\r\n{body}".encode("utf-16"))
    text = hand_mapping(names[3:5], names[5:], time=names[2], trials=BY_TRIAL, values=ONSETS)
    return with_mapping(folder / "a.csv", text)


def units_row(recording: Recording, folder: Path) -> Path:
    table = long_table(recording)
    rows = table.to_csv(sep="\t", index=False, header=False)
    units = "\t".join(["-", "", "s", "m", "m", "N", "N", "s", "s"])
    head = "Gerät: Größe 3\nDate:\t2020-01-01\n\n" + "\t".join(table.columns)
    (folder / "a.txt").write_text(f"{head}\n{units}\n{rows}", encoding="latin-1")
    text = hand_mapping(XY, FXY, time="t", trials=BY_TRIAL, values=ONSETS)
    return with_mapping(folder / "a.txt", text)


def commented(recording: Recording, folder: Path) -> Path:
    table = long_table(recording).drop(columns="cond")
    np.savetxt(folder / "a.dat", table, fmt="%.17g", header=" ".join(table.columns))
    values = 'onset_s = "onset"\nend_s = "end"\ncondition = { value = "cocontraction_10" }'
    text = hand_mapping(XY, FXY, time="t", trials=BY_TRIAL, values=values)
    return with_mapping(folder / "a.dat", text)


def by_device(recording: Recording, folder: Path) -> Path:
    table = long_table(recording)
    table["fx"] *= -1
    table["y"] *= -1
    table.to_csv(folder / "a.csv", index=False, quoting=2)
    text = hand_mapping(XY, FXY, time="t", trials=BY_TRIAL, values=ONSETS, by="device")
    text = text.replace('columns = ["x", "y"]', 'columns = ["x", "y"]\nsign = [1, -1]')
    text = text.replace('columns = ["fx", "fy"]', 'columns = ["fx", "fy"]\nsign = [1, -1]')
    return with_mapping(folder / "a.csv", text)


def file_a_trial(recording: Recording, folder: Path) -> Path:
    for number, part in long_table(recording).groupby("trial"):
        part.drop(columns=["trial", "cond"]).to_csv(
            folder / f"cocontraction_10-{number}.csv", index=False
        )
    (folder / "notes.txt").write_text("Nothing.")
    trials = 'by = "run"\npattern = "{condition}-{trial}"'
    values = 'onset_s = "onset"\nend_s = "end"'
    return with_mapping(folder, hand_mapping(XY, FXY, time="t", trials=trials, values=values))


def side_by_side(recording: Recording, folder: Path) -> Path:
    columns = {}
    for i, trial in enumerate(trials_of(recording), start=1):
        columns |= {
            f"t_{i}": trial["t"],
            f"x_{i}": trial["pos"][:, 0],
            f"y_{i}": trial["pos"][:, 1],
        }
        columns |= {f"fx_{i}": trial["force"][:, 0], f"fy_{i}": trial["force"][:, 1]}
        columns |= {f"on_{i}": np.full(len(trial["t"]), trial["onset"])}
        columns |= {f"end_{i}": np.full(len(trial["t"]), trial["ending"])}
    table = pd.DataFrame({name: pd.Series(values) for name, values in columns.items()})
    table.to_parquet(folder / "a.parquet")
    values = 'onset_s = "on_*"\nend_s = "end_*"\ncondition = { value = "cocontraction_10" }'
    text = hand_mapping(
        ["x_*", "y_*"], ["fx_*", "fy_*"], time="t_*", trials='by = "columns"', values=values
    )
    return with_mapping(folder / "a.parquet", text)


def row_a_trial(recording: Recording, folder: Path) -> Path:
    rows = [
        {"x": t["pos"][:, 0], "y": t["pos"][:, 1], "fx": t["force"][:, 0], "fy": t["force"][:, 1]}
        | {name: t[name] for name in ("t", "cond", "trial", "ending")}
        | {"onset": 1 + int(np.searchsorted(t["t"], t["onset"]))}
        for t in trials_of(recording)
    ]
    pq.write_table(pa.Table.from_pylist(rows), folder / "a.parquet")
    values = 'onset_s = { column = "onset", unit = "sample" }\nend_s = "ending"\n'
    values += 'condition = "cond"\ntrial = "trial"'
    return with_mapping(folder / "a.parquet", hand_mapping(XY, FXY, time="t", values=values))


MATLAB = [f"trials.{n}(:,{i})" for n in ("pos", "force") for i in (1, 2)]
STRUCTS = "\n".join(
    f'{name} = "trials.{of}"'
    for name, of in (
        ("onset_s", "onset"),
        ("end_s", "ending"),
        ("condition", "cond"),
        ("trial", "trial"),
    )
)


def matlab_structs(recording: Recording, folder: Path) -> Path:
    scipy.io.savemat(
        folder / "a.mat", {"trials": struct_array(trials_of(recording))}, do_compression=True
    )
    text = hand_mapping(MATLAB[:2], MATLAB[2:], time="trials.t", values=STRUCTS)
    return with_mapping(folder / "a.mat", text)


def matlab_hdf5(recording: Recording, folder: Path) -> Path:
    write_mat73(folder / "a.mat", {"trials": trials_of(recording), "fs": 1000.0})
    text = hand_mapping(MATLAB[:2], MATLAB[2:], time="trials.t", values=STRUCTS)
    return with_mapping(folder / "a.mat", text)


def matlab_cells(recording: Recording, folder: Path) -> Path:
    trials = trials_of(recording)
    content = {
        "pos": cells([t["pos"].T for t in trials]),
        "f": cells([t["force"] for t in trials]),
        "t": cells([t["t"] for t in trials]),
        "on": np.array([t["onset"] for t in trials]) * 1.0,
        "off": cells([t["ending"] for t in trials]),
        "cond": cells([t["cond"] for t in trials]),
    }
    scipy.io.savemat(folder / "a.mat", content)
    values = 'onset_s = "on"\nend_s = "off"\ncondition = "cond"'
    text = hand_mapping(["pos(1,:)", "pos(2,:)"], ["f(:,1)", "f(:,2)"], time="t", values=values)
    return with_mapping(folder / "a.mat", text)


LAYOUTS = [
    *(comma, excel, units_row, commented, by_device, file_a_trial, side_by_side, row_a_trial),
    *(matlab_structs, matlab_hdf5, matlab_cells),
]


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.__name__)
def test_the_same_recording_comes_back_to_the_bit(
    layout: Callable[[Recording, Path], Path], truth: Recording, tmp_path: Path
) -> None:
    read = open_recording(layout(truth, tmp_path))
    assert isinstance(read, Recording)
    assert read.sample_rate_hz == truth.sample_rate_hz
    for name in ("time_s", "position", "force", "offsets"):
        assert getattr(read, name).tobytes() == getattr(truth, name).tobytes(), name
    same = ["trial", "condition", "onset_s", "end_s"]
    pd.testing.assert_frame_equal(read.trials[same], truth.trials[same], check_exact=True)


@pytest.mark.first_cases(1)
@pytest.mark.parametrize("layout", [side_by_side, excel, matlab_hdf5], ids=lambda f: f.__name__)
def test_estimates_are_the_same_to_the_bit(layout, truth: Recording, tmp_path: Path) -> None:
    path = layout(truth, tmp_path)
    mass = f"handle_mass_kg = {truth.handle_mass_kg!r}\n"
    mapping = (tmp_path / "columns.toml").read_text()
    (tmp_path / "columns.toml").write_text(mass + mapping)
    plain = open_recording(path)
    assert isinstance(plain, Recording)
    kept = {"trial", "condition", "onset_s", "end_s"}
    bare = truth.trials[[c for c in truth.trials if c in kept]]
    reference = Recording(
        kind="hand",
        sample_rate_hz=truth.sample_rate_hz,
        trials=bare,
        offsets=truth.offsets,
        time_s=truth.time_s,
        position=truth.position,
        force=truth.force,
        handle_mass_kg=truth.handle_mass_kg,
    )
    ours, theirs = estimate(plain).to_frame(), estimate(reference).to_frame()
    numbers = ours.select_dtypes("number").columns
    assert len(numbers) > 20
    assert ours[numbers].to_numpy().tobytes() == theirs[numbers].to_numpy().tobytes()


def test_units_are_brought_to_si(truth: Recording, tmp_path: Path) -> None:
    table = long_table(truth)
    table[["x", "y"]] *= 1000.0
    table[["fx", "fy"]] /= 9.80665
    table["t"] *= 1e3
    table["onset"] *= 1e3
    table.to_csv(tmp_path / "a.csv", index=False)
    text = hand_mapping(XY, FXY, time="t", trials=BY_TRIAL)
    text = text.replace('unit = "m"', 'unit = "mm"').replace('unit = "N"', 'unit = "kgf"')
    text = text.replace('unit = "s"', 'unit = "ms"')
    text += 'onset_s = { column = "onset", unit = "ms" }\n'
    read = open_recording(with_mapping(tmp_path / "a.csv", text))
    assert isinstance(read, Recording)
    np.testing.assert_allclose(read.position, truth.position, rtol=1e-15)
    np.testing.assert_allclose(read.force, truth.force, rtol=1e-15)
    np.testing.assert_allclose(read.trials["onset_s"], truth.trials["onset_s"], rtol=1e-14)
    assert any("mm" in sentence for sentence in read.provenance)


def test_a_session_is_cut_where_its_clock_jumps(truth: Recording, tmp_path: Path) -> None:
    table = long_table(truth)
    table["t"] += 10.0 * (table["trial"] - 1)
    table.to_csv(tmp_path / "a.csv", index=False)
    text = hand_mapping(XY, FXY, time="t", trials='by = "gap"')
    read = open_recording(with_mapping(tmp_path / "a.csv", text))
    assert isinstance(read, Recording)
    assert read.offsets.tolist() == truth.offsets.tolist()
    assert read.position.tobytes() == truth.position.tobytes()


def test_a_session_is_cut_around_the_edges_of_a_mark(tmp_path: Path) -> None:
    n, onsets = 6000, [1000, 2500, 5500]
    mark = np.zeros(n)
    for onset in onsets:
        mark[onset + 1 : onset + 301] = 5.0
    x = np.arange(n) * 1e-5
    table = pd.DataFrame({"x": x, "y": x, "fx": x, "fy": -x, "mark": mark})
    table.to_csv(tmp_path / "a.csv", index=False)
    trials = 'by = "edge"\ncolumn = "mark"\nthreshold = 2.5\nbefore_s = 0.2\nafter_s = 0.6\n'
    trials += 'disturbance = "mark"\ndisturbance_threshold = 2.5'
    text = hand_mapping(XY, FXY, trials=trials, more="sample_rate_hz = 1000")
    read = open_recording(with_mapping(tmp_path / "a.csv", text))
    assert isinstance(read, Recording)
    # The last one's 0.6 s reach beyond the record.
    assert read.n_trials == 2
    assert any("left out" in sentence for sentence in read.provenance)
    for row, onset in enumerate(onsets[:2]):
        own = read.samples_of(row)
        assert read.position[own, 0].tobytes() == x[onset - 200 : onset + 601].tobytes()
        at = int(np.argmin(np.abs(read.time_s[own] - read.trials["onset_s"].iloc[row])))
        assert read.position[own, 0][at] == x[onset]
        assert read.trials["end_s"].iloc[row] - read.trials["onset_s"].iloc[row] == pytest.approx(
            0.301
        )


def test_several_clocks_are_brought_to_that_of_the_position(tmp_path: Path) -> None:
    slow, fast = np.arange(400) / 200.0, 0.0103 + np.arange(1900) / 1000.0
    content = {
        "p": {"time": slow, "data": np.column_stack([np.sin(slow), np.cos(slow)]) / 10},
        "f": {"time": fast, "data": np.column_stack([3 * fast, 1 - fast])},
    }
    scipy.io.savemat(tmp_path / "a.mat", content)
    text = hand_mapping(["p.data(:,1)", "p.data(:,2)"], ["f.data(:,1)", "f.data(:,2)"])
    path = with_mapping(tmp_path / "a.mat", text)
    with pytest.raises(InputError, match="1000 Hz beside the position's 200"):
        open_recording(path)
    content["f"] = {"time": fast[::2], "data": np.column_stack([3 * fast, 1 - fast])[::2]}
    scipy.io.savemat(tmp_path / "a.mat", content)
    read = open_recording(path)
    assert isinstance(read, Recording)
    # A straight line is interpolated exactly; nothing is drawn beyond its ends.
    np.testing.assert_allclose(read.force[:, 0], 3 * read.time_s, atol=1e-12)
    inside = (slow >= fast[0]) & (slow <= fast[::2][-1])
    assert read.time_s.tobytes() == slow[inside].tobytes()
    assert any("interpolated" in s for s in read.provenance)
    assert any("left out" in s for s in read.provenance)
    content["f"]["time"] = np.delete(np.append(content["f"]["time"], 1.95), 300)
    content["f"]["time"][300:] += 0.1
    scipy.io.savemat(tmp_path / "a.mat", content)
    with pytest.raises(InputError, match="missing value"):
        open_recording(path)


def test_what_the_mapping_does_not_name_is_listed(truth: Recording, tmp_path: Path) -> None:
    path = comma(truth, tmp_path)
    table = long_table(truth).assign(gaze=1.0, note="none", state=2.0)
    table.to_csv(path, index=False)
    mapping = (tmp_path / "columns.toml").read_text()
    (tmp_path / "columns.toml").write_text('keep = ["state"]\n' + mapping)
    read = open_recording(path)
    assert isinstance(read, Recording)
    told = " ".join(told_not_taken(read.provenance))
    assert "gaze" in told
    assert "note" in told
    assert set(read.extra) == {"state"}


def test_objects_of_matlab_are_told_with_what_to_do(tmp_path: Path) -> None:
    path = write_mat73(tmp_path / "a.mat", {"x": np.zeros(3)})
    import h5py

    with h5py.File(path, "r+") as file:
        file["x"].attrs["MATLAB_object_decode"] = 3
        file["x"].attrs["MATLAB_class"] = np.bytes_("table")
    with_mapping(path, hand_mapping(XY, FXY))
    with pytest.raises(InputError, match=r"class table.*table2struct"):
        open_recording(path)


def test_a_table_without_a_mapping_says_what_to_run(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x,y\n1,2\n3,4\n")
    with pytest.raises(InputError, match="armimpedance map-columns"):
        open_recording(tmp_path / "a.csv")
    with pytest.raises(InputError, match="armimpedance map-columns"):
        open_recording(tmp_path)
    (tmp_path / "else.toml").write_text(hand_mapping(XY, FXY))
    with pytest.raises(InputError, match="fx"):
        open_recording(tmp_path / "a.csv", ReadOptions(mapping=tmp_path / "else.toml"))


def cell(column: str, row: int, value: object) -> Callable[[pd.DataFrame], pd.Series]:
    """The column with another value in one row, counted from 0 without the header."""
    return lambda t: t[column].astype(object).where(t.index != row, value)


#: Column, what becomes of it, words of the message.
DAMAGES: dict[str, tuple[str, Callable[[pd.DataFrame], pd.Series], str]] = {
    "missing": ("fx", cell("fx", 7, None), "row 9, column fx"),
    "text": ("y", cell("y", 4, "lost"), "row 6, column y"),
    "infinite": ("x", cell("x", 5, np.inf), "not finite"),
    "millimetres": ("x", lambda t: t["x"] * 1000 * (1 + t.index / 10), "millimetres"),
    "double time": ("t", cell("t", 5, 0.004), "time"),
    "a gap": ("t", lambda t: t["t"] + 0.5 * (t.index > 20), "a gap, or another rate"),
    "jitter": ("t", lambda t: t["t"] + 3e-4 * (t.index % 2), "another rate"),
    "split": ("trial", cell("trial", 900, 5), "goes on"),
    "onset": ("onset", lambda t: t["onset"] + 9, "outside of the trial"),
    "changing": ("onset", cell("onset", 3, 0.1), "changes within"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_what_is_wrong_is_named_by_its_place(name, truth: Recording, tmp_path: Path) -> None:
    path = comma(truth, tmp_path)
    table = long_table(truth)
    column, damage, words = DAMAGES[name]
    table[column] = damage(table)
    table.to_csv(path, index=False)
    with pytest.raises(InputError, match=words) as caught:
        open_recording(path)
    assert caught.value.file is not None
    assert "\n" not in str(caught.value)


#: What is wrong in a mapping -> what is replaced, by what, words of the message.
MISTAKES = {
    "undecided": ('unit = "N"', 'unit = "?"', r"row 14, column force.unit: is not decided"),
    "no by": ('by = "limb"', '# by = "limb"', r"row \d+, column force.by: is missing"),
    "other by": ('by = "limb"', 'by = "robot"', "force.by"),
    "unknown key": ('by = "limb"', 'by = "limb"\nsgin = -1', "sgin: unknown key"),
    "unknown section": ("[trials]", "[emgs]\nunit = 'V'\n[trials]", "emgs: unknown key"),
    "unit": ('unit = "m"', 'unit = "furlong"', "unknown unit 'furlong'"),
    "dimension": ('unit = "m"', 'unit = "N"', "no unit of length"),
    "sign": ('unit = "m"', 'unit = "m"\nsign = [1, -2]', "position.sign"),
    "both": ('unit = "m"', 'unit = "m"\nscale = 2.0', "and scale"),
    "no column": ('"fx"', '"fz"', "fz: no such column"),
    "twice": ('["x", "y"]', '["x", "x"]', "stand twice"),
    "axes": ('["fx", "fy"]', '["fx"]', "1 columns of force"),
    "by": ('by = "column"', 'by = "columnx"', "trials.by"),
    "toml": ("[trials]", "[trials", "broken TOML"),
    "kind": ('kind = "hand"', 'kind = "foot"', "kind"),
    "subject": ("[trials]", "[subject]\nmass_kg = 'x'\n[trials]", "subject.mass_kg"),
    "keep": ('kind = "hand"', 'kind = "hand"\nkeep = ["end"]\nfiles = 3', "files"),
    "stated unit": ('["x", "y"]', '["X (mm)", "y"]', "the file says mm, the mapping m"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_what_is_wrong_in_a_mapping_is_named(name, truth: Recording, tmp_path: Path) -> None:
    path = comma(truth, tmp_path)
    long_table(truth).assign(**{"X (mm)": 1.0}).to_csv(path, index=False)
    before, after, words = MISTAKES[name]
    text = (tmp_path / "columns.toml").read_text()
    assert before in text
    (tmp_path / "columns.toml").write_text(text.replace(before, after))
    with pytest.raises(InputError, match=words) as caught:
        open_recording(path)
    assert "\n" not in str(caught.value)


def test_a_column_that_is_kept_cannot_take_a_meaning(truth: Recording, tmp_path: Path) -> None:
    path = comma(truth, tmp_path)
    long_table(truth).assign(q_elbow_rad=1.0).to_csv(path, index=False)
    text = (tmp_path / "columns.toml").read_text()
    (tmp_path / "columns.toml").write_text('keep = ["q_elbow_rad"]\n' + text)
    with pytest.raises(InputError, match="q_elbow_rad"):
        open_recording(path)


def test_numbers_of_trials_that_stand_twice_are_kept_beside_new_ones(
    truth: Recording, tmp_path: Path
) -> None:
    for block in ("a", "b"):
        long_table(truth).to_csv(tmp_path / f"{block}.csv", index=False)
    with_mapping(tmp_path, hand_mapping(XY, FXY, time="t", trials=BY_TRIAL))
    read = open_recording(tmp_path)
    assert isinstance(read, Recording)
    assert read.trials["trial"].tolist() == list(range(1, 9))
    assert read.trials["trial_in_file"].tolist() == 2 * list(range(1, 5))


def test_the_mapping_of_the_documentation_is_one(tmp_path: Path) -> None:
    page = Path(__file__).resolve().parents[3] / "docs/reference/files/mapping.md"
    text = page.read_text().partition("```toml\n")[2].partition("```")[0]
    (tmp_path / "columns.toml").write_text(text)
    mapping = read_mapping(tmp_path / "columns.toml")
    assert mapping.position.signs == (1, -1)
    assert mapping.metadata.muscles == ("biceps_long", "triceps_long")


@pytest.mark.parametrize(
    ("text", "names", "rows"),
    [
        # A row with a word under a header is a row, not a second header.
        ("t,x\nmean,3\n1,2\n3,4\n", ["t", "x"], 3),
        # Names may be numbers where the first of them is a word.
        ("t,1,2\n0.1,5,6\n0.2,7,8\n", ["t", "1", "2"], 2),
        # A line that fits the table by chance stands above the header.
        ("rate,1000\nt,x\n1,2\n3,4\n", ["t", "x"], 2),
        # Empty cells fill the lines above, as a spreadsheet saves them.
        (
            "Devices,,,\n2000,,,\nFrame,a,b,c\n,V,V,V\n1,2,3,4\n2,3,4,5\n",
            ["Frame", "a", "b", "c"],
            2,
        ),
        # Rows that end in a delimiter.
        ("t,x\n1,2,\n3,4,\n", ["t", "x"], 2),
        ("% t x\n  1   2\n  3  4\n", ["t", "x"], 2),
        ("1;2,5\n3;4,5\n", ["column 1", "column 2"], 2),
    ],
)
def test_where_a_table_begins(text: str, names: list[str], rows: int, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text)
    table = SOURCE.read(tmp_path / "a.csv", lambda _name: True).runs[0].tables[0]
    assert list(table.columns) == names
    assert table.rows == rows
