"""What the world does to a command: closed pipes, full disks, Ctrl-C, errors of our own."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import warnings

import pytest
from sessions import pushes

from armimpedance.__main__ import main
from armimpedance.core.errors import LONGEST_MESSAGE, EstimationError, InputError
from armimpedance.hand.still import in_order
from armimpedance.recordings import write_recording
from armimpedance.show.command.failures import library_warnings, told
from armimpedance.show.command.screen import safe_screen


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A short session of pushes on the disk."""
    recording = pushes(1, ("cocontraction_10",))
    folder = tmp_path_factory.mktemp("faults") / "session"
    write_recording(recording, folder)
    return folder


def started(*words, **options) -> subprocess.Popen:
    """A command in a process of its own."""
    call = [sys.executable, "-m", "armimpedance", *map(str, words)]
    return subprocess.Popen(call, stderr=subprocess.PIPE, text=True, **options)


@pytest.mark.study
def test_a_reader_that_goes_away_costs_no_file(session, tmp_path):
    read, write = os.pipe()
    os.close(read)
    with started("estimate", session, "--out", tmp_path / "r.csv", stdout=write) as command:
        os.close(write)
        said = command.stderr.read()
    assert command.returncode == 0
    assert said == ""
    assert (tmp_path / "r.csv").stat().st_size > 0


@pytest.mark.study
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_a_full_disk_under_standard_output_is_said_and_costs_no_file(session, tmp_path):
    with (
        open("/dev/full", "w") as full,
        started("estimate", session, "--out", tmp_path / "r.csv", stdout=full) as command,
    ):
        said = command.stderr.read().splitlines()
    assert command.returncode == 1
    assert len(said) == 1
    assert os.strerror(errno.ENOSPC) in said[0]
    assert (tmp_path / "r.csv").stat().st_size > 0


@pytest.mark.study
@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp437"])
def test_a_poor_terminal_gets_a_poor_text(session, encoding):
    environment = os.environ | {"PYTHONIOENCODING": encoding}
    call = [sys.executable, "-m", "armimpedance", "estimate", str(session)]
    done = subprocess.run(call, capture_output=True, env=environment)
    assert done.returncode == 0, done.stderr
    assert "Hand impedance" in done.stdout.decode(encoding)


@pytest.mark.parametrize(
    "module",
    [
        "armimpedance.app.cli.main",
        "armimpedance.lab.simulate",
        "numpy",
        "pandas",
        "pyarrow.parquet",
    ],
)
def test_an_interrupt_is_one_line_and_130_also_while_modules_are_loaded(tmp_path, module):
    code = (
        "import builtins, sys\n"
        "from armimpedance.__main__ import main\n"
        "real = builtins.__import__\n"
        "def interrupted(name, *rest, **more):\n"
        f"    if name == {module!r}:\n"
        "        raise KeyboardInterrupt\n"
        "    return real(name, *rest, **more)\n"
        "builtins.__import__ = interrupted\n"
        "import importlib\n"
        "one = importlib.import_module\n"
        f"broken = lambda n: interrupted(n) if n == {module!r} else None\n"
        "importlib.import_module = lambda n, *r: (broken(n), one(n, *r))[1]\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    words = ["simulate", "postures", "--sets", "1", "--out", tmp_path / "session"]
    call = [sys.executable, "-c", code, *map(str, words)]
    done = subprocess.run(call, capture_output=True, text=True)
    assert done.returncode == 130, done
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert os.listdir(tmp_path) == []


def test_a_worker_that_is_killed_is_an_error_in_one_line():
    with pytest.raises(EstimationError, match="worker"):
        list(in_order(os._exit, [(9,)] * 3, workers=2))


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (InputError("is empty", file="a.csv"), 2),
        (FileNotFoundError(errno.ENOENT, "No such file", "a.csv"), 2),
        (OSError(errno.ENAMETOOLONG, "File name too long", "a" * 5000), 2),
        (OSError(errno.ENOSPC, "No space left on device"), 1),
        (OSError(errno.EFBIG, "File too large"), 1),
        (MemoryError(), 1),
        (RecursionError("maximum recursion depth exceeded"), 1),
        (OverflowError("int too large\nto convert"), 1),
        (UnicodeEncodeError("utf-8", "\ud800", 0, 1, "surrogates not allowed"), 1),
        (ValueError("\x1b[2J" * 400), 1),
        (KeyboardInterrupt(), 130),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else "",
)
def test_every_error_is_one_printable_line_and_a_status(error, status):
    line, code = told(error)
    assert code == status
    assert line.isprintable()
    assert 0 < len(line) <= LONGEST_MESSAGE


def test_a_library_that_the_system_lacks_is_named_with_its_package():
    error = ImportError("libgomp.so.1: cannot open shared object file: No such file or directory")
    line, code = told(error)
    assert code == 1
    assert "libgomp1" in line
    assert "ImportError" not in line


def test_an_error_of_ours_is_one_line_unless_the_traceback_is_asked_for(
    session, monkeypatch, capsys
):
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("of ours")

    monkeypatch.setattr("armimpedance.app.cli.inspect.run", broken)
    assert main(["inspect", str(session)]) == 1
    assert len(capsys.readouterr().err.splitlines()) == 1
    monkeypatch.setenv("ARMIMPEDANCE_TRACEBACK", "1")
    with pytest.raises(ZeroDivisionError):
        main(["inspect", str(session)])


def test_names_in_a_file_do_not_command_the_terminal(capsys):
    with safe_screen():
        sys.stdout.write("condition \x1b[2J\x07 and\ttab\nline\n")
    shown = capsys.readouterr().out
    assert shown == "condition \\x1b[2J\\x07 and\ttab\nline\n"


def test_what_a_library_warns_of_is_told_once():
    lines: list[str] = []
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        with library_warnings(lines.append):
            for _ in range(3):
                warnings.warn("odd\nthing", UserWarning, stacklevel=1)
    assert len(lines) == 1
    assert "3 times" in lines[0]
    assert lines[0].isprintable()


@pytest.mark.study
def test_a_hand_needs_no_pinocchio_and_a_relaxed_joint_says_that_it_does(session, tmp_path):
    without = "import sys; sys.modules['pinocchio'] = None; "
    call = f"{without}from armimpedance.__main__ import main; sys.exit(main(sys.argv[1:]))"
    estimate = ("estimate", session, "--out", tmp_path / "r.csv")
    made = ("simulate", "release", "--out", tmp_path / "relaxed", "--seed", "1")
    assert subprocess.run([sys.executable, "-c", call, *map(str, estimate)]).returncode == 0
    assert main([*map(str, made)]) == 0
    body = subprocess.run(
        [sys.executable, "-c", call, "passive", tmp_path / "relaxed"],
        capture_output=True,
        text=True,
    )
    assert body.returncode == 1
    assert body.stderr.count("\n") == 1
    assert "pip install" in body.stderr


def test_an_output_never_replaces_an_input(session, tmp_path, capsys):
    hand = tmp_path / "hand.csv"
    assert main(["estimate", str(session), "--out", str(hand)]) == 0
    before = {p: p.read_bytes() for p in [hand, *session.iterdir()]}
    (tmp_path / "link.csv").symlink_to(hand)
    calls = [
        ["estimate", session, "--out", session / "trials.csv"],
        ["map", hand, "--recording", session, "--to", "joint", "--out", hand],
        ["map", hand, "--recording", session, "--to", "joint", "--out", tmp_path / "link.csv"],
        ["fit", "moment-arms", hand, "--out", hand],
        ["compare", hand, "--out", hand],
        ["report", hand, "--out", hand],
    ]
    for call in calls:
        assert main([str(word) for word in call]) == 2, call
    assert {p: p.read_bytes() for p in before} == before
