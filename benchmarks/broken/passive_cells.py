"""`passive`: relaxed joints, filmed as they swing, or moved by a machine that measures torque."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd
from broken import damage
from broken.cell import Answer, Cell, Made, Rig, damaged, on_record, said, seed_of, seeds_of
from broken.elbow_cells import numbers_of
from broken.swing_plant import Forearm

from armimpedance.core.records import Recording, Subject
from armimpedance.joint.relaxed.show import passive
from manipulandum_sim.passive import find_passive_subject, simulate_passive_many
from manipulandum_sim.studio import Studio

ELBOW = "right_elbow_flexion"
NAMES = ("k", "h", "f", "q_r")
MASS = ("mass", "masses", "table")
#: "trials" contradict each other: its message says muscles, or markers that slide.
RELAXED = ("muscles silent", "relaxed", "voluntary", "trials")
CURVE = ("amplitude", "curvature", "quadratic")
LAWS = ("damping", "friction")


def ask_filmed(made: Made) -> Answer:
    """k, h, f, q_r of the elbow; the rest angle is fitted."""
    fits = passive(made.record, joints=[ELBOW], **(made.beside or {}))
    summary = fits.summary
    return Answer(numbers_of(summary.parameters), **said(summary.checks, summary.warnings))


@lru_cache(maxsize=2)
def _filmed(
    indices: tuple[int, ...], test: str, joint: tuple[tuple[str, float], ...], studio: Studio
) -> list[Made]:
    who = find_passive_subject("1")
    if joint:
        who = who.with_joint(ELBOW, **dict(joint))
    seeds = [seed_of("filmed", i) for i in indices]
    longer = {"duration_s": 8.0} if test == "p5" else {}
    every = simulate_passive_many(test, seeds, subject=who, studio=studio, **longer)  # type: ignore[arg-type]
    made = []
    for record, truth in every:
        i = truth.joints.index(ELBOW)
        made.append(Made(record, {name: float(getattr(truth, name)[i]) for name in NAMES}))
    return made


def filmed(
    test: str = "release", studio: Studio | None = None, **joint: float
) -> Callable[[Sequence[int]], list[Made]]:
    """Swings of subject 1, filmed."""
    seen = studio or Studio(0.5e-3)
    return lambda indices: _filmed(tuple(indices), test, tuple(joint.items()), seen)


def heavier(factor: float) -> Callable[[Any, Any], Any]:
    """The skeleton's masses and inertias are not the person's."""

    def change(record: Any, _rng: np.random.Generator) -> Any:
        segments = tuple(
            replace(s, mass_kg=factor * s.mass_kg, inertia_kgm2=factor * s.inertia_kgm2)
            for s in record.skeleton.segments
        )
        return replace(record, skeleton=replace(record.skeleton, segments=segments))

    return change


def rounder(factor: float) -> Callable[[Any, Any], Any]:
    """The skeleton's inertias about the segments' centres are not the person's."""

    def change(record: Any, _rng: np.random.Generator) -> Any:
        segments = tuple(
            replace(s, inertia_kgm2=factor * s.inertia_kgm2) for s in record.skeleton.segments
        )
        return replace(record, skeleton=replace(record.skeleton, segments=segments))

    return change


def y_is_up(record: Any, _rng: np.random.Generator) -> Any:
    """The file's y pointed up, and was read as if z did."""
    x, y, z = np.moveaxis(record.positions, -1, 0)
    return replace(record, positions=np.stack([x, z, -y], axis=-1))


def rate(factor: float) -> Callable[[Any, Any], Any]:
    """The film's rate is another than the file says."""
    return lambda record, _rng: replace(
        record,
        sample_rate_hz=factor * record.sample_rate_hz,
        time_s=np.asarray(record.time_s) / factor,
    )


@dataclass(frozen=True)
class Machine:
    """A motor that swings a relaxed elbow and measures its torque; a plant of our own.

    Attributes
    ----------
    weight_Nm, inertia : float
        What is left in the torque of the limb's weight (times sin q) and inertia.
    own_Nm : float
        Rms of slow torque of a person who does not quite relax.
    help_Nm : float
        Peak of a torque of half a second in every swing.
    late_s : float
        Of the torque.
    quadratic : float
        N m/rad^2, ``K (q - q_r)^2``.
    drag, sticks, bristle_rad : float
        Other laws of damping and friction, as in `swing_plant`.
    """

    k: float = 3.0
    h: float = 0.2
    f: float = 0.15
    q_r: float = 1.4
    weight_Nm: float = 0.0
    inertia: float = 0.0
    own_Nm: float = 0.0
    help_Nm: float = 0.0
    late_s: float = 0.0
    quadratic: float = 0.0
    drag: float = 0.0
    sticks: float = 0.0
    bristle_rad: float = 0.0

    def record(self, index: int) -> Made:
        """Three swings of 10 s at 100 Hz."""
        rng = seeds_of("machine", index)
        n, trials, hertz = 1000, 3, 100.0
        t = np.arange(n) / hertz
        position, torque = [], []
        for _ in range(trials):
            slow, quick = rng.uniform(0.15, 0.25), rng.uniform(0.5, 0.7)
            phases = rng.uniform(0, 2 * np.pi, 2)

            def at(clock: np.ndarray, s: float = slow, p: float = quick, o: Any = phases) -> Any:
                parts = [(0.5, 2 * np.pi * s, o[0]), (0.12, 2 * np.pi * p, o[1])]
                q = 1.5 + sum(a * np.sin(w * clock + c) for a, w, c in parts)
                v = sum(a * w * np.cos(w * clock + c) for a, w, c in parts)
                acc = sum(-a * w * w * np.sin(w * clock + c) for a, w, c in parts)
                return q, v, acc

            q, v, acc = at(t - self.late_s)
            way = q - self.q_r
            tau = self.k * way + self.quadratic * way**2 + self.h * v
            tau = tau + self.drag * np.abs(v) * v + self.f * self._sign(v, hertz)
            tau = tau + self.weight_Nm * np.sin(q) + self.inertia * acc
            own = np.cumsum(rng.standard_normal(n)) * 0.05
            tau = tau + self.own_Nm * (own - own.mean()) / own.std()
            bump = np.clip((t - rng.uniform(1.0, 8.0)) / 0.5, 0, 1)
            tau = tau + self.help_Nm * rng.choice([-1.0, 1.0]) * np.sin(np.pi * bump) ** 2
            position.append(at(t)[0] + 2e-4 * rng.standard_normal(n))
            torque.append(tau + 0.03 * rng.standard_normal(n))
        record = Recording(
            kind="joint",
            sample_rate_hz=hertz,
            trials=pd.DataFrame({"trial": range(1, trials + 1), "condition": "swing"}),
            offsets=n * np.arange(trials + 1),
            time_s=np.tile(t, trials),
            position=np.concatenate(position)[:, None],
            force=np.concatenate(torque)[:, None],
            subject=Subject("own elbow", 70.0, 1.75, 0.31, 0.35),
        )
        return Made(record, {name: getattr(self, name) for name in NAMES})

    def _sign(self, v: np.ndarray, hertz: float) -> np.ndarray:
        """The law of dry friction along a velocity (n,)."""
        if not self.bristle_rad:
            return np.sign(v) * (1 + self.sticks * np.exp(-np.abs(v) / 0.1))
        bent = np.full(len(v), np.sign(v[0]))
        for i, speed in enumerate(v[:-1]):
            # z' = v - |v| z / z_s, exact for a velocity that is held
            end, way = np.sign(speed), np.abs(speed) / hertz / self.bristle_rad
            bent[i + 1] = end + (bent[i] - end) * np.exp(-way)
        return bent


def machine(how: Machine | None = None) -> Callable[[Sequence[int]], list[Made]]:
    """Records of the machine."""
    whose = how or Machine()
    return lambda indices: [whose.record(i) for i in indices]


def ask_machine(made: Made) -> Answer:
    """k, h, f, q_r of the only joint."""
    summary = passive(made.record).summary
    return Answer(numbers_of(summary.parameters), **said(summary.checks, summary.warnings))


def forearm(how: Forearm | None = None) -> Callable[[Sequence[int]], list[Made]]:
    """Swings of a plant of our own."""
    whose = how or Forearm()
    return lambda indices: [whose.record(i) for i in indices]


SWING = Rig("passive", "filmed swings", filmed(), ask_filmed)
SHAKEN = Rig("passive", "filmed, upper arm shaken", filmed("p5"), ask_filmed)
OWN = Rig("passive", "forearm let go", forearm(), ask_filmed)
MACHINE = Rig("passive", "machine", machine(), ask_machine)


def told_rest(error: float) -> Callable[[Made, np.random.Generator], Made]:
    """The rest angle is told, and wrong."""
    return lambda made, _rng: Made(
        made.record,
        {k: v for k, v in made.truth.items() if k != "q_r"},
        {"rest_angle": made.truth["q_r"] + error},
    )


def cells() -> list[Cell]:
    """All of this command's."""
    filmed_ones: list[tuple[str, str, tuple[str, ...], Any]] = [
        *(
            ("masses of the limb", f"{100 * (p - 1):+.0f} %", MASS,
             damaged(SWING, on_record(heavier(p))))
            for p in (1.05, 0.85)
        ),
        *(
            ("film's rate", size, ("time",), damaged(SWING, on_record(rate(p))))
            for size, p in (("20 % too high", 1.2), ("5 % too low", 0.95))
        ),
        ("segment's inertia", "50 % too large", ("inertia",),
         damaged(SWING, on_record(rounder(1.5)))),
        ("rest angle told", ".1 rad off", ("rest angle",), damaged(SWING, told_rest(0.1))),
        ("skin moves over the bones", "10 mm", ("soft tissue", "markers", "trials"),
         filmed(studio=Studio(0.5e-3, 10e-3))),
        ("stiffness is not linear", "K .8 N m/rad^2", CURVE,
         filmed(K=0.8)),
        ("markers lost", "10 % of the frames", ("markers", "dropout", "gaps"),
         filmed(studio=Studio(0.5e-3, 0.0, 0.1))),
        ("axes of the file", "y up, read as z up", ("up axis",),
         damaged(SWING, on_record(y_is_up))),
        ("markers in mm", "x 1000", ("units", "markers"),
         damaged(SWING, on_record(damage.gain("positions", 1000.0)))),
    ]  # fmt: skip
    machined: list[tuple[str, str, tuple[str, ...], Any]] = [
        *(
            ("limb's weight left in the torque", f"{n:g} N m", ("weight",),
             machine(Machine(weight_Nm=n)))
            for n in (0.5, 2.0)
        ),
        *(
            ("limb's inertia left in the torque", f"{n:g} kg m^2", ("inertia",),
             machine(Machine(inertia=n)))
            for n in (0.01, 0.07)
        ),
        *(
            ("person does not relax", f"{n:g} N m", RELAXED, machine(Machine(own_Nm=n)))
            for n in (0.2, 1.0)
        ),
        ("person helps for .5 s", ".2 N m", RELAXED, machine(Machine(help_Nm=0.2))),
        *(
            ("torque late", f"{n:g} ms", ("skew",), machine(Machine(late_s=n / 1e3)))
            for n in (5, 50)
        ),
        ("stiffness is not linear", "K .8 N m/rad^2", CURVE,
         machine(Machine(quadratic=0.8))),
        *(
            ("damping by the square of the velocity", f"{n:g} N m s^2/rad^2", LAWS,
             machine(Machine(drag=n)))
            for n in (0.05, 0.2)
        ),
        *(
            ("joint sticks", f"{100 * n:g} % more at rest", LAWS, machine(Machine(sticks=n)))
            for n in (0.5, 2.0)
        ),
        *(
            ("joint yields like muscle", f"over {n:g} rad", LAWS, machine(Machine(bristle_rad=n)))
            for n in (0.05, 0.2)
        ),
        ("a gain changes in the middle", "10 %", ("trials",),
         damaged(MACHINE, on_record(damage.gain_from("force", 1.1, 0.5)))),
        ("a gain drifts", "10 %", ("trials",),
         damaged(MACHINE, on_record(damage.growing_gain("force", 0.1)))),
        ("angle in degrees", "x 57", ("units", "degrees"),
         damaged(MACHINE, on_record(damage.gain("position", 180 / np.pi)))),
        ("torque in mNm", "x 1000", ("units", "plausible"),
         damaged(MACHINE, on_record(damage.gain("force", 1000.0)))),
        ("every trial twice", "3 trials", ("copies",), damaged(MACHINE, on_record(damage.copied))),
    ]  # fmt: skip
    own = [
        Cell(OWN, "person helps for .5 s", f"{n:g} N m", RELAXED, forearm(Forearm(own_Nm=n)))
        for n in (0.1, 0.3)
    ]
    laws = [
        *((LAWS, f"{n:g} N m s^2/rad^2", Forearm(drag=n)) for n in (0.005, 0.03)),
        *((LAWS, f"{100 * n:g} % more at rest", Forearm(sticks=n)) for n in (1.0, 4.0)),
        *((LAWS, f"yields over {n:g} rad", Forearm(bristle_rad=n)) for n in (0.05, 0.2)),
    ]
    own += [
        Cell(OWN, "another law of damping or friction", size, names, forearm(how))
        for names, size, how in laws
    ]
    return [
        *own,
        *(Cell(SWING, *one) for one in filmed_ones),
        *(Cell(MACHINE, *one) for one in machined),
    ]


CLEAN = (SWING, SHAKEN, OWN, MACHINE)
