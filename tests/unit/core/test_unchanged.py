"""An input that changes while it is read is refused, whatever the reader makes of the rest."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from armimpedance.__main__ import main
from armimpedance.core.errors import InputError
from armimpedance.core.inputs import inputs_now, unchanged
from armimpedance.core.json_text import read_json
from armimpedance.hand.show import read_results
from armimpedance.recordings import hdf5, open_recording, write_recording
from armimpedance.show.pages import asked as build
from manipulandum_sim.hand import IDEAL, simulate


def append(path: Path) -> None:
    with path.open("ab") as stream:
        stream.write(b"\n")


def cut(path: Path) -> None:
    os.truncate(path, path.stat().st_size // 2)


def replace(path: Path) -> None:
    new = path.with_name("new")
    new.write_bytes(path.read_bytes())
    os.replace(new, path)


def remove(path: Path) -> None:
    path.unlink()


CHANGES = [append, cut, replace, remove]


def grow_old(path: Path) -> None:
    """Let a file have been written to long ago."""
    os.utime(path, ns=(10**18, 10**18))


@pytest.fixture(scope="module")
def recording():
    """A short session of pushes."""
    return simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"], servo=IDEAL)[
        0
    ]


@pytest.mark.parametrize("age", ["old", "fresh"])
@pytest.mark.parametrize("change", CHANGES)
def test_a_file_and_a_file_of_a_folder_that_change_are_refused(tmp_path, change, age):
    for name in ("a", "b"):
        (tmp_path / name).write_text("some numbers")
        if age == "old":
            grow_old(tmp_path / name)
    for place in (tmp_path / "b", tmp_path):
        with pytest.raises(InputError, match="changed while") as told, unchanged(place):
            change(tmp_path / "b")
        assert str(tmp_path / "b") in str(told.value)
        (tmp_path / "b").write_text("some numbers")


def test_a_fresh_file_that_changes_within_one_tick_of_its_clock_is_refused(tmp_path):
    path = tmp_path / "a"
    path.write_text("1")
    written = path.stat().st_mtime_ns

    def write_again() -> None:
        with unchanged(path):
            path.write_text("2")
            os.utime(path, ns=(written, written))

    with pytest.raises(InputError, match="changed"):
        write_again()


def test_the_change_is_told_and_not_what_is_wrong_with_half_a_file(tmp_path):
    (tmp_path / "a").write_text("12")

    def read() -> None:
        with unchanged(tmp_path / "a"):
            cut(tmp_path / "a")
            raise InputError("is damaged", file=tmp_path / "a")

    with pytest.raises(InputError, match="changed"):
        read()


def test_what_was_only_read_touched_or_comes_new_is_no_change(tmp_path):
    (tmp_path / "a").write_text("1")
    before = inputs_now(tmp_path, tmp_path / "nowhere", None)
    (tmp_path / "a").read_text()
    (tmp_path / "a").chmod(0o600)
    (tmp_path / "b").write_text("an output of somebody")
    (tmp_path / ".armimpedance-1").write_text("a temporary")
    before.check()
    with pytest.raises(ZeroDivisionError), unchanged(tmp_path):
        raise ZeroDivisionError


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with unchanged(tmp_path / "pipe"):
        pass


def changed_in(monkeypatch, where: str, change: Callable[[], None]) -> None:
    """Let a function that readers call find the file whole, and change it at its end."""
    home, name = where.rsplit(".", 1)
    module = pytest.importorskip(home) if home != "pathlib.Path" else Path
    real = getattr(module, name)
    done: list[int] = []

    def read_and_change(*words: object, **options: object) -> object:
        found = real(*words, **options)
        if not done:
            done.append(1)
            change()
        return found

    monkeypatch.setattr(module, name, read_and_change)


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize(
    ("table", "reader"),
    [
        ("parquet", "pyarrow.parquet.ParquetFile"),
        ("csv", "armimpedance.recordings.tables.folder.read_samples"),
    ],
)
@pytest.mark.parametrize("name", ["samples", "trials.csv", "recording.json"])
def test_a_recording_that_changes_is_refused(
    recording, tmp_path, monkeypatch, change, table, reader, name
):
    write_recording(recording, tmp_path / "s", table)
    file = tmp_path / "s" / (f"samples.{table}" if name == "samples" else name)
    changed_in(monkeypatch, reader, lambda: change(file))
    with pytest.raises(InputError, match="changed while") as told:
        open_recording(tmp_path / "s")
    assert str(file) in str(told.value)


@pytest.mark.parametrize("change", CHANGES)
def test_results_and_json_that_change_are_refused(recording, tmp_path, monkeypatch, change):
    write_recording(recording, tmp_path / "s")
    out = tmp_path / "hand.csv"
    assert main(["estimate", str(tmp_path / "s"), "--out", str(out)]) == 0
    changed_in(monkeypatch, "pandas.read_csv", lambda: change(out))
    with pytest.raises(InputError, match="changed"):
        read_results(out)
    file = tmp_path / "a.json"
    file.write_text("{}")
    changed_in(monkeypatch, "pathlib.Path.read_text", lambda: change(file))
    with pytest.raises(InputError, match="changed"):
        read_json(file)


@pytest.mark.study
def test_a_report_and_its_sums_are_of_one_recording(recording, tmp_path, monkeypatch, capsys):
    write_recording(recording, tmp_path / "s")
    table = tmp_path / "s" / "trials.csv"
    # After the reading, before the sums on the page: nobody else would see it.
    real = build.made_from
    monkeypatch.setattr(build, "made_from", lambda *w, **o: (append(table), real(*w, **o))[1])
    out = tmp_path / "r.html"
    assert main(["report", str(tmp_path / "s"), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert "changed while" in said
    assert str(table) in said
    assert not out.exists()


def test_a_file_of_hdf5_that_is_cut_does_not_end_the_process(tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    path.write_bytes(b"GCOL\x01" + bytes(100_000))
    real = hdf5._has_empty_part

    def cut_first(*words: object) -> bool:
        os.truncate(path, 0)
        return real(*words)  # type: ignore[arg-type]

    monkeypatch.setattr(hdf5, "_has_empty_part", cut_first)
    hdf5.check_heaps(path, "a file")


@pytest.mark.parametrize("before", [0, 3, 8_000_000 - 3])
def test_a_heap_is_found_across_the_blocks_in_which_a_file_is_read(tmp_path, monkeypatch, before):
    monkeypatch.setattr(hdf5, "_BLOCK", max(before + 2, 7))
    path = tmp_path / "a.h5"
    path.write_bytes(bytes(before) + b"GCOL\x01" + bytes(3) + b"\x40" + bytes(7) + bytes(48))
    with pytest.raises(InputError, match=f"byte {before}"):
        hdf5.check_heaps(path, "a file")
