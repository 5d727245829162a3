"""A disk without space under every form of output: one line, status 1, no file, and no false word.

The system is asked to refuse every file beyond a few bytes, whichever library writes it, or the
flush at the end of one, as a disk does that notices late.
"""

from __future__ import annotations

import errno
import gc
import os
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from sessions import pushes

from armimpedance.__main__ import main
from armimpedance.app.study import (
    Processes,
    find_sessions,
    read_design,
    run_participants,
)
from armimpedance.app.study.store import Fingerprints, StepResult, Store
from armimpedance.lab.benchmark import Key
from armimpedance.recordings import write_recording
from armimpedance.show.files import table_content, write_content
from armimpedance.show.files.endings import ENDINGS
from armimpedance.show.plots.style import new_axes, save

resource = pytest.importorskip("resource", reason="this system limits no sizes of files")

#: Bytes of a file, from which on it is refused.
ROOM = 64


@contextmanager
def no_room():
    """Every file is refused in the midst of being written."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    with pytest.MonkeyPatch.context() as patched:
        # Python keeps bytecode that was cut short, and every later import of it fails
        patched.setattr(sys, "dont_write_bytecode", True)
        patched.setenv("PYTHONDONTWRITEBYTECODE", "1")
        resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, before[1]))
        try:
            yield os.strerror(errno.EFBIG)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)


@contextmanager
def no_room_at_the_end():
    """Every file is refused when it is flushed."""
    said = os.strerror(errno.ENOSPC)

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, said)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(os, "fsync", full)
        yield said


DISKS = {"in the midst": no_room, "at the end": no_room_at_the_end}


@pytest.fixture
def complaints(monkeypatch):
    """What the interpreter would print of objects that cannot be tidied up."""
    found: list[str] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda what: found.append(repr(what.exc_value)))
    # what all tests before have made is not looked through again: only this one's is collected
    gc.freeze()
    yield found
    gc.unfreeze()


def still_open(folder: Path) -> list[str]:
    """Files of a folder that this process holds open: what waits for them cannot be written."""
    held = Path("/proc/self/fd")
    if not held.exists():
        return []
    files = (os.path.realpath(each) for each in held.iterdir())
    return [file for file in files if file.startswith(str(folder))]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A short session of pushes on the disk, and its results."""
    recording = pushes(1, ("cocontraction_10",))
    folder = tmp_path_factory.mktemp("full")
    write_recording(recording, folder / "session")
    assert main(["estimate", str(folder / "session"), "--out", str(folder / "hand.csv")]) == 0
    return folder


@pytest.mark.parametrize("disk", DISKS)
@pytest.mark.parametrize("ending", [*ENDINGS, "long csv", "long json", "long parquet"])
def test_a_table_of_any_format_is_there_whole_or_not_at_all(
    tmp_path, monkeypatch, complaints, disk, ending
):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    rows = [{"time_s": 0.1 * n, "K_xx_N_m": 100.0 + n} for n in range(50)]
    content = table_content(rows, keys=["time_s"])
    long, _, name = ending.rpartition(" ")
    out = tmp_path / f"out.{name}"
    with DISKS[disk]() as why:
        with pytest.raises(OSError, match=why) as told:
            write_content(content, out, long=bool(long))
        assert str(told.value.filename) == str(out)
        del told
        gc.collect()
    assert complaints == []
    assert still_open(tmp_path) == []
    assert os.listdir(tmp_path) == ["temporary"]
    assert os.listdir(temporary) == []
    write_content(content, out, long=bool(long))
    assert out.stat().st_size > ROOM


CALLS = (
    "estimate session --out {out}.csv",
    "estimate session --out {out}.xlsx",
    "estimate session --figure {out}.png",
    "estimate session --figure {out}.svg",
    "estimate session --figure {out}.pdf",
    "inspect session --out {out}.json",
    "report session --out {out}.html",
    "explore hand.csv --out {out}.html",
    "trials session --out {out}.html",
    "convert session {out}",
    "convert session {out} --table csv",
    "share session --as bids --out {out}",
    "share session --as datasheet --out {out}.md",
    "share session hand.csv --as json-ld --out {out}.jsonld",
    "map-columns hand.csv --out {out}.toml",
    "plan --design --duration-s 0.25 --max-acceleration 4 --out-profile {out}.csv",
    "simulate cocontraction --sets 1 --out {out}",
    "simulate cocontraction --sets 1 --as kinarm --out {out}",
    "new --for custom {out}",
)
#: Take a second or more.
SLOW = ("simulate", "new", "plan", "trials", "share session --as bids", "explore", "report")
#: The same figure in other formats: a small one is saved in each below.
SLOW += ("estimate session --figure {out}.svg", "estimate session --figure {out}.pdf")


@pytest.mark.parametrize(
    "call",
    [pytest.param(c, marks=[pytest.mark.study] if c.startswith(SLOW) else []) for c in CALLS],
)
def test_a_command_says_it_in_one_line_and_nothing_else(
    session, tmp_path, monkeypatch, capsys, complaints, call
):
    monkeypatch.chdir(session)
    words = call.format(out=tmp_path / "out").split()
    with no_room() as why:
        status = main(words)
        gc.collect()
    told = capsys.readouterr()
    assert status == 1
    assert told.out == ""
    [line] = told.err.splitlines()
    assert why in line
    assert str(tmp_path / "out") in line
    assert complaints == []
    assert still_open(tmp_path) == []
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_a_figure_of_any_format_is_not_there_by_half(tmp_path, complaints, ending):
    with no_room() as why:
        with pytest.raises(OSError, match=why) as told:
            save(new_axes().figure, tmp_path / "out", [ending])
        assert str(told.value.filename) == str(tmp_path / f"out.{ending}")
        del told
        gc.collect()
    assert complaints == []
    assert still_open(tmp_path) == []
    assert os.listdir(tmp_path) == []


def test_a_key_that_was_not_written_is_not_there(tmp_path):
    with no_room() as why, pytest.raises(OSError, match=why) as told:
        Key.drawn(tmp_path / "key")
    assert str(told.value.filename) == str(tmp_path / "key")
    assert os.listdir(tmp_path) == []


# A study.


def double(words: list[str]) -> int:
    """A command: twice the number in a file; on some numbers its disk is full."""
    number = int(Path(words[1]).read_text())
    if number == 66 and not Path(words[1]).with_name("room").exists():
        sys.stderr.write(f"armimpedance double: twice.csv: {os.strerror(errno.ENOSPC)}\n")
        return 1
    Path(words[3]).write_text(f"value\n{2 * number}\n")
    return 0


def people(folder: Path, numbers: list[int]) -> Path:
    data = folder / "data"
    for place, number in enumerate(numbers):
        (data / f"sub-{place}").mkdir(parents=True)
        (data / f"sub-{place}" / "x.rec").write_text(str(number))
    (data / "study.toml").write_text('steps = ["double {recording} --out twice.csv"]')
    return data


def done(data: Path, out: Path, engine: object = map) -> list[tuple[str, int]]:
    """State of each session, and how many of its steps were run."""
    sessions = find_sessions(data, None, lambda path: path.suffix == ".rec")
    ended = run_participants(sessions, read_design(None, data), out, double, engine)
    return [(one.outcome.state, one.outcome.recomputed) for one in ended]


@pytest.mark.parametrize("at", ["keep", "work"])
def test_a_study_ends_when_its_disk_is_full_and_goes_on_when_there_is_space(
    tmp_path, monkeypatch, at
):
    data, out = people(tmp_path, [1, 2, 66 if at == "work" else 3, 4]), tmp_path / "out"
    put = Store.put

    def full(store: Store, key: str, result: StepResult, work: Path) -> None:
        if (work / "twice.csv").read_text() == "value\n6\n":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        put(store, key, result, work)

    monkeypatch.setattr(Store, "put", full)
    with pytest.raises(OSError, match="what was done is kept") as told:
        done(data, out)
    assert told.value.errno == errno.ENOSPC
    assert told.value.filename
    monkeypatch.undo()
    (data / "sub-2" / "room").touch()
    assert done(data, out) == [("done", 0), ("done", 0), ("done", 1), ("done", 1)]
    assert [p for p in out.rglob("*") if "partial" in p.name] == []


@pytest.mark.study
def test_a_worker_of_a_study_tells_of_its_full_disk(tmp_path):
    data = people(tmp_path, [1, 66, 3])
    with pytest.raises(OSError, match="what was done is kept"):
        done(data, tmp_path / "out", Processes(2))
    (data / "sub-1" / "room").touch()
    assert {state for state, _ in done(data, tmp_path / "out", Processes(2))} == {"done"}


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_a_study_whose_log_finds_no_space_says_so_and_goes_on_later(session, tmp_path, capsys):
    person = tmp_path / "data" / "sub-1"
    person.mkdir(parents=True)
    (person / "session").symlink_to(session / "session")
    (tmp_path / "data" / "study.toml").write_text('steps = ["inspect {recording} --out c.csv"]')
    out = tmp_path / "out"
    out.mkdir()
    (out / ".store").mkdir()
    (out / "study.log").symlink_to("/dev/full")
    call = ["study", str(tmp_path / "data"), str(out), "participant", "--workers", "1"]
    assert main(call) == 1
    told = capsys.readouterr()
    assert told.out == ""
    [line] = told.err.splitlines()
    assert os.strerror(errno.ENOSPC) in line
    assert "study.log" in line
    (out / "study.log").unlink()
    assert main(call) == 0
    assert "1 done, 0 failed" in capsys.readouterr().out


def test_a_study_may_work_on_one_disk_and_keep_on_another(tmp_path, monkeypatch):
    work = tmp_path / "work"
    work.mkdir()
    (work / "a.csv").write_text("1")
    prints = Fingerprints()
    store, rename = Store(tmp_path / "store", prints), os.rename

    def across(source, final, **more):
        if Path(source).is_relative_to(work):
            raise OSError(errno.EXDEV, os.strerror(errno.EXDEV))
        rename(source, final, **more)

    monkeypatch.setattr(os, "rename", across)
    monkeypatch.setattr(os, "replace", across)
    store.put("ab12", StepResult(0, "", "", {"a.csv": prints.of(work / "a.csv")}), work)
    assert store.get("ab12") is not None
    assert not (work / "a.csv").exists()
