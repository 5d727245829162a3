"""Workers, schedulers, the network and the study itself are cut off at random moments.

Asked: after 50 kills the results are the bits of a study that nobody disturbed, and no session that
had ended is done again. Run: python benchmarks/study/kills.py [KILLS]
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

SESSIONS = 10
KINDS = ("worker", "scheduler", "study, pool", "study, workers of Dask", "network")
STEPS = 'steps = ["estimate {recording} --method exact --out hand.csv"]\n'
AI = [sys.executable, "-m", "armimpedance"]


def main(kills: int) -> None:
    """Measure, and print asked against measured."""
    chance = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as folder:
        top = Path(folder)
        make_data(top / "data")
        study(top, "calm", []).wait()
        wanted = files(top / "calm")
        done = dict.fromkeys(KINDS, 0)
        kinds = list(done)
        lost = differing = again = 0
        for number in range(kills):
            kind = kinds[number % len(kinds)]
            shutil.rmtree(top / "out", ignore_errors=True)
            again += ended_again(top, kind, chance)
            found = files(top / "out")
            lost += len(set(wanted) - set(found))
            differing += sum(found[name] != wanted[name] for name in set(wanted) & set(found))
            done[kind] += 1
            print(f"{number + 1} of {kills}: {kind}", flush=True)
    print(f"kills: {', '.join(f'{n} of a {kind}' for kind, n in done.items())}")
    print(f"files missing after going on: {lost} (asked 0)")
    print(f"files with other bits: {differing} (asked 0)")
    print(f"sessions that had ended and were done again: {again} (asked 0)")


def ended_again(top: Path, kind: str, chance: np.random.Generator) -> int:
    """Run with one kill, go on if it is needed; how many ended sessions were done again."""
    if kind == "study, pool":
        running = study(top, "out", ["--workers", "2"])
        time.sleep(chance.uniform(0.5, 6.0))
        kill_group(running)
        return go_on(top, ["--workers", "2"])
    port, line = free_port(), free_port()
    address = f"tcp://127.0.0.1:{line if kind == 'network' else port}"
    helpers = [scheduler(port), network(line, port), workers(address, top)]
    try:
        running = study(top, "out", ["--scheduler", address])
        time.sleep(chance.uniform(4.0, 9.0))
        if kind == "worker":
            kill_one_worker(helpers[2])
        elif kind == "scheduler":
            kill_group(helpers[0])
            helpers += [scheduler(port)]
            time.sleep(1.0)
            helpers += [workers(address, top)]
        elif kind == "network":
            # a worker that lost its scheduler ends: whoever started it starts it again
            kill_group(helpers[1])
            time.sleep(chance.uniform(2.0, 12.0))
            helpers += [network(line, port), workers(address, top)]
        else:
            kill_group(running)
            return go_on(top, ["--scheduler", address])
        if running.wait(timeout=300) != 0:
            raise SystemExit(f"the study ended with {running.returncode} after a killed {kind}")
        return 0
    finally:
        for one in helpers:
            kill_group(one)


def go_on(top: Path, options: list[str]) -> int:
    """Run again after the study's own process was killed."""
    before = {name for name in files(top / "out") if name.endswith("session.json")}
    running = study(top, "out", [*options, "--resume"])
    told, _ = running.communicate(timeout=300)
    if running.returncode != 0:
        raise SystemExit(f"going on ended with {running.returncode}: {told}")
    run = int(re.search(r"(\d+) run,", told)[1])
    return max(0, run - (SESSIONS - len(before)))


def study(top: Path, out: str, options: list[str]) -> subprocess.Popen[str]:
    """Start a study in a group of processes of its own."""
    (top / out).mkdir(exist_ok=True)
    (top / out / ".store").mkdir(exist_ok=True)
    words = [*AI, "study", str(top / "data"), str(top / out), "participant", *options]
    return started(words, stdout=subprocess.PIPE)


def scheduler(port: int) -> subprocess.Popen[str]:
    """Start a scheduler of Dask."""
    words = ["scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    return started([str(Path(sys.executable).with_name("dask")), *words])


def network(line: int, port: int) -> subprocess.Popen[str]:
    """Start what passes connections on to the scheduler."""
    return started(
        [sys.executable, str(Path(__file__).with_name("network.py")), f"{line}", f"{port}"]
    )


def workers(address: str, top: Path) -> subprocess.Popen[str]:
    """Start two workers of Dask."""
    words = ["worker", address, "--nthreads", "1", "--nworkers", "2", "--no-dashboard"]
    local = ["--local-directory", str(top / "workers")]
    return started([str(Path(sys.executable).with_name("dask")), *words, *local])


def started(words: list[str], stdout: int = subprocess.DEVNULL) -> subprocess.Popen[str]:
    """Start a process in a group of its own."""
    return subprocess.Popen(
        words,
        stdout=stdout,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )


def kill_group(process: subprocess.Popen[str]) -> None:
    """Kill a process and all that it started."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        return
    process.wait()


def kill_one_worker(nanny: subprocess.Popen[str]) -> None:
    """Kill one worker; what watches over it stays."""
    asked = ["ps", "-o", "pid=,args=", "--ppid", str(nanny.pid)]
    listed = subprocess.run(asked, check=True, capture_output=True, text=True).stdout
    spawned = [line.split()[0] for line in listed.splitlines() if "spawn_main" in line]
    if spawned:
        os.kill(int(spawned[0]), signal.SIGKILL)


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def make_data(data: Path) -> None:
    """Small sessions, each with noise of its own."""
    for number in range(SESSIONS):
        place = data / f"sub-{number:02d}"
        place.mkdir(parents=True)
        words = ["simulate", "cocontraction", "--sets", "1", "--seed", str(number)]
        subprocess.run(
            [*AI, *words, "--out", str(place / "hand")], check=True, stdout=subprocess.DEVNULL
        )
    (data / "study.toml").write_text(STEPS)


def files(out: Path) -> dict[str, bytes]:
    """Every file of every session."""
    held = (p for p in out.glob("sub-*/**/*") if p.is_file())
    return {p.relative_to(out).as_posix(): p.read_bytes() for p in held}


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 50)
