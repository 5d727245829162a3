"""Laws of all doors: any bytes are read or refused in one line, what was written is read again."""

from __future__ import annotations

from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import replace
from functools import cache
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import example, given, settings, strategies as st

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.core.errors import LONGEST_MESSAGE, ArmImpedanceError, InputError
from armimpedance.core.json_text import json_text, read_json
from armimpedance.hand.show import read_results, write_results
from armimpedance.recordings import read_skeleton, write_recording
from armimpedance.show.files import read_left_out
from manipulandum_sim.hand import IDEAL, simulate

#: How files of the known formats begin.
BEGINNINGS = (
    b"", b"PAR1", b"PK\x03\x04", b"\x02\x50", b"MATLAB 5.0 MAT-file", b"\x89HDF\r\n\x1a\n", b"TDSm",
    b"#ROSBAG V2.0\n", b"\x89MCAP0\r\n", b"SQLite format 3\x00", b"PathFileType\t4\t(X/Y/Z)\ta\n",
    b"{", b"[" * 5000, b"time,x,y,fx,fy\n", b"trial,why\n", b"condition,level,K_11\n", b"\xff\xfe",
    b'{"a": 1, "a": 2}', b'{"a": "\\ud800"}', b"name=a\nendheader\ntime\ta\n",
)  # fmt: skip
NAMES = (
    "a.csv", "a.tsv", "a.parquet", "a.mat", "a.c3d", "a.zip", "a.kinarm", "a.nwb", "a.tdms",
    "a.bag", "a.mcap", "a.db3", "a.trc", "a.mot", "a.sto", "a.lvm",
)  # fmt: skip
OTHERS = {
    "r.csv": read_results,
    "m.json": ai.read_model,
    "s.json": read_skeleton,
    "left.csv": read_left_out,
}
content = st.builds(bytes.__add__, st.sampled_from(BEGINNINGS), st.binary(max_size=300))
#: Any text of a table's cell, of any alphabet; a lone surrogate is no text of a file.
names = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=60)


def opened(read, place: Path) -> None:
    """Read, or be refused in one printable line that names the file."""
    try:
        read(place)
    except ArmImpedanceError as error:
        text = str(error)
        assert text.isprintable()
        assert len(text) <= LONGEST_MESSAGE
        assert place.name in text


@pytest.mark.parametrize("name", [*NAMES, *OTHERS])
@pytest.mark.filterwarnings("error")
@settings(max_examples=15)
@given(data=content)
def test_any_bytes_are_read_or_refused_in_one_line(name, data):
    with TemporaryDirectory() as folder:
        place = Path(folder) / name
        place.write_bytes(data)
        opened(OTHERS.get(name, ai.read), place)


@cache
def pushes():
    recording, _ = simulate(
        "cocontraction", seed=1, sets=1, conditions=["cocontraction_10"], servo=IDEAL
    )
    return replace(recording, provenance=(), emg=None, muscles=())


@settings(max_examples=2)
@given(condition=names)
@example("条件 ١")
@example("rest\u3000")
@example("=1+1")
@example("NA")
@example("1e5")
def test_a_condition_of_any_name_is_read_as_it_was_written(condition):
    short = pushes().select([0])
    recording = replace(short, trials=short.trials.assign(condition=condition))
    with TemporaryDirectory() as folder:
        write_recording(recording, Path(folder) / "r")
        again = ai.read(Path(folder) / "r")
    assert str(again.trials["condition"].iloc[0]).strip() == condition.strip()


@cache
def estimate():
    return ai.estimate(pushes())[0]


@settings(max_examples=10)
@given(condition=names)
@example('"')
def test_results_of_any_name_are_read_as_they_were_written(condition):
    named = replace(estimate(), keys={"condition": condition})
    with TemporaryDirectory() as folder:
        write_results([named], Path(folder) / "r.csv")
        (again,) = read_results(Path(folder) / "r.csv")
    assert again.keys["condition"] == condition
    assert (again.stiffness == named.stiffness).all()


@settings(max_examples=40)
@given(
    content=st.dictionaries(
        names, st.one_of(st.floats(allow_nan=False, allow_infinity=False), names, st.none())
    )
)
def test_json_is_read_as_it_was_written(content):
    with TemporaryDirectory() as folder:
        file = Path(folder) / "a.json"
        file.write_text(json_text(content), encoding="utf-8")
        assert read_json(file) == content


@settings(max_examples=12)
@given(words=st.lists(st.text(max_size=500), min_size=1, max_size=4))
@example(["estimate", "9" * 5000, "--method", "x" * 2000])
@example(["estimate", "a\x00b", "--covariance", "9" * 5000])
def test_any_call_is_refused_in_one_line(words):
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err), suppress(SystemExit):
        assert main(["inspect", *words]) == 2
    lines = err.getvalue().splitlines()
    if out.getvalue():  # a word that asks for help, or cuts one that does
        return
    assert len(lines) == 1
    assert lines[0].isprintable()
    assert len(lines[0]) <= LONGEST_MESSAGE + len("armimpedance inspect: ")


def test_names_that_look_alike_make_one_group_and_that_is_said():
    recording = pushes()
    condition = ["rest ", *["rest"] * (recording.n_trials - 2), "re\u0301st"]
    accents = ["rést", "re\u0301st"] * (recording.n_trials // 2)
    with TemporaryDirectory() as folder:
        for column, wanted in ((condition, {"rest", "re\u0301st"}), (accents, {"rést"})):
            place = Path(folder) / str(len(wanted))
            write_recording(
                replace(recording, trials=recording.trials.assign(condition=column)), place
            )
            again = ai.read(place)
            assert set(again.trials["condition"]) == wanted
            assert "look alike" in again.provenance[-1]
            assert any(finding.name == "names" for finding in again.findings)


@pytest.mark.parametrize("value", ["text", float("inf"), 1e300])
def test_a_level_that_is_no_number_is_refused_by_its_column(value):
    recording = pushes()
    column = "mvc_biceps_V"
    with pytest.raises(InputError, match=column):
        replace(recording, trials=recording.trials.assign(**{column: value}))
