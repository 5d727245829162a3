"""Tasks: drawn people, their truth, their recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.lab.benchmark import AskedGroup

if TYPE_CHECKING:
    from collections.abc import Callable

    from armimpedance.recordings import AnyRecording
    from manipulandum_sim.hand import SimulatedSubject, Truth


def _nothing(_folder: Path) -> None:
    """No files beside the recordings."""


@dataclass(frozen=True)
class Made:
    """One record of a task.

    `groups`: what is asked, with its truth.
    `recordings`: -> name of the folder -> recording; simulated only when they are asked for.
    `beside`: writes further files into the record's folder.
    `body_told`: whether the recordings tell the person's mass and height: where the limb's inertia
    is asked they would give the answer, to the last digit; of a person they do not.
    """

    groups: tuple[AskedGroup, ...]
    recordings: Callable[[], Mapping[str, AnyRecording]]
    beside: Callable[[Path], None] = _nothing
    body_told: bool = False


@dataclass(frozen=True)
class Task:
    """A task.

    `line`: what it is, in one sentence.
    `asks`: what is asked, and what may be known, for its README.
    `draw`: a seed -> Made. Everything that is true of a record hangs on its seed: subjects that are
    built in would be known to everybody.
    `share`: writes into the task's folder what is the same for all records.
    """

    line: str
    asks: str
    draw: Callable[[int], Made] = field(repr=False)
    share: Callable[[Path], None] = _nothing


def nameless(recording: Any, body_told: bool) -> Any:
    """A recording that tells neither its seed nor how it was simulated, as a laboratory's."""
    subject = recording.subject
    if subject is not None:
        hidden = {} if body_told else {"mass_kg": None, "height_m": None}
        subject = replace(subject, id="person", **hidden)
    return replace(recording, provenance=("armimpedance benchmark",), subject=subject)


# Persons whose hand is pushed and brought back: a drawn arm, a drawn posture, a drawn activity.

ASKS = """
In a record lies `recording`: 24 pushes of the hand by 5 mm and back within .3 s, in eight
directions, sampled at 1 kHz; columns of `samples`: trial, time_s, x_m, y_m (hand from the shoulder,
which is the origin), fx_N, fy_N (force **by the hand on the handle**), q_shoulder_rad, q_elbow_rad.
`trials.csv` has each push's onset and end. Noise is that of sensors and of a person: tremor, slow
voluntary force, drift.

Asked, at the hand: inertia M, viscosity B, stiffness K of the limb itself, `F = -M a - B v - K x`
for small departures; `K_12` is the force along x per way along y. `handle_mass_kg` in
`recording.json` stands between sensor and hand and is not the limb's.
"""
SETS = 3


def drawn_person(rng: np.random.Generator) -> SimulatedSubject:
    """A person of 1.55 to 1.95 m, 50 to 95 kg, whose strength is not told by either."""
    from manipulandum_sim.hand import SimulatedSubject

    height = rng.uniform(1.55, 1.95)
    upper, lower = height * np.array([0.1765, 0.2]) * rng.uniform(0.97, 1.03, 2)
    mass, strength = rng.uniform(50, 95), rng.uniform(0.7, 1.4)
    return SimulatedSubject("person", mass, height, float(upper), float(lower), strength)


def pushed(rig: Callable[[np.random.Generator], dict[str, Any]]) -> Callable[[int], Made]:
    """Return a function that draws a record of pushes.

    `rig`: a generator -> fields of the simulator's rig.
    """

    def draw(seed: int) -> Made:
        from manipulandum_sim.hand import (
            Arm,
            Condition,
            find_truth,
            nominal_hand,
            simulate_condition,
        )

        rng = np.random.default_rng(seed)
        person, fields = drawn_person(rng), rig(rng)
        hand = np.array(nominal_hand(person)) + rng.uniform(-0.06, 0.06, 2)
        condition = Condition("pushed", (hand[0], hand[1]), cocontraction=rng.uniform(0.02, 0.25))
        truth = find_truth(Arm.of(person), [condition], handle_mass_kg=0.0)

        def recordings() -> dict[str, Any]:
            made, _ = simulate_condition(
                condition, seed=seed, subject=person, sets=SETS, emg=False, **fields
            )
            return {"recording": made}

        return Made(matrices(truth, 0), recordings)

    return draw


def matrices(truth: Truth, row: int) -> tuple[AskedGroup, ...]:
    """M, B, K at the hand of one condition."""
    return (
        AskedGroup.matrix("M", "kg", truth.M_e[row]),
        AskedGroup.matrix("B", "N s/m", truth.B_e[row]),
        AskedGroup.matrix("K", "N/m", truth.K_e[row]),
    )


# A drawn joint: inertia, viscosity, stiffness of a human elbow or ankle, told to nobody.

UNITS = {"I": "kg m^2", "B": "N m s/rad", "K": "N m/rad", "G": "N m s/rad"}
COLUMNS = """
Columns of `samples`: trial, time_s, q1_rad, tau1_Nm (torque **by the limb on the device**, so the
one on the limb is its negative); further columns of the device are named in `samples` itself.
"""


@dataclass(frozen=True)
class DrawnJoint:
    """I (kg m^2), B (N m s/rad), K (N m/rad) of a joint that swings at 1.5 to 4 Hz, half damped."""

    I: float  # noqa: E741
    B: float
    K: float

    @classmethod
    def of(cls, rng: np.random.Generator) -> DrawnJoint:
        """A joint of that kind."""
        inertia, own_hz, damping = (
            rng.uniform(0.05, 0.12),
            rng.uniform(1.5, 4.0),
            rng.uniform(0.2, 0.6),
        )
        omega = 2 * np.pi * own_hz
        return cls(inertia, 2 * damping * omega * inertia, omega**2 * inertia)

    @property
    def groups(self) -> tuple[AskedGroup, ...]:
        """I, B, K, each a group of its own."""
        return tuple(scalar(name, getattr(self, name)) for name in "IBK")


def scalar(name: str, value: float) -> AskedGroup:
    """One number of a joint."""
    return AskedGroup(name, UNITS[name], {name: value})
