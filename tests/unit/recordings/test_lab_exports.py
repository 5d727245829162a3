"""Exports with one quirk each come back as they were, after the one answer that no file gives."""

from __future__ import annotations

from pathlib import Path

import export_quirks as quirks
import numpy as np
import pytest
import scipy.io

import armimpedance as ai
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.recordings import propose_mapping

ALL = {**quirks.ENDS, **quirks.NUMBERS, **quirks.HEADERS, **quirks.CLOCKS, **quirks.TICKS}


@pytest.fixture(scope="module")
def session(truth: Recording) -> Recording:
    """The first 650 samples of each of the eight trials: the push is in them."""
    rows = np.concatenate([first + np.arange(650) for first in truth.offsets[:-1]])
    return Recording(
        kind="hand",
        sample_rate_hz=truth.sample_rate_hz,
        trials=truth.trials[["trial", "condition", "onset_s"]],
        offsets=np.arange(truth.n_trials + 1) * 650,
        time_s=truth.time_s[rows],
        position=truth.position[rows],
        force=truth.force[rows],
    )


def proposed(text: str, folder: Path) -> Path:
    """The file with its proposed mapping beside it, and the one answer that is always asked."""
    file = folder / "export.csv"
    file.write_text(text, encoding="utf-8")
    mapping = propose_mapping(file)
    mapping.place.write_text(mapping.text.replace('# by = "limb"', 'by = "limb"'), "utf-8")
    return file


@pytest.mark.parametrize("name", ALL)
def test_a_proposal_and_one_answer_give_the_samples_back(
    name: str, session: Recording, tmp_path: Path
) -> None:
    quirk = ALL[name]
    file = proposed(quirk.write(quirks.table_of(session)), tmp_path)
    read = ai.read(file)
    assert isinstance(read, Recording)
    last = session.n_trials if quirk.trials else 1
    assert read.n_trials == last
    assert read.offsets.tolist() == session.offsets[: last + 1].tolist()
    own = session.position[: session.offsets[last]]
    corner = np.round(np.mean(read.position - own, axis=0))  # a table may count from its corner
    np.testing.assert_allclose(read.position - corner, own, rtol=0, atol=quirk.metres)
    np.testing.assert_allclose(read.force, session.force[: len(own)], rtol=0, atol=quirk.newtons)
    # a stamp may be late by .15 ms at either end of .65 s
    uneven = name in quirks.CLOCKS
    assert read.sample_rate_hz == pytest.approx(1000.0, rel=1e-3 if uneven else 2e-4)
    if name in quirks.ENDS:
        assert any("Padding" in step for step in read.provenance)
    if uneven:
        # the motion says whether the samples or their stamps are uneven
        [said] = [step for step in read.provenance if "scatter" in step]
        assert ("interpolated" in said) == (name == "polled samples")
        with pytest.raises(InputError, match="column time"):
            ai.read(file, strict=True)


def test_what_is_below_the_rows_is_said_where_it_is_words_and_named_where_it_is_numbers(
    session: Recording, tmp_path: Path
) -> None:
    text = quirks.plain(quirks.table_of(session))
    read = ai.read(proposed(text + "End of file\n", tmp_path))
    assert any("left out" in step for step in read.provenance)
    last = text.count("\n") + 1
    with pytest.raises(InputError, match=f"row {last}"):
        ai.read(proposed(text + "mean,,0.1,0.2,0.3,0.4\n", tmp_path))


def test_a_bad_cell_below_a_second_header_is_named_by_its_line(
    session: Recording, tmp_path: Path
) -> None:
    quirk = quirks.HEADERS["the header again above each trial"]
    lines = quirk.write(quirks.table_of(session)).splitlines()
    lines[1499] = lines[1499].rpartition(",")[0] + ",oops"
    with pytest.raises(InputError, match=r"row 1500.*oops"):
        ai.read(proposed("\n".join(lines) + "\n", tmp_path))


@pytest.mark.parametrize("lost", [400, 499])
def test_samples_that_were_lost_where_a_counter_is_full_are_a_gap(
    lost: int, session: Recording, tmp_path: Path
) -> None:
    full = quirks.TICKS["16 bits of milliseconds, full in a trial"].write(quirks.table_of(session))
    lines = full.splitlines()
    with pytest.raises(InputError, match="a gap|run forward"):
        ai.read(proposed("\n".join(lines[:lost] + lines[lost + 4 :]) + "\n", tmp_path))


def test_a_sample_that_was_lost_is_no_scatter(session: Recording, tmp_path: Path) -> None:
    table = quirks.table_of(session)
    text = quirks.CLOCKS["stamps of a network"].write(table.drop(index=range(300, 303)))
    with pytest.raises(InputError, match="a gap"):
        ai.read(proposed(text, tmp_path))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("column", ["time [s]", "x [m]"])
@pytest.mark.parametrize("value", [np.inf, 1e308])
def test_what_is_no_number_of_a_measurement_is_refused_without_a_warning(
    column: str, value: float, session: Recording, tmp_path: Path
) -> None:
    table = quirks.table_of(session)
    file = proposed(quirks.plain(table), tmp_path)
    column = next(name for name in table if name.split()[0] == column.split()[0])
    table.loc[[300, 301, 302], column] = [value, value, -value]
    file.write_text(quirks.plain(table), encoding="utf-8")
    with pytest.raises(InputError):
        ai.read(file)


def test_a_hand_that_rests_at_zero_is_no_padding(session: Recording, tmp_path: Path) -> None:
    table = quirks.table_of(session)
    place = table[["x [m]", "y [m]"]]
    start = place.groupby(table["trial"]).transform("first")
    moved = place - start
    moved[moved.abs() < 1e-4] = 0.0
    rest = (moved == 0).all(axis=1)
    table[["x [m]", "y [m]"]] = moved
    table.loc[rest, ["Fx [N]", "Fy [N]"]] = 0.0
    read = ai.read(proposed(quirks.plain(table), tmp_path))
    assert read.offsets.tolist() == session.offsets.tolist()


def test_a_trial_that_ends_elsewhere_is_named(session: Recording) -> None:
    from dataclasses import replace

    place = session.position.copy()
    place[session.offsets[3] - 1] += 0.4
    trials = session.trials.drop(columns=["onset_s", "end_s"], errors="ignore")
    with pytest.raises(InputError, match=r"trial 3.*rest"):
        ai.estimate(replace(session, position=place, trials=trials))


@pytest.mark.parametrize(("word", "unit"), [("yes", "deg"), ("no", "rad")])
def test_angles_are_in_what_the_header_says(word: str, unit: str, tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    angle, torque = np.cumsum(random.normal(0, 0.01, (2, 300)), axis=1)
    rows = (
        f"{i / 100},{a:.5f},{0.1 * a:.4f},{t:.4f}\n"
        for i, (a, t) in enumerate(zip(angle, torque, strict=True))
    )
    head = f"Coordinates\nversion=1\ninDegrees={word}\nendheader\n"
    names = "time,elbow_angle,pelvis_tx,elbow_torque [N m]\n"
    (tmp_path / "joint.csv").write_text(head + names + "".join(rows))
    said = propose_mapping(tmp_path / "joint.csv").found
    assert any(f"elbow_angle in {unit} (stated by the file)" in line for line in said)


@pytest.mark.parametrize(("order", "fill"), quirks.ARRAYS)
def test_the_axis_of_samples_is_told_by_how_smooth_the_motion_is_along_it(
    order: str, fill: float, session: Recording, tmp_path: Path
) -> None:
    file = tmp_path / "export.mat"
    scipy.io.savemat(file, quirks.arrays(session, order, fill))
    mapping = propose_mapping(file)
    answered = mapping.text.replace('# by = "limb"', 'by = "limb"').replace('"?"', '"N"')
    mapping.place.write_text(answered, encoding="utf-8")
    read = ai.read(file)
    assert isinstance(read, Recording)
    assert read.offsets.tolist() == session.offsets.tolist()
    np.testing.assert_array_equal(read.position, session.position)
    np.testing.assert_array_equal(read.force, session.force)


@pytest.mark.parametrize("turned", [False, True])
def test_channels_of_a_matrix_are_what_their_labels_and_units_say(
    turned: bool, session: Recording, tmp_path: Path
) -> None:
    """BIOPAC's `.mat`: a matrix, its channels' names and units beside it, the step as `isi`."""
    trial = np.repeat(session.trials["trial"], np.diff(session.offsets))
    matrix = np.column_stack([session.force, trial, 1000 * session.position])
    content = {
        "data": matrix.T if turned else matrix,
        "labels": np.array(["Cell X", "Cell Y", "Trial", "Hand X", "Hand Y"]),
        "units": np.array(["N", "N", "-", "mm", "mm"]),
        "isi": 1.0,
        "isi_units": "ms",
    }
    scipy.io.savemat(tmp_path / "export.mat", content)
    mapping = propose_mapping(tmp_path / "export.mat")
    assert "# Hand X, Hand Y" in mapping.text
    mapping.place.write_text(mapping.text.replace('# by = "limb"', 'by = "limb"'), "utf-8")
    read = ai.read(tmp_path / "export.mat")
    assert isinstance(read, Recording)
    assert read.sample_rate_hz == 1000.0
    assert read.offsets.tolist() == session.offsets.tolist()
    np.testing.assert_allclose(read.position, session.position, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(read.force, session.force)


def test_labels_that_are_too_few_or_twice_there_say_nothing(tmp_path: Path) -> None:
    matrix = np.random.default_rng(1).normal(size=(500, 4))
    for labels in (["Hand X", "Hand Y", "Fx"], ["Hand X", "Hand X", "Fx", "Fy"]):
        scipy.io.savemat(tmp_path / "export.mat", {"data": matrix, "labels": np.array(labels)})
        assert 'kind = "?"' in propose_mapping(tmp_path / "export.mat").text


@pytest.mark.parametrize("program", ["labchart", "spike2"])
def test_recorders_of_channels_export_rates_and_units_of_their_own(
    program: str, session: Recording, tmp_path: Path
) -> None:
    file = tmp_path / "export.mat"
    scipy.io.savemat(file, getattr(quirks, program)(session))
    mapping = propose_mapping(file)
    assert '"?"' not in mapping.text
    assert '"EMG biceps"' in mapping.text
    mapping.place.write_text(mapping.text.replace('# by = "limb"', 'by = "limb"'), "utf-8")
    read = ai.read(file)
    assert isinstance(read, Recording)
    assert any("V1_Ch31" in step for step in read.provenance) == (program == "spike2")
    last = session.offsets[read.n_trials]
    assert read.n_trials == (session.n_trials if program == "labchart" else 1)
    assert read.offsets.tolist() == session.offsets[: read.n_trials + 1].tolist()
    np.testing.assert_array_equal(read.position, session.position[:last])
    np.testing.assert_array_equal(read.force, session.force[:last])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("dataend", 1e9),
        ("samplerate", np.nan),
        ("samplerate", -1.0),
        ("datastart", 5e8),
        ("dataend", np.nan),
        ("dataend", np.inf),
        ("unittextmap", 77.0),
        ("unittextmap", np.nan),
    ],
)
def test_what_a_recorder_says_of_its_channels_is_held_against_the_samples(
    name: str, value: float, session: Recording, tmp_path: Path
) -> None:
    content = quirks.labchart(session)
    content[name][0, 2] = value
    scipy.io.savemat(tmp_path / "export.mat", content)
    if name == "unittextmap":  # a unit that is not there is none
        assert '"Hand X"' in propose_mapping(tmp_path / "export.mat").text
        return
    with pytest.raises(InputError, match=r"export.mat.*Hand X"):
        propose_mapping(tmp_path / "export.mat")


def test_a_trial_that_is_not_wanted_stops_nothing(session: Recording, tmp_path: Path) -> None:
    """Samples of trial 3 are missing; whoever leaves it out reads the others with their numbers."""
    table = quirks.table_of(session)
    at = table.index[table["trial"] == 3][100:110]
    table.loc[at, "x [m]"] = np.nan
    file = proposed(quirks.plain(table), tmp_path)
    with pytest.raises(InputError, match="row"):
        ai.read(file)
    read = ai.read(file, where="trial != 3 and trial < 7")
    assert isinstance(read, Recording)
    assert read.trials["trial"].tolist() == [1, 2, 4, 5, 6]
    assert any("5 of 8" in step for step in read.provenance)
    np.testing.assert_array_equal(
        read.position[: session.offsets[2]], session.position[: session.offsets[2]].round(7)
    )
    with pytest.raises(InputError, match="no trial is left"):
        ai.read(file, where="trial > 99")


def test_structs_beside_other_arrays_are_no_recorders_channels(
    session: Recording, tmp_path: Path
) -> None:
    content = {**quirks.spike2(session), "pos": session.position, "force": session.force}
    scipy.io.savemat(tmp_path / "export.mat", content)
    assert '"pos(:,1)"' in propose_mapping(tmp_path / "export.mat").text


@pytest.mark.parametrize("decimal", [".", ","])
def test_a_row_that_was_cut_off_is_no_remark(
    decimal: str, session: Recording, tmp_path: Path
) -> None:
    """Its numbers are numbers with any minus and any decimal mark."""
    text = quirks.plain(quirks.table_of(session), sep=";", decimal=decimal)
    last = f"\u22120{decimal}25;\u22120{decimal}5\n"
    with pytest.raises(InputError, match=f"row {text.count(chr(10)) + 1}"):
        ai.read(proposed(text.replace("-", "\u2212") + last, tmp_path))


def test_a_header_within_another_line_is_no_second_header(
    session: Recording, tmp_path: Path
) -> None:
    text = quirks.plain(quirks.table_of(session))
    lines = text.splitlines()
    lines.insert(1500, lines[0] + ",again")
    with pytest.raises(InputError, match="row 1501"):
        ai.read(proposed("\n".join(lines) + "\n", tmp_path))
