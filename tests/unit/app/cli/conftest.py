"""What tests of the command line share: a refused call, and short recordings of moving bodies."""

from __future__ import annotations

import shutil

import pytest

from armimpedance.__main__ import main
from armimpedance.recordings.motion.marker_and_motion_folder import write_markers
from manipulandum_sim.passive.swing import simulate_passive


@pytest.fixture
def refusal(capsys, tmp_path, monkeypatch):
    """The one line on stderr of a call that must exit with 2 and write nothing where it runs."""
    here = tmp_path / "nothing_here"
    here.mkdir()
    monkeypatch.chdir(here)

    def call(*arguments):
        try:
            code = main([str(a) for a in arguments])
        except SystemExit as end:
            code = end.code
        captured = capsys.readouterr()
        assert code == 2, captured
        lines = captured.err.strip().splitlines()
        assert len(lines) == 1, captured.err
        assert not captured.out, captured.out
        assert list(here.iterdir()) == []
        return lines[0]

    return call


@pytest.fixture(scope="session")
def sound_bench(tmp_path_factory):
    """Sound files of a therapy robot and of a session in it, which are read only."""
    from therapy_bench import bench_in

    return bench_in(tmp_path_factory.mktemp("therapy"))


@pytest.fixture(scope="session")
def release():
    """Two swings of a relaxed forearm of 4 s each, filmed, and their truth."""
    return simulate_passive("release", trials=2, duration_s=4.0)


@pytest.fixture(scope="session")
def release_folder(release, tmp_path_factory):
    """The same on disk, as CSV."""
    folder = tmp_path_factory.mktemp("passive") / "release"
    write_markers(release[0], folder, "csv")
    return folder


@pytest.fixture
def relaxed(release_folder, tmp_path):
    """A copy to damage."""
    return shutil.copytree(release_folder, tmp_path / "relaxed")
