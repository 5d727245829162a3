"""Side by side with other packages: the same records, accuracy, coverage, time and memory.

    python -m venv peers-env && peers-env/bin/pip install -r benchmarks/peers/environment.txt
    PYTHONPATH=. .venv/bin/python benchmarks/peers/run.py --python peers-env/bin/python --quick

Every peer runs alone in a process of its own, with one thread; pushes of the hand on one core,
records of a joint on another. Times are processor time of the whole process, start and imports
included; memory is its peak. Where a peer would need more than the budget for the next size, it is
not taken further. Without --python all but this package and SciPy are rows that say so. Exit status
1 if a peer is clearly more accurate on clean records than what of this package does the same: its
mean squared error of M, B or K is smaller beyond what chance does in 99 of 100.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from compare import markdown, summary, verdicts
from make_records import MAKERS
from table import PEERS, Peer

HERE = Path(__file__).parent
SIZES = {
    "quick": {"hand": (100, 1000), "joint": (10,), "reflex": (10,)},
    "full": {"hand": (100, 1000, 10_000, 100_000), "joint": (10, 100, 300), "reflex": (40,)},
}
#: Processor time that one peer may take for one size, s.
BUDGET_S = {"quick": 40.0, "full": 200.0}
#: A size that takes less than this is run three times; the least counts.
SHORT_S, REPEATS = 5.0, 3
#: One thread for everybody.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

Costs = dict[str, float | str]


def child(peer: Peer, python: str, folder: Path, out: Path) -> Costs:
    """Costs of one run, or why there is none."""
    command = [python, str(HERE / "child.py"), peer.module, peer.function, str(folder), str(out)]
    paths = (str(HERE.parents[1]), os.environ.get("PYTHONPATH", ""))
    own = dict.fromkeys(THREADS, "1") | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
    done = subprocess.run(
        command, check=False, capture_output=True, text=True, env=os.environ | own
    )
    if done.returncode:
        return {"reason": (done.stderr.strip().splitlines() or ["it ended"])[-1]}
    return json.loads(done.stdout.splitlines()[-1])


def measured(peer: Peer, python: str, folder: Path, out: Path) -> Costs:
    """The least of up to three runs."""
    runs = [child(peer, python, folder, out)]
    while "reason" not in runs[0] and len(runs) < REPEATS and runs[0]["processor_s"] < SHORT_S:
        runs.append(child(peer, python, folder, out))
    return {k: min(r[k] for r in runs) for k in runs[0]}


def sizes_of(
    peer: Peer, python: str, places: dict[int, Path], out: Path, budget_s: float
) -> Iterator[tuple[int, Costs]]:
    """Costs of each size, or a reason, until the sizes or the budget end."""
    need = 0.0
    for size, folder in places.items():
        if size > peer.most:
            yield size, {"reason": "not asked of it"}
            return
        if need * size > budget_s:
            yield size, {"reason": f"would take some {need * size:.0f} s"}
            return
        costs = measured(peer, python, folder, out / f"{peer.module}_{peer.function}_{size}.npz")
        print(f"{folder.name:12} {peer.name:28} {costs}", flush=True)
        yield size, costs
        if "reason" in costs:
            return
        need = (costs["processor_s"] - costs["imports_s"]) / size


def run_rig(rig: str, how: str, python: str | None, out: Path) -> dict[str, object]:
    """Make the records of a rig, run every peer that takes them."""
    (out / rig).mkdir(parents=True, exist_ok=True)
    rows: dict[str, dict[int, Costs]] = {}
    with tempfile.TemporaryDirectory() as name:
        places = {size: Path(name) / f"{rig} {size}" for size in SIZES[how][rig]}
        truth = [MAKERS[rig](folder, size).tolist() for size, folder in places.items()][0]
        for peer in (p for p in PEERS if rig in p.rigs):
            runner = sys.executable if peer.ours or peer.module == "with_scipy" else python
            if runner is None:
                rows[peer.name] = dict.fromkeys(places, {"reason": "no --python"})
                continue
            rows[peer.name] = dict(sizes_of(peer, runner, places, out / rig, BUDGET_S[how]))
    return {
        "how": how,
        "load": os.getloadavg(),
        "truth": truth,
        "sizes": list(places),
        "rows": rows,
    }


def run(how: str, only: list[str], python: str | None, out: Path) -> dict[str, object]:
    """The hand on one core, the joint on another; each rig with the machine's load at its end."""
    with ThreadPoolExecutor(2) as pool:
        made = pool.map(lambda rig: run_rig(rig, how, python, out), only)
        return {"rigs": dict(zip(only, made, strict=True))}


def kept(out: Path) -> dict[str, object]:
    """Rigs of an earlier run, sizes as numbers again."""
    if not (out / "results.json").exists():
        return {}
    rigs = json.loads((out / "results.json").read_text())["rigs"]
    for part in rigs.values():
        rows = part["rows"].items()
        part["rows"] = {name: {int(n): c for n, c in sizes.items()} for name, sizes in rows}
    return rigs


def main() -> int:
    """Run, keep the results, print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", dest="how", action="store_const", const="quick")
    parser.add_argument("--full", dest="how", action="store_const", const="full")
    parser.add_argument("--python", help="interpreter of environment.txt")
    parser.add_argument("--out", type=Path, default=Path("peers"))
    parser.add_argument(
        "--only", nargs="+", choices=list(MAKERS), default=list(MAKERS), help="these rigs again"
    )
    parser.set_defaults(how="quick")
    asked = parser.parse_args()
    results = summary(run(asked.how, asked.only, asked.python, asked.out), asked.out)
    found = kept(asked.out) | results["rigs"]
    results["rigs"] = {rig: found[rig] for rig in MAKERS if rig in found}
    (asked.out / "results.json").write_text(json.dumps(results, indent=1))
    text = markdown(results)
    (asked.out / "tables.md").write_text(text)
    print(text)
    lost = verdicts(results)
    print("\n".join(lost) or "no peer is clearly more accurate on clean records")
    return int(bool(lost))


if __name__ == "__main__":
    sys.exit(main())
