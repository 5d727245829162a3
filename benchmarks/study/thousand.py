"""A thousand people through one command: the first run, the run after a change, and memory.

Asked: the first run takes at most 1.3 x the sum of its parts on one core, over the number of
workers and .9; a run after one changed file does one session and takes at most 2 % of the first;
peak memory with 1000 people lies within 50 MB of that with 100.

    python benchmarks/study/thousand.py [PEOPLE]
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import armimpedance as ai

WORKERS = 2
STEPS = 'steps = ["estimate {recording} --out hand.csv"]\n'
AI = [sys.executable, "-m", "armimpedance"]
#: Sessions whose sum of parts stands for all of them.
SAMPLE = 40


def main(people: int) -> None:
    """Measure, and print asked against measured."""
    with tempfile.TemporaryDirectory() as folder:
        top = Path(folder)
        small, large = top / "small", top / "large"
        make_data(small, max(people // 10, 2))
        make_data(large, people)
        _, few_mb, _ = timed_study(small, top / "few")
        first_s, many_mb, _ = timed_study(large, top / "many")
        (large / "study.toml").touch()
        add_noise(large / "sub-0000/hand", 10**6)
        again_s, _, told = timed_study(large, top / "many")
        parts_s = sum_of_parts(large, top / "parts", min(SAMPLE, people)) * people
    spun = spinning(WORKERS)
    bound = parts_s / (WORKERS * spun) / 0.9
    run = re.search(r"(\d+) run,", told)[1]
    print(f"{people} people; two spinning processes reach {WORKERS * spun:.2f} of one")
    print(
        f"first run {first_s:.0f} s, second {again_s:.1f} s, a part {parts_s / people * 1e3:.0f} ms"
    )
    print(f"first run: {first_s / bound:.2f} x parts / workers / .9 (asked 1.3)")
    print(f"after one changed file: {run} done, {100 * again_s / first_s:.1f} % (asked 1, 2 %)")
    print(f"memory beyond that of a tenth of the people: {many_mb - few_mb:.0f} MB (asked 50)")


def make_data(data: Path, people: int) -> None:
    """A folder a person, each with noise of its own."""
    data.mkdir()
    words = [*AI, "simulate", "cocontraction", "--sets", "1", "--out", str(data / "first")]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    first = ai.read(data / "first")
    for number in range(people):
        place = data / f"sub-{number:04d}"
        place.mkdir()
        ai.write_recording(noisy(first, number), place / "hand")
    for file in (data / "first").iterdir():
        file.unlink()
    (data / "first").rmdir()
    (data / "study.toml").write_text(STEPS)


def noisy(recording: ai.Recording, seed: int) -> ai.Recording:
    """The same with a little noise on the force."""
    noise = np.random.default_rng(seed).normal(scale=0.01, size=recording.force.shape)
    return replace(recording, force=recording.force + noise)


def add_noise(place: Path, seed: int) -> None:
    """Change one recording."""
    changed = noisy(ai.read(place), seed)
    for file in place.iterdir():
        file.unlink()
    ai.write_recording(changed, place)


def timed_study(data: Path, out: Path) -> tuple[float, float, str]:
    """Wall time in s, peak memory of the study's own process in MB, and what it printed."""
    words = ["study", str(data), str(out), "participant", "--workers", str(WORKERS)]
    code = (
        "import resource, sys\n"
        "from armimpedance.__main__ import main\n"
        f"status = main({words!r})\n"
        "print('peak', resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)\n"
        "sys.exit(status)\n"
    )
    began = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    seconds = time.perf_counter() - began
    return seconds, int(done.stdout.split("peak")[1]) / 1024, done.stdout


def sum_of_parts(data: Path, out: Path, count: int) -> float:
    """Seconds of one session's command in one process on one core, without what it imports."""
    from armimpedance.app.cli.study import command

    out.mkdir()
    sessions = sorted(data.glob("sub-*"))[:count]
    sys.stdout = open(os.devnull, "w")  # noqa: PTH123, SIM115
    try:
        command(["estimate", str(sessions[0] / "hand"), "--out", str(out / "warm.csv")])
        began = time.perf_counter()
        for place in sessions:
            command(["estimate", str(place / "hand"), "--out", str(out / "hand.csv")])
        return (time.perf_counter() - began) / count
    finally:
        sys.stdout.close()
        sys.stdout = sys.__stdout__


def spinning(workers: int) -> float:
    """How fast one of several spinning processes is, of one alone."""
    code = "import time\nb = time.perf_counter()\nfor i in range(20_000_000): pass\n"
    code += "print(time.perf_counter() - b)"
    words = [sys.executable, "-c", code]
    alone = float(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    together = [subprocess.Popen(words, stdout=subprocess.PIPE, text=True) for _ in range(workers)]
    return alone / float(np.mean([float(one.communicate()[0]) for one in together]))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
