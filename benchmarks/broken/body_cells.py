"""`body`: base parameters of a person on two force plates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from broken import damage
from broken.cell import Answer, Cell, Made, Rig, damaged, on_record, said, seed_of
from broken.elbow_cells import numbers_of

from armimpedance.joint.body import essential_base_parameters
from armimpedance.joint.body.show import body
from manipulandum_sim.body import simulate_body

#: Motions of a record: enough to show all 128 parameters.
MOTIONS = ("walk", "all_joints")
PLATES = ("plates", "plate", "wrenches", "moments", "weight")


def ask(method: str) -> Callable[[Made], Answer]:
    """Base parameters by a method; all motions are fitted."""

    def run(made: Made) -> Answer:
        fit = body(made.record, method=method, motions=None, noise_draws=2)
        checks = fit.summary.checks
        return Answer(numbers_of(list(fit.parameters)), **said(checks, fit.warnings))

    return run


@lru_cache(maxsize=1)
def _recorded(indices: tuple[int, ...]) -> list[Made]:
    made = []
    for i in indices:
        record, truth = simulate_body(MOTIONS, seed=seed_of("body", i), angle_noise_rad=1e-3)
        base = essential_base_parameters(record.skeleton)
        values = base.of(np.ravel(truth.parameters))
        made.append(Made(record, dict(zip(base.names, map(float, values), strict=True))))
    return made


def recorded(indices: Sequence[int]) -> list[Made]:
    """Subject A walks and moves all joints."""
    return _recorded(tuple(indices))


FREE = Rig("body", "two plates", recorded, ask("weighted"))
PRIOR = Rig("body", "two plates, prior", recorded, ask("prior"))


def origins(shift_m: float) -> Callable[[Any, Any], Any]:
    """The second plate is not where the file says."""

    def change(record: Any, _rng: np.random.Generator) -> Any:
        places = np.array(record.plate_origins_m)
        places[1, 0] += shift_m
        return replace(record, plate_origins_m=places)

    return change


def table(factor: float) -> Callable[[Any, Any], Any]:
    """The table's arms and legs are too heavy, its trunk too light: the whole weighs the same."""

    def change(record: Any, _rng: np.random.Generator) -> Any:
        skeleton = record.skeleton
        limbs = [s for s in skeleton.segments if not _of_trunk(s.name)]
        more = (factor - 1) * sum(s.mass_kg for s in limbs)
        trunk = sum(s.mass_kg for s in skeleton.segments) - sum(s.mass_kg for s in limbs)
        segments = []
        for s in skeleton.segments:
            part = 1 - more / trunk if _of_trunk(s.name) else factor
            segments.append(
                replace(s, mass_kg=part * s.mass_kg, inertia_kgm2=part * s.inertia_kgm2)
            )
        return replace(record, skeleton=replace(skeleton, segments=tuple(segments)))

    return change


def _of_trunk(name: str) -> bool:
    return any(
        part in name
        for part in ("pelvis", "trunk", "thorax", "abdomen", "torso", "head", "chest", "lumbar")
    )


def tilted(degrees: float) -> Callable[[Any, Any], Any]:
    """The plates' frame is turned about the vertical."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    def change(record: Any, _rng: np.random.Generator) -> Any:
        w = np.array(record.wrenches)
        w[..., :3], w[..., 3:] = w[..., :3] @ turn.T, w[..., 3:] @ turn.T
        return replace(record, wrenches=w)

    return change


def late(delay_s: float) -> Callable[[Any, Any], Any]:
    """The plates come late."""

    def change(record: Any, _rng: np.random.Generator) -> Any:
        w = np.array(record.wrenches)
        for first, last in zip(record.offsets, record.offsets[1:], strict=False):
            clock = np.arange(last - first) / record.sample_rate_hz
            flat = w[first:last].reshape(last - first, -1)
            for c in range(flat.shape[1]):
                flat[:, c] = np.interp(clock - delay_s, clock, flat[:, c])
            w[first:last] = flat.reshape(w[first:last].shape)
        return replace(record, wrenches=w)

    return change


def cells() -> list[Cell]:
    """All of this command's."""
    on_prior: list[tuple[str, str, tuple[str, ...], Any]] = [
        ("table of masses", f"limbs {100 * (p - 1):+.0f} %", ("table", "prior"), table(p))
        for p in (1.35, 1.53)
    ]
    free: list[tuple[str, str, tuple[str, ...], Any]] = [
        ("plate's place", "2 cm off", PLATES, origins(0.02)),
        ("plate's place", "10 cm off", PLATES, origins(0.1)),
        ("plates' gain", "5 % more", PLATES, damage.gain("wrenches", 1.05)),
        ("plates in kgf", "/ 9.81", (*PLATES, "units"), damage.gain("wrenches", 1 / 9.81)),
        ("plates late", "20 ms", ("skew", "delay", *PLATES), late(0.02)),
        ("plates' frame turned", "5 degrees", ("axes", "frame", *PLATES), tilted(5.0)),
        ("angles in degrees", "x 57", ("units",), damage.gain("coordinates", 180 / np.pi)),
    ]
    return [
        *(Cell(PRIOR, v, s, n, damaged(PRIOR, on_record(how))) for v, s, n, how in on_prior),
        *(Cell(FREE, v, s, n, damaged(FREE, on_record(how))) for v, s, n, how in free),
    ]


CLEAN = (FREE, PRIOR)
