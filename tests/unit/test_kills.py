"""Outputs under kills and errors at every step of their writing, and under two writers at once.

`benchmarks/faults` does the same to whole commands, at every system call of every library.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

#: Runs in a process of its own: children that write, and of which one step ends badly. Steps are
#: what Python tells its audit hooks, and flushes.
CHILDREN = """
import errno, json, os, shutil, signal, sys
from pathlib import Path
from armimpedance.core import temporaries
from armimpedance.core.outputs import staged_file, staged_folder

place, kind, old, error, can_exchange = Path(sys.argv[1]), *json.loads(sys.argv[2])
if not can_exchange:
    temporaries._exchanged = lambda *_: False
OUT = place / ("out.csv" if kind == "file" else "out")
STEPS = {"os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.chmod", "ctypes.dlsym"}

def fresh():
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    if old and kind == "file":
        OUT.write_text("old")
        OUT.chmod(0o600)
    elif old:
        OUT.mkdir(0o700)
        (OUT / "recording.json").write_text("old")

def write():
    if kind == "file":
        with staged_file(OUT) as path:
            path.write_text("new")
    else:
        with staged_folder(OUT) as path:
            (path / "recording.json").write_text("new")
            (path / "samples.csv").write_text("new")

def state():
    if not OUT.exists():
        return "nothing"
    if kind == "file":
        return OUT.read_text()
    held = {path.name: path.read_text() for path in OUT.iterdir()}
    return {"old": "old", "newnew": "new"}.get("".join(held.values()), str(held))

def child(at, count):
    steps = 0
    def step():
        nonlocal steps
        steps += 1
        if steps - 1 == at:
            if not error:
                os.kill(os.getpid(), signal.SIGKILL)
            raise OSError(error, os.strerror(error))
    def hook(event, words):
        if event in STEPS or (event == "open" and words[2] & (os.O_WRONLY | os.O_CREAT)):
            step()
    flush = os.fsync
    def fsync(handle):
        step()
        flush(handle)
    temporaries._start(os.getpid())
    os.fsync = fsync
    sys.addaudithook(hook)
    status = 0
    try:
        write()
    except OSError as error_of_the_disk:
        status = 3 if error_of_the_disk.filename else 4
    if count:
        at = None
        os.write(count, str(steps).encode())
    os._exit(status)

def ended(at=None, count=0):
    number = os.fork()
    if not number:
        child(at, count)
    return os.waitstatus_to_exitcode(os.waitpid(number, 0)[1])

read, write_end = os.pipe()
fresh()
assert ended(count=write_end) == 0 and state() == "new"
total = int(os.read(read, 20))
found = []
for at in range(total):
    fresh()
    status = ended(at)
    after = state()
    with staged_file(place / "next") as path:
        path.write_text("")
    left = [p.name for p in place.iterdir() if p.name not in ("next", OUT.name)]
    found.append([status, after, state(), left])
print(json.dumps(found))
"""


def faults(place: Path, kind: str, old: bool, error: int, can_exchange: bool) -> list:
    """For each step: the status, the output found, the output after the next run, what is left."""
    call = [sys.executable, "-c", CHILDREN, place, json.dumps([kind, old, error, can_exchange])]
    done = subprocess.run(list(map(str, call)), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("can_exchange", [True, False], ids=["exchange", "put aside"])
@pytest.mark.parametrize("old", [False, True], ids=["over nothing", "over an old one"])
@pytest.mark.parametrize("kind", ["file", "folder"])
def test_a_kill_at_any_step_leaves_the_old_or_the_new_and_the_next_run_sweeps(
    tmp_path, kind, old, can_exchange
):
    found = faults(tmp_path / "x", kind, old, 0, can_exchange)
    assert len(found) >= 4
    before = "old" if old else "nothing"
    for status, at_once, after, left in found:
        assert status == -9
        # Where names cannot be exchanged there is a moment without the folder: it comes back.
        absent = kind == "folder" and not can_exchange
        assert at_once in ({before, "new", "nothing"} if absent else {before, "new"})
        assert after in {before, "new"}
        assert left == []
    assert {after for _, _, after, _ in found} >= {before}


@pytest.mark.first_cases(4)
@pytest.mark.parametrize("old", [False, True], ids=["over nothing", "over an old one"])
@pytest.mark.parametrize("kind", ["file", "folder"])
@pytest.mark.parametrize("error", ["ENOSPC", "EIO"])
def test_an_error_of_the_disk_at_any_step_is_told_and_leaves_the_old_or_the_new(
    tmp_path, kind, old, error
):
    import errno

    found = faults(tmp_path / "x", kind, old, getattr(errno, error), True)
    before = "old" if old else "nothing"
    for status, at_once, after, left in found:
        # It is told, and names the output; or it was in the tidying up, and all is well.
        assert status == 3 or (status == 0 and at_once == "new")
        assert at_once in {before, "new"}
        assert after == at_once
        assert left == []
    assert 3 in {status for status, *_ in found}


WRITERS = {
    "file": (
        "    with staged_file(sys.argv[1]) as path:\n"
        "        path.write_text(sys.argv[2] * 100_000)\n"
    ),
    "folder": (
        "    with staged_folder(sys.argv[1]) as path:\n"
        "        (path / 'recording.json').write_text(sys.argv[2] * 100_000)\n"
        "        (path / 'samples.csv').write_text(sys.argv[2])\n"
    ),
}


@pytest.mark.parametrize("kind", WRITERS)
def test_two_writers_of_one_output_leave_one_of_the_two_whole(tmp_path, kind):
    code = (
        "import sys\nfrom armimpedance.core.outputs import staged_file, staged_folder\n"
        "for _ in range(80):\n" + WRITERS[kind]
    )
    out = tmp_path / "out"
    call = [sys.executable, "-c", code, str(out)]
    writers = [subprocess.Popen([*call, letter], stderr=subprocess.PIPE) for letter in "ab"]
    seen = set()
    while any(writer.poll() is None for writer in writers):
        if kind == "file" and out.exists():
            text = out.read_text()
            assert len(text) == 100_000
            seen |= set(text)
            assert len(set(text)) == 1
    for writer in writers:
        assert writer.stderr is not None
        said = writer.stderr.read()
        writer.stderr.close()
        assert writer.wait() == 0, said
    if kind == "folder":
        held = {path.name: set(path.read_text()) for path in out.iterdir()}
        assert held in [dict.fromkeys(("recording.json", "samples.csv"), {c}) for c in "ab"]
    assert os.listdir(tmp_path) == ["out"]
