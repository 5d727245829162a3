"""Wherever a study is worked on, its results are the same; what is killed costs one session."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest

from armimpedance.app.study import (
    Dask,
    Processes,
    array_script,
    find_sessions,
    read_design,
    run_participants,
    share_of,
)
from armimpedance.core.errors import InputError


def double(words: list[str]) -> int:
    """A command: twice the number in a file; some numbers end the process."""
    source, out = Path(words[1]), words[3]
    number = int(source.read_text())
    mark = source.with_name("killed")
    if number == 66 or (number == 77 and not mark.exists()):
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    Path(out).write_text(f"value\n{2 * number}\n")
    return 0


def made(folder: Path, numbers: list[int]) -> Path:
    data = folder / "data"
    for place, number in enumerate(numbers):
        person = data / f"sub-{place}"
        person.mkdir(parents=True)
        (person / "x.rec").write_text(str(number))
    (data / "study.toml").write_text('steps = ["double {recording} --out twice.csv"]')
    return data


def run(data: Path, out: Path, engine: object) -> dict[str, str]:
    design = read_design(None, data)
    sessions = find_sessions(data, None, lambda path: path.suffix == ".rec")
    ended = run_participants(sessions, design, out, double, engine)
    return {one.session.participant: one.outcome.reason for one in ended}


def files(out: Path) -> dict[str, bytes]:
    held = (p for p in out.rglob("*") if p.is_file() and p.name != "seen.json")
    return {p.relative_to(out).as_posix(): p.read_bytes() for p in held}


@pytest.fixture
def cluster():
    """Two workers of Dask, each a process of one thread."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as local:
        yield local


@pytest.mark.study
def test_one_worker_two_workers_and_dask_give_the_same_bits(tmp_path, cluster, monkeypatch):
    data = made(tmp_path, list(range(6)))
    run(data, tmp_path / "one", map)
    run(data, tmp_path / "two", Processes(2))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    cluster.scale(2)
    run(data, tmp_path / "dask", Dask(cluster.scheduler_address, patience_s=60))
    wanted = files(tmp_path / "one")
    assert len([name for name in wanted if name.startswith("sub-")]) == 6 * 3
    assert files(tmp_path / "two") == wanted
    assert files(tmp_path / "dask") == wanted


@pytest.mark.study
def test_a_worker_that_was_killed_is_replaced_and_its_session_tried_again(tmp_path):
    data = made(tmp_path, [1, 77, 3, 4])
    assert set(run(data, tmp_path / "out", Processes(2)).values()) == {""}
    assert (tmp_path / "out/sub-1/ses-x/twice.csv").read_text() == "value\n154\n"


@pytest.mark.study
def test_a_session_that_kills_every_process_is_a_row_and_the_others_are_done(tmp_path):
    data = made(tmp_path, [1, 66, 3, 4])
    reasons = run(data, tmp_path / "out", Processes(2))
    assert "killed" in reasons.pop("1")
    assert set(reasons.values()) == {""}


def test_workers_that_would_give_other_bits_are_refused(tmp_path):
    from distributed import LocalCluster

    data = made(tmp_path, [1])
    with (
        LocalCluster(1, threads_per_worker=2, processes=False, dashboard_address=":0") as local,
        pytest.raises(InputError, match="threads"),
    ):
        run(data, tmp_path / "out", Dask(local.scheduler_address, patience_s=30))


def test_no_scheduler_is_said_and_not_waited_for_for_ever(tmp_path):
    from armimpedance.core.errors import EstimationError

    data = made(tmp_path, [1])
    with pytest.raises(EstimationError, match="no scheduler"):
        run(data, tmp_path / "out", Dask("tcp://127.0.0.1:1", patience_s=0.5))


def test_the_shares_of_an_array_are_all_sessions_each_once(tmp_path):
    sessions = find_sessions(made(tmp_path, list(range(7))), None, lambda p: p.suffix == ".rec")
    shares = [share_of(sessions, index, 3) for index in range(3)]
    assert sorted((s for share in shares for s in share), key=str) == sessions
    with pytest.raises(InputError):
        share_of(sessions, 3, 3)


def test_the_script_of_an_array_runs_each_share_and_asks_for_the_group_once(tmp_path):
    # What SLURM would do, in short: one run of the script an index; `sbatch` writes down its call.
    for name, text in {
        "sbatch": 'echo "$@" >> asked.txt',
        "armimpedance": 'echo "$@" >> done.txt',
    }.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    call = ["armimpedance", "study", "my data", "out"]
    script = array_script(call, ["--participant-label", "01"], 3, "01:00:00", "4G")
    for index in range(3):
        env = {
            "PATH": f"{tmp_path}:{os.environ['PATH']}",
            "SLURM_ARRAY_TASK_ID": str(index),
            "SLURM_ARRAY_JOB_ID": "12",
        }
        subprocess.run(["bash", "-c", script], check=True, cwd=tmp_path, env=env)
    lines = (tmp_path / "done.txt").read_text().splitlines()
    assert [line.split("--task-index ")[1] for line in lines] == [
        f"{i} --tasks 3" for i in range(3)
    ]
    [asked] = (tmp_path / "asked.txt").read_text().splitlines()
    assert "afterany:12" in asked
    assert "'my data' out group" in asked
