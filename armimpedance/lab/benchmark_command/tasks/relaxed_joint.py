"""A relaxed elbow that is filmed while it swings."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark import AskedGroup
from armimpedance.lab.benchmark_command.task import Made, Task

_UNITS: Final = {"k": "N m/rad", "h": "N m s/rad", "f": "N m"}


def _draw(seed: int) -> Made:
    from manipulandum_sim.passive import ELBOW, PASSIVE_SUBJECTS, passive_subject

    rng = np.random.default_rng(seed)
    low, high = np.array([[1.5, 0.015, 0.0, 1.3], [4.5, 0.06, 0.03, 1.6]])
    k, h, f, rest = (float(v) for v in rng.uniform(low, high))
    elbow = replace(PASSIVE_SUBJECTS["1"].joints[ELBOW], k=k, h=h, f=f, q_r=rest)
    person = passive_subject("person", rng.uniform(50, 95), rng.uniform(1.55, 1.95), elbow)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.passive import simulate_passive

        made, _ = simulate_passive("p5", subject=person, seed=seed, duration_s=15.0)
        return {"recording": made}

    def tell(folder: Path) -> None:
        (folder / "told.json").write_text(json.dumps({"rest_angle_rad": round(rest, 6)}) + "\n")

    values = {"k": k, "h": h, "f": f}
    groups = tuple(AskedGroup(n, _UNITS[n], {n: v}) for n, v in values.items())
    return Made(groups, recordings, tell, body_told=True)


TASK: Final = Task(
    line="The elbow of a relaxed arm that is filmed while the shoulder is pushed about.",
    asks="""
In a record lies `recording`: markers on trunk and right arm at 30 Hz, 15 s, noise of .5 mm, with
the skeleton that they sit on (masses, centres, inertias after the person's mass and height), and
`told.json` with the rest angle q_r. Asked of `right_elbow_flexion`: stiffness k, viscosity h and
dry friction f of the relaxed joint, `tau = -(k (q - q_r) + h q' + f sign(q'))`.
""",
    draw=_draw,
)
