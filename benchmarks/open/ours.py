"""Submissions of this package's methods, and of the sources' own, to the open benchmark.

    python benchmarks/open/ours.py BENCHMARK OUT [NAME ...]

``armimpedance`` is what its commands do by default; ``sources`` what the sources did;
``hand-exact``, ``joint-arx``, ... another method of one topic.
"""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from rows import Answer, Method, write_submission

import armimpedance as ai
from armimpedance.hand.reaching import METHODS as MOVING
from armimpedance.hand.still import METHODS as HAND
from armimpedance.joint.body import METHODS as BODY
from armimpedance.joint.elbow import CASCADE_METHODS, METHODS as JOINT, VARYING_METHODS
from armimpedance.joint.relaxed import METHODS as RELAXED

HANDS = ("hand_ideal", "hand_soft", "hand_reflex", "hand_mixed")
JOINTS = ("joint_torque", "joint_position", "joint_reflex")


def of_matrices(names: str, values: np.ndarray, limits: np.ndarray, at: str = "") -> list[Any]:
    """Rows of matrices (n, k, k) with their limits (2, n, k, k)."""
    k = values.shape[-1]
    return [
        (f"{name}_{i + 1}{j + 1}{at}", values[n, i, j], *limits[:, n, i, j])
        for n, name in enumerate(names)
        for i in range(k)
        for j in range(k)
    ]


def of_estimate(estimate: Any, at: str = "") -> list[Any]:
    """Rows of M, B, K."""
    stacked = np.stack([estimate.inertia, estimate.viscosity, estimate.stiffness])
    return of_matrices("MBK", stacked, estimate.interval(), at)


def hand(record: Path, method: str | None = None) -> Answer:
    """M, B, K of one condition."""
    (found,) = ai.estimate(record / "recording", method=method)
    return Answer(of_estimate(found), bool(found.warnings))


def random_hand(record: Path) -> Answer:
    """M, B, K under random displacements."""
    (found,) = ai.random(record / "recording")
    return Answer(of_estimate(found), bool(found.warnings))


def joint(record: Path, method: str | None = None) -> Answer:
    """I, B, K."""
    found = ai.elbow(record / "recording", method=method)
    rows = [(p.name, p.value, *p.ci95) for p in found.parameters]
    return Answer(rows, bool(found.warnings))


def varying(record: Path, method: str) -> Answer:
    """I, B, K at the times that are asked."""
    found = ai.elbow_over_time(record / "recording", method=method)
    rows = [("I", found.inertia.value, *found.inertia.ci95)]
    task = record.parent.parent
    for quantity in quantities(task):
        name, _, at = quantity.partition("@")
        if name == "I":
            continue
        courses = [getattr(found, name), *found.band(name).T]
        # B of the task with a switching K is one number: the mean of its course
        numbers = [
            float(np.interp(float(at), found.time_s, c) if at else np.mean(c)) for c in courses
        ]
        rows.append((quantity, *numbers))
    return Answer(rows, bool(found.warnings))


@cache
def quantities(task: Path) -> tuple[str, ...]:
    """Names of what a task asks of a record."""
    with (task / "asked.csv").open(encoding="utf-8") as stream:
        return tuple(dict.fromkeys(row["quantity"] for row in csv.DictReader(stream)))


def moving(record: Path, method: str | None = None) -> Answer:
    """M, B, K at each phase."""
    found = ai.movement(record / "recording", **({} if method is None else {"method": method}))
    phases = dict.fromkeys(q.partition("@")[2] for q in quantities(record.parent.parent))
    rows = []
    for phase, estimate in zip(phases, found, strict=True):
        rows += of_estimate(estimate, f"@{phase}")
    return Answer(rows, any(e.warnings for e in found))


def relaxed(record: Path, method: str | None = None) -> Answer:
    """k, h, f of the elbow."""
    rest = json.loads((record / "told.json").read_text())["rest_angle_rad"]
    (found,) = ai.passive(
        record / "recording", rest_angle=rest, method=method, joints=["right_elbow_flexion"]
    )
    rows = [(n, found.parameters[n].value, *found.parameters[n].ci95) for n in "khf"]
    return Answer(rows, bool(found.warnings))


def body(record: Path, method: str | None = None) -> Answer:
    """Base parameters."""
    found = ai.body(record / "recording", method=method, motions=None)
    return Answer([(p.name, p.value, *p.ci95) for p in found.parameters], bool(found.warnings))


@cache
def robot(task: Path) -> Any:
    """The empty robot, calibrated."""
    return ai.calibrate_robot(task / "calibration", task / "drawings.json")


def contribution(record: Path, formula: str = "share") -> Answer:
    """The share in every active trial."""
    known = robot(record.parent.parent)
    arm = ai.calibrate_arm(record / "recording", known)
    found = ai.contribution(
        record / "recording", robot=known, arm=arm, condition="active", unrepeatable=True
    )
    metrics = {c.trial: getattr(c, formula) for c in found}
    rows = [(f"trial_{t}", m.percent, *m.ci95) for t, m in metrics.items() if m.valid]
    return Answer(rows, any(c.notes for c in found) or len(rows) < len(found))


def _predicted(model: Any, **where: np.ndarray) -> Answer:
    found = ai.predict(model, **where)
    frame = found.to_frame()
    rows = []
    for n, (_, row) in enumerate(frame.iterrows(), 1):
        for name in "BK":
            for i, j in ((1, 1), (1, 2), (2, 1), (2, 2)):
                at = f"{name}_{i}{j}"
                limits = (row[f"ci_low_{at}"], row[f"ci_high_{at}"])
                rows.append((f"{at}@{n}", row[at], *limits))
    return Answer(rows, bool(found.extrapolated.any()))


def _asked(file: Path) -> np.ndarray:
    return np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)[:, 1:]


def posture(record: Path, **options: Any) -> Answer:
    """B and K at the joints of postures in between."""
    source = ai.read(record / "recording")
    joint_level = ai.to_joint(ai.estimate(source), recording=source)
    return _predicted(
        ai.fit_posture(joint_level, **options), postures=_asked(record / "postures.csv")
    )


def emg(record: Path, **options: Any) -> Answer:
    """B and K at the joints at other activations."""
    sources = [ai.read(record / name) for name in ("cocontraction", "force")]
    hands = [e for source in sources for e in ai.estimate(source)]
    rows = ai.to_joint(hands, recording=sources[0])
    model = ai.fit_activation(rows, **{"model": "bernstein", **options})
    return _predicted(model, activations=_asked(record / "states.csv"))


def every(tasks: tuple[str, ...], method: Method) -> dict[str, Method]:
    """One method for several tasks."""
    return dict.fromkeys(tasks, method)


def submissions() -> dict[str, Mapping[str, Method]]:
    """Name -> task -> method."""
    made: dict[str, Mapping[str, Method]] = {
        "armimpedance": {
            **every(HANDS, hand),
            "hand_random": random_hand,
            **every(JOINTS, joint),
            "joint_smooth": partial(varying, method="smoother"),
            "joint_square": partial(varying, method="cascade"),
            "moving_hand": moving,
            "relaxed_joint": relaxed,
            "base_parameters": body,
            "contribution": contribution,
            # eleven postures are too few for whole polynomials of order 4
            "posture_model": partial(posture, model="separable"),
            "emg_model": emg,
        },
        "sources": {
            **every(HANDS, partial(hand, method="paper")),
            **every(JOINTS, partial(joint, method="arx")),
            "joint_smooth": partial(varying, method="windows"),
            "joint_square": partial(varying, method="windows"),
            "moving_hand": partial(moving, method="mean_difference"),
            "relaxed_joint": partial(relaxed, method="ls"),
            "base_parameters": partial(body, method="ls"),
            "contribution": partial(contribution, formula="ratio"),
            "posture_model": partial(posture, model="polynomial", order=1),
            "emg_model": partial(emg, model="polynomial"),
        },
    }
    for name in HAND.names[1:]:
        made[f"hand-{name}"] = every(HANDS, partial(hand, method=name))
    for name in JOINT.names[1:]:
        made[f"joint-{name}"] = every(JOINTS, partial(joint, method=name))
    for name in VARYING_METHODS.names:
        if name not in ("smoother", "emg"):
            made[f"varying-{name}"] = {"joint_smooth": partial(varying, method=name)}
    for name in CASCADE_METHODS.names[1:]:
        made[f"varying-{name}"] = {"joint_square": partial(varying, method=name)}
    for name in MOVING.names[1:]:
        made[f"moving-{name}"] = {"moving_hand": partial(moving, method=name)}
    for name in RELAXED.names[1:]:
        made[f"relaxed-{name}"] = {"relaxed_joint": partial(relaxed, method=name)}
    for name in BODY.names[1:]:
        made[f"body-{name}"] = {"base_parameters": partial(body, method=name)}
    made["contribution-projection"] = {"contribution": partial(contribution, formula="projection")}
    return made


def main(benchmark: str, out: str, *names: str) -> None:
    """Write the submissions that are named, or all."""
    known = submissions()
    Path(out).mkdir(parents=True, exist_ok=True)
    for name in names or known:
        write_submission(Path(benchmark), Path(out) / f"{name}.csv", known[name])


if __name__ == "__main__":
    main(*sys.argv[1:])
