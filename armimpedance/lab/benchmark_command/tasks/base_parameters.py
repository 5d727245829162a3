"""Masses and inertias of a moving body, as far as motion and contact forces show them."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark import AskedGroup
from armimpedance.lab.benchmark_command.task import Made, Task

_GROUPS: Final = {"kg": "mass", "kg m": "first moment", "kg m^2": "inertia"}
_HEIGHT_M: Final = 1.741
#: As `BodyTruth.parameters` has them.
_OF_A_SEGMENT: Final = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")


@cache
def _base() -> Any:
    """`BaseParameters` of the root's wrench; the same bones for all, so the same for all."""
    from armimpedance.joint.body import essential_base_parameters
    from manipulandum_sim.body import body_subject

    return essential_base_parameters(body_subject("person", 70.0, _HEIGHT_M).table_skeleton)


def _draw(seed: int) -> Made:
    from manipulandum_sim.body import body_subject, simulate_body

    rng = np.random.default_rng(seed)
    mass, own = rng.uniform(50, 95), int(rng.integers(2**31))
    person = body_subject("person", mass, _HEIGHT_M, seed=own)
    motions = ("all_joints", "walk", "all_joints")
    recording, truth = simulate_body(motions, subject=person, seed=seed)
    base = _base()
    values = base.of(truth.parameters.ravel())

    def group(unit: str) -> AskedGroup:
        named = zip(base.names, base.units, values, strict=True)
        return AskedGroup(_GROUPS[unit], unit, {n: float(v) for n, u, v in named if u == unit})

    def recordings() -> dict[str, Any]:
        return {"recording": recording}

    groups = tuple(group(unit) for unit in _GROUPS if unit in base.units)
    return Made(groups, recordings, body_told=True)


def _share(folder: Path) -> None:
    """Which combinations are asked, as coefficients of the segments' own parameters."""
    from manipulandum_sim.body import body_subject

    base = _base()
    segments = [s.name for s in body_subject("person", 70.0, _HEIGHT_M).skeleton.segments]
    columns = [(segment, name) for segment in segments for name in _OF_A_SEGMENT]
    with (folder / "combinations.csv").open("w", newline="", encoding="utf-8") as stream:
        rows = csv.writer(stream, lineterminator="\n")
        rows.writerow(["quantity", "segment", "parameter", "coefficient"])
        for name, row in zip(base.names, base.mapping, strict=True):
            for column in np.flatnonzero(np.abs(row) > 1e-9):
                rows.writerow([name, *columns[column], f"{row[column]:.12g}"])


TASK: Final = Task(
    line="A body moves on two force plates: the combinations of masses and inertias that show.",
    asks="""
In a record lies `recording`: three motions of a person at 100 Hz, coordinates of a skeleton and the
wrenches of two force plates; the skeleton has the person's bones and the masses of a table, which
are not the person's. `combinations.csv` says what is asked, as sums of coefficients times the
segments' own parameters (m in kg; mx, my, mz: mass times centre, kg m; Ixx ... Izz about the
segment's origin, kg m^2): the base parameters of the root's wrench. Any set of parameters that
predicts the wrench gives the same sums.
""",
    draw=_draw,
    share=_share,
)
