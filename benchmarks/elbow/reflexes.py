"""One joint, clean or with a reflex through its muscle: how sharp, how surely held, what is said.

``python benchmarks/elbow/reflexes.py [--records 40] [--processes 2] [--only clean|reflex|noise]``.
Plants of `broken.joint_plant`, which shares nothing with the toolkit; seeds that chose nothing.
Prints, of clean records, the rms error of I, B, K over the Cramer-Rao bound's, the width of their
intervals over that of the plain fit, and how many hold; of records with a reflex, what the
intervals hold, with and without what the record does not exclude, and what is said; of coloured
noise of the angle, what is said.
"""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import dataclass, replace
from itertools import product
from multiprocessing import Pool
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from broken.joint_plant import Bent, Joint, bent
from scipy.signal import lfilter
from snr import relative_bound

from armimpedance.core.errors import ArmImpedanceError
from armimpedance.joint.elbow import ElbowFit, estimate_joint, from_recording, identify_elbow

SWINGS = Joint()
BETWEEN = Joint(I=0.1, B=1.1, K=9.0)
CREEPS = Joint(B=3.0, K=9.0)
JOINTS = {"swings": SWINGS, "between": BETWEEN, "creeps": CREEPS}
LEVELS = ((5.0, 60.0), (8.0, 20.0), (15.0, 30.0), (30.0, 20.0))
PARTS, DELAYS_S, MUSCLES_S = (0.1, 0.25, 0.5), (0.04, 0.06, 0.08), (0.0, 0.01, 0.02, 0.04)
#: A velocity is worth this much of a deflection, s.
RATE_S = 0.05
#: Poles of the angle's coloured noise, and its level, dB.
COLOURS = ((0.9, 20.0), (0.98, 20.0), (0.99, 20.0), (0.995, 30.0))


@dataclass(frozen=True)
class Case:
    """A plant and how its records are grouped."""

    group: str
    row: str
    joint: Joint
    how: Bent | None = None
    colour: tuple[float, float] | None = None

    def samples(self, index: int) -> Any:
        """One record as the analysis takes it."""
        made = (
            self.joint.record(index, "reflexes")
            if self.how is None
            else bent(self.joint, self.how, "reflexes")([index])[0]
        )
        record = made.record
        if self.colour is not None:
            record = coloured(record, *self.colour, index)
        return from_recording(record, 1, None if self.joint.tells else "torque")


def coloured(record: Any, pole: float, level_db: float, index: int) -> Any:
    """The angle with noise of one pole."""
    drawn = np.random.default_rng([391, index]).standard_normal(len(record.position) + 2000)
    noise = lfilter([1.0], [1.0, -pole], drawn)[2000:]
    size = 10 ** (-level_db / 20) * record.position.std() / noise.std()
    return replace(record, position=record.position + size * noise[:, None])


def cases() -> list[Case]:
    """All of them."""
    made = []
    for (name, joint), (level, seconds) in product(JOINTS.items(), LEVELS):
        one = replace(joint, snr_db=level, duration_s=seconds, tells=False)
        made.append(Case("clean", f"{name}, {level:g} dB, {seconds:g} s", one))
    for own, (name, joint) in product((0.0, 0.3), JOINTS.items()):
        base = replace(joint, snr_db=30.0 if own == 0 else 20.0, duration_s=20.0, own_Nm=own)
        for part, delay, muscle in product(PARTS, DELAYS_S, MUSCLES_S):
            late = replace(base, delay_s=delay, muscle_s=muscle)
            row = f"{name}, own torque {own:g} N m, muscle {1e3 * muscle:g} ms"
            made.append(Case("reflex", f"position: {row}", replace(late, reflex=part * joint.K)))
            rate = part * joint.K * RATE_S
            made.append(Case("reflex", f"velocity: {row}", replace(late, reflex_rate=rate)))
            if muscle and own == 0:
                made.append(Case("reflex", f"one way: {row}", late, Bent(one_way=2 * rate)))
    for (name, joint), colour in product(JOINTS.items(), COLOURS):
        quiet = replace(joint, snr_db=60.0, duration_s=20.0)
        row = f"{name}, pole {colour[0]:g}, {colour[1]:g} dB"
        made.append(Case("noise", row, quiet, colour=colour))
    return made


def asked(job: tuple[Case, int]) -> tuple[Case, dict[str, Any] | None]:
    """One record's numbers; None where it is refused."""
    case, index = job
    try:
        samples = case.samples(index)
        fit = identify_elbow(samples)
    except ArmImpedanceError:
        return case, None
    truth = np.array([case.joint.I, case.joint.B, case.joint.K])
    numbers = {"error": fit.parameters.values / truth - 1, **held(fit, truth)}
    numbers["verdicts"] = {check.name: check.verdict for check in fit.checks}
    if case.group == "clean":
        plain = np.diff(estimate_joint(samples).interval(), axis=1)[:, 0]
        own = np.diff(fit.parameters.interval(), axis=1)[:, 0]
        numbers["wider"], numbers["bound"] = own / plain, bound(case.joint, index)
    return case, numbers


def held(fit: ElbowFit, truth: np.ndarray) -> dict[str, np.ndarray]:
    """Whether the intervals hold the truth, and their half-widths, (3,)."""
    found = {}
    for name, one in (("own", fit.parameters), ("all", fit.allowing or fit.parameters)):
        low, high = one.interval().T
        found[f"held {name}"] = (low <= truth) & (truth <= high)
        found[f"half {name}"] = (high - low) / 2 / truth
    return found


def bound(joint: Joint, index: int) -> np.ndarray:
    """Cramer-Rao bound of I, B, K, relative, (3,)."""
    clean = replace(joint, snr_db=300.0).record(index, "reflexes").record
    truth = np.array([joint.I, joint.B, joint.K])
    return relative_bound(truth, clean.force[:, 0], clean.position[:, 0], joint.snr_db)


def shown(values: np.ndarray) -> str:
    """Three numbers."""
    return "/".join(f"{v:5.2f}" for v in values)


def said(rows: list[dict[str, Any]]) -> str:
    """How many records say what, per cent."""
    names = ("reflex", "skew", "amplitude", "order", "band", "imposed")
    words = []
    for verdict in ("warning", "cannot tell"):
        counts = {n: sum(r["verdicts"].get(n) == verdict for r in rows) for n in names}
        words += [f"{n} {verdict} {100 * c / len(rows):.0f} %" for n, c in counts.items() if c]
    return ", ".join(words)


def line(group: str, rows: list[dict[str, Any]]) -> str:
    """One row of the table."""
    error = np.array([r["error"] for r in rows])
    own, every = (np.mean([r[f"held {k}"] for r in rows], axis=0) for k in ("own", "all"))
    if group == "clean":
        rms = np.sqrt(np.mean([(r["error"] / r["bound"]) ** 2 for r in rows], axis=0))
        wider = np.median([r["wider"] for r in rows], axis=0)
        half = np.median([r["half all"] for r in rows], axis=0)
        return (
            f"rms over bound {shown(rms)}, width over plain {shown(wider)}, held {shown(own)}, "
            f"K may hide {100 * half[2]:.1f} %; {said(rows)}"
        )
    silent = [
        not r["held own"][2] and abs(r["error"][2]) > 0.02
        and all(v == "ok" for v in r["verdicts"].values())
        for r in rows
    ]  # fmt: skip
    half = np.median([r["half all"] for r in rows], axis=0)
    return (
        f"K {100 * error[:, 2].mean():+.1f} %, held {100 * every[2]:.0f} % "
        f"by +-{100 * half[2]:.1f} %, silently wrong {100 * np.mean(silent):.1f} %; {said(rows)}"
    )


def main() -> int:
    """Run all cases and print a line for each row, then one for each group."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=40)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--only", choices=("clean", "reflex", "noise"))
    arguments = parser.parse_args()
    chosen = [case for case in cases() if arguments.only in (None, case.group)]
    jobs = [(case, index) for case in chosen for index in range(arguments.records)]
    with Pool(arguments.processes) as pool:
        answers = pool.map(asked, jobs, chunksize=4)
    tables: dict[str, dict[str, list[dict[str, Any]]]] = {}
    for case, numbers in answers:
        rows = tables.setdefault(case.group, {}).setdefault(case.row, [])
        if numbers is not None:
            rows.append(numbers)
    for group, rows_of in tables.items():
        print(f"\n{group}")
        for row, rows in rows_of.items():
            print(f"  {row} ({len(rows)}): {line(group, rows)}")
        everything = [r for rows in rows_of.values() for r in rows]
        print(f"  all ({len(everything)}): {line(group, everything)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
