"""What a scheduler, a terminal that goes away and closed streams do to a command."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from armimpedance.core.errors import WorkerError
from armimpedance.show.command.failures import Stopped, stopped_in_order, told

#: A command that says when it is at work, has a file open, and would take for ever.
AT_WORK = """
import sys, time
from armimpedance.__main__ import _fill_standard_streams, main
# as in the program, before all else is loaded: a library may keep the lowest free number
_fill_standard_streams()
import armimpedance.muscles.show.explore_command as command
from armimpedance.core.outputs import staged_file

def run(arguments):
    with staged_file(sys.argv[1]) as path:
        path.write_text("half")
        print("at work", flush=True)
        {work}

command.run = run
command.configure = lambda parser: None
sys.exit(main(["explore"]))
"""


def at_work(
    out: Path, work: str = "time.sleep(60)", hangs_up=signal.SIG_DFL, **options
) -> subprocess.Popen:
    """A process that is writing a file; `hangs_up` is what it does when its terminal goes away."""
    call = [sys.executable, "-c", AT_WORK.format(work=work), str(out)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    # who starts the tests in the background, or after nohup, has them ignore these signals, and so
    # would this process
    wanted = {signal.SIGINT: signal.default_int_handler, signal.SIGHUP: hangs_up}
    before = {number: signal.signal(number, handler) for number, handler in wanted.items()}
    try:
        process = subprocess.Popen(call, **pipes, **options)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert process.stdout is not None
    assert process.stdout.readline() == "at work\n"
    return process


@pytest.mark.first_cases(4)
@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
@pytest.mark.parametrize("work", ["time.sleep(60)", "import_that_breaks()"])
def test_a_signal_to_end_is_one_line_and_leaves_nothing_half_written(tmp_path, name, status, work):
    # A library that is interrupted while it is loaded may raise an error of its own.
    broken = (
        "try:\n            time.sleep(60)\n"
        "        except BaseException:\n            raise ImportError('failed') from None"
    )
    (tmp_path / "r.csv").write_text("old")
    process = at_work(tmp_path / "r.csv", broken if work != "time.sleep(60)" else work)
    process.send_signal(getattr(signal, name))
    _, said = process.communicate(timeout=20)
    assert process.returncode == status
    assert len(said.splitlines()) == 1
    assert os.listdir(tmp_path) == ["r.csv"]
    assert (tmp_path / "r.csv").read_text() == "old"


def test_a_signal_that_is_ignored_stays_ignored(tmp_path):
    # As after nohup.
    process = at_work(tmp_path / "r.csv", "time.sleep(0.5)", hangs_up=signal.SIG_IGN)
    process.send_signal(signal.SIGHUP)
    process.communicate(timeout=20)
    assert process.returncode == 0
    assert (tmp_path / "r.csv").read_text() == "half"


def test_a_second_signal_does_not_disturb_the_tidying_up_and_a_later_one_is_heeded(monkeypatch):
    clock = [0.0]
    monkeypatch.setattr("armimpedance.show.command.failures.monotonic", lambda: clock[0])
    with stopped_in_order() as asked:
        with pytest.raises(Stopped):
            signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGTERM)
        clock[0] = 10.0
        with pytest.raises(Stopped):
            signal.raise_signal(signal.SIGTERM)
    assert asked.why is not None
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_in_a_thread_no_signal_is_touched():
    seen = []

    def look() -> None:
        with stopped_in_order():
            seen.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert seen == [signal.SIG_DFL]


@pytest.mark.parametrize("closed", [(0,), (1,), (2,), (0, 1, 2)], ids=str)
def test_a_closed_standard_stream_costs_no_file_and_nothing_else_gets_into_one(tmp_path, closed):
    out = tmp_path / "r.csv"
    code = AT_WORK.format(work="import os; os.write(2, b'library')")

    def close() -> None:
        for number in closed:
            os.close(number)

    call = [sys.executable, "-c", code, str(out)]
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    done = subprocess.run(call, preexec_fn=close, **pipes)
    assert done.returncode == 0
    assert out.read_text() == "half"


def test_an_error_is_not_printed_among_the_results_where_standard_error_is_closed(tmp_path):
    call = [sys.executable, "-m", "armimpedance", "map-columns", str(tmp_path / "nowhere")]
    done = subprocess.run(call, stdout=subprocess.PIPE, preexec_fn=lambda: os.close(2))
    assert done.returncode == 2
    assert done.stdout == b""


def test_what_a_library_logs_is_told_in_a_line_and_where_its_cache_lies_is_not(tmp_path):
    code = (
        "import logging\n"
        "import matplotlib.colors\n"
        "logging.getLogger('odd.library').warning('two\\nlines')"
    )
    work = code.replace("\n", "\n        ")
    environment = {**os.environ, "MPLCONFIGDIR": "/proc/nowhere", "HOME": "/proc"}
    process = at_work(tmp_path / "r.csv", work, env=environment)
    _, said = process.communicate(timeout=20)
    assert process.returncode == 0
    assert len(said.splitlines()) == 1
    assert "odd.library: two lines" in said


def test_a_working_folder_that_is_gone_is_said(tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    call = [sys.executable, "-P", "-m", "armimpedance", "estimate", "x", "--out", "r.csv"]
    done = subprocess.run(call, capture_output=True, text=True, cwd=gone, preexec_fn=gone.rmdir)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "working folder" in done.stderr


def test_a_worker_that_was_killed_is_no_fault_of_the_input():
    assert told(WorkerError("a worker ended"))[1] == 1


#: A command whose workers take for ever.
WITH_WORKERS = """
import time
if __name__ == "__main__":
    # here, and not above: the workers need not load it too
    from {place} import {name}
    list({work})
"""


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="asks /proc for children")
@pytest.mark.parametrize(
    ("place", "name", "work"),
    [
        ("armimpedance.hand.still", "in_order", "in_order(time.sleep, [(600,)] * 2, workers=2)"),
        ("armimpedance.app.study", "Processes", "Processes(2)(time.sleep, [600] * 2)"),
    ],
    ids=["in_order", "Processes"],
)
def test_workers_do_not_outlive_a_process_that_is_killed(tmp_path, place, name, work):
    script = tmp_path / "work.py"
    script.write_text(WITH_WORKERS.format(place=place, name=name, work=work))
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    environment = {**os.environ, "TMPDIR": str(temporary)}
    call = [sys.executable, str(script)]
    process = subprocess.Popen(call, stderr=subprocess.PIPE, env=environment)
    until = time.monotonic() + 20
    workers: list[str] = []
    while len(workers) < 2 and time.monotonic() < until:
        time.sleep(0.1)
        workers = [pid for pid in _children(process.pid) if _is_ready(pid)]
    process.kill()
    # nothing is said, by the helpers of Python either, which have this stream to the last
    assert process.communicate()[1] == b""
    while any(map(_runs, workers)) and time.monotonic() < until:
        time.sleep(0.1)
    assert len(workers) == 2
    assert not any(map(_runs, workers))
    assert os.listdir(temporary) == []


def _children(pid: int) -> list[str]:
    """Those that any thread of a process started."""
    lists = Path(f"/proc/{pid}/task").glob("*/children")
    return [child for each in lists for child in each.read_text().split()]


def _is_ready(pid: str) -> bool:
    """A worker whose watch over its parent has begun: it has a second thread."""
    spawned = b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
    return spawned and len(os.listdir(f"/proc/{pid}/task")) > 1


def _runs(pid: str) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


#: A worker that is killed while it shows how far it is.
KILLED_WORKER = """
import os, signal
from armimpedance.core.workers import crew
from armimpedance.show.command.screen import bar

def work():
    with bar("work") as progress:
        progress(1, 2)
        os.kill(os.getpid(), signal.SIGKILL)

if __name__ == "__main__":
    with crew(2) as workers:
        print(type(workers.share(work).exception(60)).__name__)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no such signal here")
def test_of_a_worker_that_was_killed_python_itself_says_nothing(tmp_path):
    script = tmp_path / "work.py"
    script.write_text(KILLED_WORKER)
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True)
    assert done.stdout == "WorkerError\n"
    assert done.stderr == ""


#: A command whose workers hold a file open, half written.
WORKERS_AT_WORK = """
import sys, time
from pathlib import Path
from armimpedance.__main__ import main

def hold(out):
    from armimpedance.core.outputs import staged_file
    with staged_file(out) as path:
        path.write_text("half")
        time.sleep(600)

def run(arguments):
    from armimpedance.core.workers import crew
    with crew(3) as workers:
        workers.finish([workers.share(hold, f"{sys.argv[1]}/{n}.csv") for n in range(3)])

if __name__ == "__main__":
    import armimpedance.muscles.show.explore_command as command
    command.run = run
    command.configure = lambda parser: None
    sys.exit(main(["explore"]))
"""


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="asks /proc for children")
@pytest.mark.parametrize(
    ("name", "status"),
    [
        pytest.param("SIGINT", 130, marks=pytest.mark.study),
        pytest.param("SIGTERM", 143, marks=pytest.mark.study),
        ("SIGHUP", 129),
    ],
)
def test_a_signal_to_all_processes_ends_all_of_them_in_order(tmp_path, name, status):
    script, out = tmp_path / "work.py", tmp_path / "out"
    script.write_text(WORKERS_AT_WORK)
    out.mkdir()
    call = [sys.executable, str(script), str(out)]
    before = signal.signal(getattr(signal, name), signal.SIG_DFL)
    if name == "SIGINT":
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        process = subprocess.Popen(call, stderr=subprocess.PIPE, text=True, start_new_session=True)
    finally:
        signal.signal(getattr(signal, name), before)
    until = time.monotonic() + 30
    while len(os.listdir(out)) < 3 and time.monotonic() < until:
        time.sleep(0.05)
    workers = _children(process.pid)
    os.killpg(process.pid, getattr(signal, name))
    _, said = process.communicate(timeout=30)
    assert process.returncode == status
    assert len(said.splitlines()) == 1
    assert os.listdir(out) == []
    while any(map(_runs, workers)) and time.monotonic() < until:
        time.sleep(0.05)
    assert len(workers) == 3  # two, and Python's own helper, which is the last
    assert not any(map(_runs, workers))
