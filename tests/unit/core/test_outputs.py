"""Outputs appear whole or not at all."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from armimpedance.core import temporaries
from armimpedance.core.errors import InputError
from armimpedance.core.outputs import staged_file, staged_folder


def test_file_appears_with_its_content_and_suffix(tmp_path):
    final = tmp_path / "a.csv"
    with staged_file(final) as temporary:
        assert temporary.suffix == ".csv"
        assert temporary.parent == tmp_path
        temporary.write_text("whole")
        assert not final.exists()
    assert final.read_text() == "whole"
    assert os.listdir(tmp_path) == ["a.csv"]


def test_failure_leaves_the_old_file(tmp_path):
    final = tmp_path / "a.csv"
    final.write_text("old")

    def fail_half_way() -> None:
        with staged_file(final) as temporary:
            temporary.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_half_way()
    assert final.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.csv"]


@pytest.mark.parametrize("stage", [staged_file, staged_folder])
def test_missing_parent_is_refused(tmp_path, stage):
    with pytest.raises(InputError, match="no such folder"), stage(tmp_path / "no" / "a"):
        pass
    assert os.listdir(tmp_path) == []


def test_folder_in_place_of_a_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="regular file"), staged_file(tmp_path):
        pass


def test_folder_failure_leaves_nothing(tmp_path):
    def fail_half_way() -> None:
        with staged_folder(tmp_path / "out") as temporary:
            (temporary / "recording.json").write_text("{")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_half_way()
    assert os.listdir(tmp_path) == []


def test_earlier_output_is_replaced_whole(tmp_path):
    final = tmp_path / "out"
    final.mkdir()
    (final / "recording.json").write_text("old")
    (final / "samples.csv").write_text("old")
    with staged_folder(final) as temporary:
        (temporary / "recording.json").write_text("new")
    assert [p.name for p in final.iterdir()] == ["recording.json"]
    assert (final / "recording.json").read_text() == "new"
    assert os.listdir(tmp_path) == ["out"]


def test_empty_folder_is_replaced(tmp_path):
    (tmp_path / "out").mkdir()
    with staged_folder(tmp_path / "out") as temporary:
        (temporary / "a").write_text("")
    assert os.listdir(tmp_path / "out") == ["a"]


@pytest.mark.parametrize("held", [["thesis.tex"], ["recording.json", "notes.txt"], ["trials.csv"]])
def test_folder_with_other_things_is_not_touched(tmp_path, held):
    for name in held:
        (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match="not an earlier output"), staged_folder(tmp_path):
        pass
    assert sorted(os.listdir(tmp_path)) == sorted(held)


def test_other_marks_of_an_earlier_output(tmp_path):
    (tmp_path / "out" / "figures").mkdir(parents=True)
    (tmp_path / "out" / "report.html").write_text("old")
    with staged_folder(tmp_path / "out", mark="report.html", known=("figures",)) as temporary:
        (temporary / "report.html").write_text("new")
    assert os.listdir(tmp_path / "out") == ["report.html"]


def test_link_to_a_file_is_written_through(tmp_path):
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    with staged_file(tmp_path / "link") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


WRITERS = {
    "file": """
with staged_file(sys.argv[1]) as path, path.open("w") as stream:
    while True:
        stream.write("x" * 100_000)
        stream.flush()
        print("writing", flush=True)
""",
    "folder": """
with staged_folder(sys.argv[1]) as path:
    (path / "recording.json").write_text("{")
    with (path / "samples.csv").open("w") as stream:
        while True:
            stream.write("x" * 100_000)
            stream.flush()
            print("writing", flush=True)
""",
}


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("existing", [False, True])
def test_kill_leaves_no_half_output(tmp_path: Path, kind: str, existing: bool):
    final = tmp_path / "out"
    if existing and kind == "folder":
        final.mkdir()
        (final / "recording.json").write_text("old")
    elif existing:
        final.write_text("old")
    code = "import sys\nfrom armimpedance.core.outputs import *\n" + WRITERS[kind]
    writer = subprocess.Popen([sys.executable, "-c", code, final], stdout=subprocess.PIPE)
    assert writer.stdout is not None
    assert writer.stdout.readline() == b"writing\n"
    writer.send_signal(signal.SIGKILL)
    writer.wait()
    writer.stdout.close()
    if not existing:
        assert not final.exists()
    elif kind == "folder":
        assert [(p.name, p.read_text()) for p in final.iterdir()] == [("recording.json", "old")]
    else:
        assert final.read_text() == "old"
    assert len(os.listdir(tmp_path)) == 1 + existing
    with staged_file(tmp_path / "next") as path:
        path.write_text("")
    assert sorted(os.listdir(tmp_path)) == ["next", *(["out"] if existing else [])]


def gone() -> int:
    """The number of a process that has ended."""
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        return process.pid


def left_by(process: int, folder: Path, ending: str, start: int = 0) -> Path:
    """What this process, started then (0: not known), would leave in a folder."""
    mine = temporaries.temporary_name(folder / "x", ending).name
    return folder / re.sub(rf"-{os.getpid()}-\d+-", f"-{process}-{start}-", mine)


def test_only_what_a_process_that_is_gone_left_is_swept(tmp_path):
    dead, alive = left_by(gone(), tmp_path, ".partial.csv"), left_by(1, tmp_path, ".partial.csv")
    elsewhere = dead.with_name(".armimpedance-00000000" + dead.name[22:])
    others = [alive, elsewhere, tmp_path / ".a.partial", tmp_path / ".armimpedance-notes"]
    for path in (dead, *others):
        path.write_text("")
    temporaries.sweep(tmp_path)
    assert sorted(tmp_path.iterdir()) == sorted(others)


def replaced(final: Path, text: str) -> None:
    with staged_folder(final) as temporary:
        (temporary / "recording.json").write_text(text)


def test_a_folder_is_there_at_every_moment_of_its_replacement(tmp_path):
    final = tmp_path / "out"
    replaced(final, "0")
    code = (
        "import sys\nfrom armimpedance.core.outputs import staged_folder\n"
        "for i in range(100):\n"
        "    with staged_folder(sys.argv[1]) as path:\n"
        "        (path / 'recording.json').write_text(str(i))\n"
    )
    looks = 0
    with subprocess.Popen([sys.executable, "-c", code, final]) as writer:
        while writer.poll() is None:
            assert final.is_dir()
            looks += 1
    assert writer.returncode == 0
    assert looks > 100
    assert os.listdir(tmp_path) == ["out"]


def test_where_names_cannot_be_exchanged_the_folder_is_replaced_too(tmp_path, monkeypatch):
    monkeypatch.setattr(temporaries, "_exchanged", lambda *_: False)
    replaced(tmp_path / "out", "old")
    replaced(tmp_path / "out", "new")
    assert (tmp_path / "out" / "recording.json").read_text() == "new"
    assert os.listdir(tmp_path) == ["out"]


@pytest.mark.parametrize("there", [False, True], ids=["killed before", "killed after"])
def test_a_folder_that_was_put_aside_by_a_killed_process_comes_back(tmp_path, there):
    aside = left_by(gone(), tmp_path, ".old")
    (aside / "out").mkdir(parents=True)
    (aside / "out" / "recording.json").write_text("old")
    if there:
        replaced(tmp_path / "out", "new")
    temporaries.sweep(tmp_path)
    assert os.listdir(tmp_path) == ["out"]
    assert (tmp_path / "out" / "recording.json").read_text() == ("new" if there else "old")


def test_the_longest_name_that_a_disk_takes_is_written(tmp_path):
    for stage in (staged_file, staged_folder):
        final = tmp_path / (stage.__name__.ljust(251, "x") + ".csv")
        with stage(final) as temporary:
            if stage is staged_file:
                temporary.write_text("")
        assert final.exists()


def test_import_is_light():
    code = "import sys, armimpedance.core.outputs; assert 'numpy' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o666])
def test_a_new_output_is_as_open_to_others_as_the_old_one(tmp_path, mode):
    (tmp_path / "a.csv").write_text("old")
    (tmp_path / "a.csv").chmod(mode)
    with staged_file(tmp_path / "a.csv") as path:
        path.write_text("new")
    replaced(tmp_path / "out", "old")
    (tmp_path / "out").chmod(mode | 0o100)
    replaced(tmp_path / "out", "new")
    assert (tmp_path / "a.csv").stat().st_mode & 0o777 == mode
    assert (tmp_path / "out").stat().st_mode & 0o777 == mode | 0o100


@pytest.mark.parametrize("mask", [0o077, 0o000, 0o022])
def test_a_first_output_is_as_open_as_the_mask_says(tmp_path, mask):
    before = os.umask(mask)
    try:
        with staged_file(tmp_path / "a.csv") as path:
            path.write_text("new")
        replaced(tmp_path / "out", "new")
    finally:
        os.umask(before)
    assert (tmp_path / "a.csv").stat().st_mode & 0o777 == 0o666 & ~mask
    assert (tmp_path / "out").stat().st_mode & 0o777 == 0o777 & ~mask


def test_a_write_protected_output_is_not_replaced(tmp_path):
    (tmp_path / "a.csv").write_text("mine")
    (tmp_path / "a.csv").chmod(0o444)
    replaced(tmp_path / "out", "mine")
    (tmp_path / "out").chmod(0o555)
    with pytest.raises(InputError, match="protected"), staged_file(tmp_path / "a.csv"):
        pass
    with pytest.raises(InputError, match="protected"), staged_folder(tmp_path / "out"):
        pass
    (tmp_path / "out").chmod(0o755)
    assert (tmp_path / "a.csv").read_text() == "mine"
    assert (tmp_path / "out" / "recording.json").read_text() == "mine"


def test_a_pipe_a_device_and_a_link_to_itself_are_no_outputs(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to("loop")
    for name in (tmp_path / "pipe", tmp_path / "loop", os.devnull):
        with pytest.raises(InputError), staged_file(name):
            pass


def test_a_process_is_told_from_a_later_one_of_its_number(tmp_path):
    mine = temporaries.temporary_name(tmp_path / "x", ".partial")
    other = left_by(os.getpid(), tmp_path, ".partial", start=1)
    for path in (mine, other):
        path.write_text("")
    temporaries.sweep(tmp_path)
    knows = Path("/proc/self/stat").exists()
    assert sorted(tmp_path.iterdir()) == sorted([mine] if knows else [mine, other])


def test_a_process_that_was_killed_and_not_asked_after_is_gone(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    start = temporaries._start(process.pid) or 0
    left = left_by(process.pid, tmp_path, ".partial", start)
    left.write_text("")
    temporaries.sweep(tmp_path)
    assert left.exists()
    process.kill()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    temporaries.sweep(tmp_path)
    assert not left.exists() or not start
    process.communicate()


def test_another_container_is_another_machine(tmp_path, monkeypatch):
    monkeypatch.setattr(temporaries, "_host", lambda: "0123abcd")
    left = left_by(gone(), tmp_path, ".partial")
    left.write_text("")
    monkeypatch.undo()
    temporaries.sweep(tmp_path)
    assert left.exists()


def test_a_folder_that_cannot_be_listed_or_flushed_can_be_written_into(tmp_path, monkeypatch):
    listing, opening = os.scandir, os.open

    def refuse(path, *words, **options):
        if Path(path) == tmp_path:
            raise PermissionError(13, "Permission denied", str(path))
        return (listing if not words else opening)(path, *words, **options)

    monkeypatch.setattr(os, "scandir", refuse)
    monkeypatch.setattr(os, "open", refuse)
    with staged_file(tmp_path / "a") as path:
        path.write_text("whole")
    monkeypatch.undo()
    assert (tmp_path / "a").read_text() == "whole"


def test_a_file_that_somebody_puts_into_the_old_folder_meanwhile_is_kept(tmp_path, monkeypatch):
    replaced(tmp_path / "out", "old")
    real = temporaries._exchanged

    def late(temporary, final):
        if not (final / "notes.txt").exists() and not (temporary / "notes.txt").exists():
            (final / "notes.txt").write_text("mine")
        return real(temporary, final)

    monkeypatch.setattr(temporaries, "_exchanged", late)
    with pytest.raises(InputError, match="not an earlier output"):
        replaced(tmp_path / "out", "new")
    assert (tmp_path / "out" / "notes.txt").read_text() == "mine"
    assert os.listdir(tmp_path) == ["out"]


def test_a_full_disk_names_the_output_and_not_its_temporary(tmp_path):
    import errno

    def full(name: str | None) -> None:
        with staged_file(tmp_path / "a.csv") as path:
            raise OSError(errno.ENOSPC, "No space left", str(path) if name else None)

    for name in ("temporary", None):
        with pytest.raises(OSError, match="No space") as told:
            full(name)
        assert told.value.filename == str(tmp_path / "a.csv")
