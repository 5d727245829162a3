"""Speed and memory of the doors, against the packages that only load the same file.

What we do beside loading: units and signs, trials, checks of time and values, what was not taken.
Each reading is a process of its own (the best of `--repeats`); memory is the peak over what the
imports alone need. Ratios in one run, ours over theirs. A Kinarm exam has no other reader: its
memory is compared with the recording's own arrays and with the exam.

    python benchmarks/doors/reading_speed.py
    python benchmarks/doors/reading_speed.py --exam-trials 2000
"""

# The number of threads must be set before numpy is imported.
# ruff: noqa: E402

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from armimpedance.lab.parts.simulation import FORMS
from manipulandum_sim.hand import simulate

OURS = (
    "import armimpedance as ai\n"
    "import scipy.signal, armimpedance.recordings.tables.folder\n"
    "read = lambda p: ai.read(p)\n"
)
#: Form -> what the package that is usual for such files does.
THEIRS = {
    "csv": "import pandas as pd, glob\n"
    "read = lambda p: [pd.read_csv(f) for f in sorted(glob.glob(p + '/*.csv'))]\n",
    "parquet": "import pandas as pd\nread = pd.read_parquet\n",
    "matlab": "import scipy.io\nread = scipy.io.loadmat\n",
    "mcap": "from mcap.reader import make_reader\n"
    "read = lambda p: sum(len(m.data) for _, _, m in make_reader(open(p, 'rb')).iter_messages())\n",
}
EXAM = (
    "import armimpedance as ai\n"
    "import scipy.signal, armimpedance.recordings.tables.folder\n"
    "read = lambda p: ai.read(p, force_by='limb', onset_event='PERTURB_ON')\n"
)
MEASURE = """
import json, re, sys, time
# Not the resource usage of the system, which begins with that of the process that started us.
peak = lambda: int(re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1]) / 1024
before, began = peak(), time.perf_counter()
kept = read(sys.argv[1])
print(json.dumps([time.perf_counter() - began, peak() - before]))
"""


def measured(code: str, path: Path, repeats: int) -> tuple[float, float]:
    """Seconds and MB of reading a file, the best of several processes."""
    found = []
    for _ in range(repeats):
        call = [sys.executable, "-c", code + MEASURE, str(path)]
        done = subprocess.run(call, capture_output=True, text=True, check=True)
        found.append(json.loads(done.stdout.splitlines()[-1]))
    return min(f[0] for f in found), min(f[1] for f in found)


def size_mb(path: Path) -> float:
    """What a file or folder takes on the disk, MB."""
    files = [path] if path.is_file() else [p for p in path.rglob("*") if p.is_file()]
    return sum(p.stat().st_size for p in files) / 1e6


def main() -> int:
    """Write one session in every form, read it, print ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=8, help="of the session: 56 trials each")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--exam-trials", type=int, default=0, help="a large exam too")
    arguments = parser.parse_args()
    session, _ = simulate("cocontraction", seed=1, sets=arguments.sets)
    print(f"{session.n_trials} trials, {len(session.time_s)} samples")
    print(f"{'form':10} {'MB':>7} {'seconds':>8} {'ratio':>6} {'MB read':>8} {'ratio':>6}")
    with tempfile.TemporaryDirectory() as folder:
        for form, theirs in THEIRS.items():
            place = Path(folder) / form
            place.mkdir()
            FORMS[form].write(session, place)
            file = place / FORMS[form].names[0]
            ours, other = (measured(code, file, arguments.repeats) for code in (OURS, theirs))
            print(
                f"{form:10} {size_mb(file):7.1f} {ours[0]:8.2f} {ours[0] / other[0]:6.1f} "
                f"{ours[1]:8.0f} {ours[1] / max(other[1], 1.0):6.1f}",
                flush=True,
            )
        for form in ("kinarm", "kinarm-c3d"):
            place = Path(folder) / form
            place.mkdir()
            FORMS[form].write(session, place)
            exam(place / FORMS[form].names[0], form, arguments.repeats)
    if arguments.exam_trials:
        large(arguments.exam_trials)
    return 0


def exam(file: Path, form: str, repeats: int) -> None:
    """Reading of an exam: seconds, and memory."""
    seconds, memory = measured(EXAM, file, repeats)
    print(f"{form:10} {size_mb(file):7.1f} {seconds:8.2f} {'':6} {memory:8.0f}", flush=True)


def large(trials: int) -> None:
    """An exam of so many trials, as an archive."""
    from dataclasses import replace

    import numpy as np
    import pandas as pd

    session, _ = simulate("cocontraction", seed=1, sets=1)
    times = -(-trials // session.n_trials)
    rows = np.tile(np.arange(session.n_trials), times)[:trials]
    some = session.select(rows[: session.n_trials])
    table = pd.concat([some.trials] * times, ignore_index=True)
    table["trial"] = np.arange(1, len(table) + 1)
    lengths = np.tile(np.diff(some.offsets), times)
    many = replace(
        some,
        trials=table,
        offsets=np.concatenate([[0], np.cumsum(lengths)]),
        time_s=np.tile(some.time_s, times),
        position=np.tile(some.position, (times, 1)),
        force=np.tile(some.force, (times, 1)),
        joint_angles=None,
        emg=None if some.emg is None else np.tile(some.emg, (times, 1)),
        extra={},
    )
    with tempfile.TemporaryDirectory() as folder:
        FORMS["kinarm"].write(many, Path(folder))
        exam(Path(folder) / FORMS["kinarm"].names[0], "large", 1)


if __name__ == "__main__":
    raise SystemExit(main())
