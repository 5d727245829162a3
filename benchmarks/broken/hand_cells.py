"""`estimate`, `reflex`, `inspect`, `map` and `compare`: the hand on a manipulandum."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd
from broken import damage
from broken.cell import Answer, Cell, Made, Rig, damaged, on_record, said, seed_of
from broken.hand_plant import Hand
from scipy.stats import t as student

from armimpedance.app.inspection import inspect
from armimpedance.core.conventions import element_names, parameter_names
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.comparison.show import compare
from armimpedance.hand.levels.show import to_joint
from armimpedance.hand.still.show import estimate, reflex
from manipulandum_sim.hand import Reflex, Servo, simulate_condition

UNITS = ("units", "plausible")
ELEMENTS = parameter_names(2)


def numbers_of(one: ImpedanceEstimate) -> dict[str, tuple[float, float, float]]:
    """Elements of M, B, K with their limits."""
    half = student.ppf(0.975, one.dof) * one.sd.ravel()
    values = zip(parameter_names(one.k), one.parameters, half, strict=True)
    return {name: (v, v - h, v + h) for name, v, h in values}


def ask_estimate(made: Made) -> Answer:
    """M, B and K of the one condition."""
    (one,) = estimate(made.record)
    return Answer(numbers_of(one), **said(getattr(one, "checks", ()), one.warnings))


def ask_reflex(made: Made) -> Answer:
    """The intrinsic K, and whether a reflex is named."""
    found = reflex(made.record)
    (one,) = found
    d = one.intrinsic.shape[0]
    sd = np.sqrt(np.diag(one.covariance))[d * d : 2 * d * d]
    half = student.ppf(0.975, one.dof) * sd
    values = zip(element_names("K", d), one.intrinsic.ravel(), half, strict=True)
    numbers = {name: (float(v), float(v - h), float(v + h)) for name, v, h in values}
    names = ("reflex",) if one.outcome == "contaminated" else ()
    return Answer(numbers, names, found.warnings)


def ask_inspect(made: Made) -> Answer:
    """What it says: no numbers, so that silence is wrong. A STOP counts as refused."""
    found = inspect(made.record)
    told = said(found.checks)
    stops = [f for f in found.checks if f.verdict == "unusable"]
    return Answer({}, told["names"], refused=stops[0].sentence if stops else "")


def ask_map(made: Made) -> Answer:
    """M, B and K of the joints."""
    (one,) = to_joint(estimate(made.record), recording=made.record)
    return Answer(numbers_of(one), **said(getattr(one, "checks", ()), one.warnings))


def ask_compare(made: Made) -> Answer:
    """The difference of K between two conditions."""
    found = compare(made.record, permutations=99)
    (pair,) = found.pairs
    wanted = {*element_names("M", 2), *element_names("B", 2), *element_names("K", 2)}
    values = {c.quantity: (c.value, c.low, c.high) for c in pair.changes if c.quantity in wanted}
    estimates = (w for group in found.groups for w in group.estimate.warnings)
    sentences = (*pair.notes, *found.warnings, *estimates)
    return Answer(values, **said(getattr(found, "checks", ()), sentences))


@lru_cache(maxsize=2)
def _simulated(
    indices: tuple[int, ...], joint: bool, options: tuple[tuple[str, Any], ...]
) -> list[Made]:
    """The toolkit's manipulandum: all records at once, two sets each."""
    session = {"sets": 2, "emg": False, **dict(options)}
    count = max(indices) + 1
    every, found = simulate_condition(seed=seed_of("hand", 0), repeats=count, **session)
    labels = every.trials["condition"].to_numpy()
    matrices = "M_j B_j K_j" if joint else "M_e B_e K_e"
    values = np.concatenate([getattr(found, name)[0].ravel() for name in matrices.split()])
    truth = dict(zip(ELEMENTS, map(float, values), strict=True))
    return [Made(every.select(np.flatnonzero(labels == f"repeat_{i:03d}")), truth) for i in indices]


def simulated(joint: bool = False, **options: Any) -> Callable[[Sequence[int]], list[Made]]:
    """Records of the toolkit's own subject A."""
    return lambda indices: _simulated(tuple(indices), joint, tuple(options.items()))


def own(hand: Hand | None = None) -> Callable[[Sequence[int]], list[Made]]:
    """Records of our own hand."""
    whose = hand or Hand()
    return lambda indices: [whose.record(i) for i in indices]


def of_reflex(make: Any) -> Any:
    """Only K is judged."""
    return lambda indices: [
        replace(m, truth={k: v for k, v in m.truth.items() if k[0] == "K"}) for m in make(indices)
    ]


def silent(make: Any) -> Any:
    """No number is judged."""
    return lambda indices: [replace(m, truth={}) for m in make(indices)]


def naive_hand(made: Made) -> dict[str, float]:
    """Least squares on smoothed differences over the bumps, offset and ramp removed."""
    from scipy.signal import savgol_filter

    record, sums, right = made.record, np.zeros((6, 6)), np.zeros((6, 2))
    for row, (first, last) in enumerate(zip(record.offsets, record.offsets[1:], strict=False)):
        clock = record.time_s[first:last]
        at = record.trials.iloc[row]
        onset = at.get("onset_s", clock[0])
        inside = (clock >= onset - 0.05) & (clock <= at.get("end_s", clock[-1]) + 0.05)
        x = record.position[first:last]
        parts = [savgol_filter(x, 31, 4, deriv=k, delta=1e-3, axis=0) for k in (2, 1, 0)]
        force = savgol_filter(record.force[first:last], 31, 4, axis=0)
        ramp = np.column_stack([np.ones(inside.sum()), clock[inside]])
        out = np.eye(len(ramp)) - ramp @ np.linalg.pinv(ramp)
        W, y = out @ np.column_stack([p[inside] for p in parts]), out @ force[inside]
        sums += W.T @ W
        right -= W.T @ y
    solved = np.linalg.solve(sums + 1e-12 * np.trace(sums) * np.eye(6), right)
    matrices = solved.reshape(3, 2, 2).transpose(0, 2, 1).copy()
    matrices[0] -= record.handle_mass_kg * np.eye(2)
    return dict(zip(ELEMENTS, matrices.ravel(), strict=True))


BENCH = Rig("estimate", "own hand", own(), ask_estimate, naive_hand)
SUBJECT = Rig("estimate", "manipulandum", simulated(), ask_estimate, naive_hand)
SERVO = Rig("estimate", "soft servo", simulated(servo=Servo(4000.0)), ask_estimate, naive_hand)
REFLEX = Rig("reflex", "own hand", of_reflex(own()), ask_reflex)
REFLEX_SUBJECT = Rig("reflex", "manipulandum", of_reflex(simulated()), ask_reflex)
INSPECT = Rig("inspect", "own hand", silent(own()), ask_inspect)
INSPECT_SUBJECT = Rig("inspect", "manipulandum", silent(simulated()), ask_inspect)
MAP = Rig("map", "manipulandum", simulated(joint=True), ask_map)
TWO = Hand(conditions=("before", "after"), stiffer=(1.0, 1.0))


def two(hand: Hand = TWO) -> Any:
    """Sessions of two conditions; the truth is the difference of their matrices."""

    def make(indices: Sequence[int]) -> list[Made]:
        one = hand.truth
        first, second = hand.stiffer
        parts = {"M": 0.0, "B": np.sqrt(second) - np.sqrt(first), "K": second - first}
        truth = {name: float(parts[name[0]] * value) for name, value in one.items()}
        return [replace(hand.record(i, "compare"), truth=truth) for i in indices]

    return make


COMPARE = Rig("compare", "own hand", two(), ask_compare)
COMPARE_MORE = Rig(
    "compare", "own hand, 20 % stiffer", two(replace(TWO, stiffer=(1.0, 1.2))), ask_compare
)


SESSION_HAND = Hand(sets=4, conditions=("relaxed", "firm"), stiffer=(1.0, 1.5), in_sets=True)


def sessions(hand: Hand = SESSION_HAND, later: Hand | None = None) -> Any:
    """Sessions of two conditions in four sets, or two hands under one name, one after the other."""

    def make(indices: Sequence[int]) -> list[Made]:
        truth = {}
        for name, factor in zip(hand.conditions, hand.stiffer, strict=True):
            parts = {"M": 1.0, "B": np.sqrt(factor), "K": factor}
            truth |= {f"{name} {n}": float(parts[n[0]] * v) for n, v in hand.truth.items()}
        made = [replace(hand.record(i, "session"), truth=truth) for i in indices]
        if later is None:
            return made
        others = [later.record(i, "session, later").record for i in indices]
        pairs = zip(made, others, strict=True)
        return [replace(m, record=followed_by(m.record, other)) for m, other in pairs]

    return make


def followed_by(record: Any, other: Any) -> Any:
    """The second half of the trials is another hand's."""
    middle = record.offsets[record.n_trials // 2]
    both = {
        name: np.concatenate([getattr(record, name)[:middle], getattr(other, name)[middle:]])
        for name in ("position", "force")
    }
    return replace(record, **both)


def ask_session(made: Made) -> Answer:
    """M, B and K of all conditions."""
    found = estimate(made.record)
    numbers = {
        f"{one.keys['condition']} {name}": value
        for one in found
        for name, value in numbers_of(one).items()
    }
    return Answer(numbers, **said((), tuple(w for one in found for w in one.warnings)))


SESSION = Rig("estimate", "own hand, a session", sessions(), ask_session)


def session_cells() -> list[Cell]:
    """A session that changes."""
    changed: list[tuple[str, str, Any]] = [
        ("a gain changes in the middle", "10 %", damage.gain_from("force", 1.1, 0.5)),
        ("a gain changes in the middle", "5 %", damage.gain_from("force", 1.05, 0.5)),
        ("a gain drifts", "10 %", damage.growing_gain("force", 0.1)),
        ("one channel from the middle on", "half its gain",
         damage.gain_from("force", (0.5, 1.0), 0.5)),
        ("one axis in the last set", "sign turned", damage.gain_from("force", (-1.0, 1.0), 0.75)),
    ]  # fmt: skip
    cells = [
        Cell(SESSION, v, size, ("session",), damaged(SESSION, on_record(how)))
        for v, size, how in changed
    ]
    other = replace(SESSION_HAND, heavier=1.1, stiffer=(1.2, 1.8))
    cells.append(
        Cell(SESSION, "two people under one name", "10 % heavier", ("session",),
             sessions(later=other))
    )  # fmt: skip
    exchanged = damaged(SESSION, on_record(damage.labels_exchanged(3)))
    return [*cells, Cell(SESSION, "labels exchanged", "in one set", ("labels",), exchanged)]


def filter_cells() -> list[Cell]:
    """Channels that were filtered before they were saved."""
    force, position = ("force",), ("position",)
    names = ("filter", "delay")
    cells = [
        Cell(BENCH, "force filtered alone", f"{hz:g} Hz, order {order}", names,
             damaged(BENCH, on_record(damage.filtered(hz, order, force, zero_phase=False))))
        for order in (1, 2, 4) for hz in (20.0, 30.0, 50.0, 100.0)
    ]  # fmt: skip
    cells += [
        Cell(BENCH, f"{name[0]} filtered alone", f"{hz:g} Hz without phase", names,
             damaged(BENCH, on_record(damage.filtered(hz, 2, name, zero_phase=True))))
        for name, hz in ((force, 10.0), (force, 20.0), (position, 10.0), (position, 20.0))
    ]  # fmt: skip
    return cells


def alike(hertz: float) -> Any:
    """Clean records whose channels went through one filter of no phase."""
    how = damage.filtered(hertz, 2, ("force", "position"), zero_phase=True)
    return damaged(BENCH, on_record(how))


ALIKE = tuple(
    Rig("estimate", f"own hand, all filtered at {hz:g} Hz", alike(hz), ask_estimate, naive_hand)
    for hz in (8.0, 10.0, 12.0, 15.0, 20.0)
)


def one_long_trial(record: Any, rng: np.random.Generator) -> Any:
    """A reach of 100 mm in 2 s among the bumps."""
    far = Hand(amplitude_m=0.1, duration_s=2.0, returns=False, sets=1)
    one = far.record(int(rng.integers(1000)), "long").record.select([0])
    table = pd.concat([record.trials, one.trials.assign(trial=record.n_trials + 1)])
    both = {
        name: np.concatenate([getattr(record, name), getattr(one, name)])
        for name in ("time_s", "position", "force")
    }
    offsets = [*record.offsets, record.offsets[-1] + one.offsets[-1]]
    return replace(record, trials=table.reset_index(drop=True), offsets=offsets, **both)


def second_half(record: Any, name: str, factor: float) -> Any:
    """A gain that holds for the second condition alone."""
    values = np.array(getattr(record, name))
    values[record.offsets[record.n_trials // 2] :] *= factor
    return replace(record, **{name: values})


def estimate_cells(rig: Rig = BENCH) -> list[Cell]:
    """`estimate` on our own hand, then on the simulated subject."""
    late = ("reflex", "late answer")
    moved = ("disturbance", "returns to start")
    sign = ("force sign", "sign")
    plants: list[tuple[str, str, tuple[str, ...], Hand]] = [
        *(("reflex", f"{100 * p:g} % at 55 ms", late, Hand(reflex=p)) for p in (0.25, 0.5)),
        ("reflex", "to the velocity, 25 ms of K at 40 ms, through a muscle", late,
         Hand(reflex_rate_s=0.025, delay_s=0.04, muscle_s=0.02)),
        *(
            ("somebody pushes back", f"{n:g} N from 120 ms", ("voluntary",),
             Hand(answers_N=n))
            for n in (1.0, 4.0)
        ),
        *(
            ("stiffness grows with the way", f"+ {100 * part:g} % at 5 mm",
             ("amplitude", "curvature"), Hand(cubic=part * 100 / 0.005**2))
            for part in (0.1, 0.5)
        ),
        *(
            ("dry friction in handle or seat", f"{n:g} N", ("friction",),
             Hand(friction_N=n))
            for n in (0.3, 1.0)
        ),
        ("reaches that never return", "100 mm", moved,
         Hand(amplitude_m=0.1, duration_s=0.6, returns=False)),
        ("onsets in the table are off", "20 ms (sd)", ("onset", "onsets", *moved),
         Hand(jitter_s=0.02)),
    ]  # fmt: skip
    records: list[tuple[str, str, tuple[str, ...], Any]] = [
        ("force in mN", "x 1000", UNITS, damage.gain("force", 1000.0)),
        ("force in kgf", "/ 9.81", UNITS, damage.gain("force", 1 / 9.81)),
        ("position in mm", "x 1000", UNITS, damage.gain("position", 1000.0)),
        ("position in cm", "x 100", UNITS, damage.gain("position", 100.0)),
        ("force's sign", "turned", sign, damage.gain("force", -1.0)),
        ("force's sign, one axis", "turned", (*sign, "axes"), damage.gain("force", (1.0, -1.0))),
        ("force's axes swapped", "", ("axes", *sign), damage.swapped_axes("force")),
        ("sensor turned", "20 degrees", ("axes",), damage.turned("force", 20.0)),
        ("sensor turned", "60 degrees", ("axes", *sign), damage.turned("force", 60.0)),
        ("one axis of the sensor", "gain 20 % off", ("axes", "gain"),
         damage.gain("force", (1.0, 1.2))),
        ("force late", "2 ms", ("skew", "delay"), damage.late("force", 0.002)),
        ("force late", "5 ms", ("skew", "delay"), damage.late("force", 0.005)),
        ("force clipped", "at 50 % of its peak", ("clipping",), damage.clipped("force", 0.5)),
        ("force in coarse steps", ".5 N", ("force steps",), damage.quantised("force", 0.5)),
        ("samples lost", "5 %, 20 ms each", ("held",),
         damage.held("position", 0.05, 0.02)),
        ("force sensor drifts", "1 N/s", ("drift",), damage.drifting("force", 1.0)),
        ("hum in the force", ".5 N", ("hum", "noise at rest"), damage.hum("force", 0.5)),
        ("every trial twice", "16 trials", ("copies",), damage.copied),
        ("one long trial among many", "100 mm in 2 s", ("disturbance",), one_long_trial),
        ("handle's mass not told", "164 g", ("handle", "mass", *UNITS),
         damage.told(handle_mass_kg=0.0)),
    ]  # fmt: skip
    cells = [Cell(rig, v, size, names, own(hand)) for v, size, names, hand in plants]
    cells += [
        Cell(rig, v, size, names, damaged(rig, on_record(how))) for v, size, names, how in records
    ]
    blind = damaged(rig, on_record(damage.gain("force", 1.1)))
    cells.append(Cell(rig, "gain of the force", "10 % off", UNITS, blind, seen=False))
    simulated_ones = [
        ("reflex", "25 % at 55 ms", late, simulated(reflex=Reflex(0.25, 0.055))),
        ("disturbance too large", "30 mm", ("amplitude", "curvature"),
         simulated(amplitude_m=0.03)),
        ("disturbance does not return", "1 mm left", moved, simulated(residual_m=0.001)),
    ]  # fmt: skip
    return [*cells, *(Cell(SUBJECT, *one) for one in simulated_ones)]


def other_cells() -> list[Cell]:
    """`reflex`, `inspect`, `map`, `compare`."""
    late = ("reflex",)
    cells = [
        Cell(REFLEX, "reflex", f"{100 * p:g} % at {1e3 * d:g} ms", late,
             of_reflex(own(Hand(reflex=p, delay_s=d))))
        for p, d in ((0.25, 0.055), (0.5, 0.055), (0.25, 0.08))
    ]  # fmt: skip
    cells += [
        Cell(REFLEX, "somebody pushes back", "4 N from 120 ms", (*late, "voluntary"),
             of_reflex(own(Hand(answers_N=4.0)))),
        Cell(REFLEX, "force late", "5 ms", ("skew", "delay"),
             damaged(REFLEX, on_record(damage.late("force", 0.005)))),
        Cell(REFLEX, "stiffness grows with the way", "+ 50 % at 5 mm",
             ("amplitude", "curvature"),
             of_reflex(own(Hand(cubic=50 / 0.005**2)))),
        Cell(REFLEX, "force's sign", "turned", ("force sign",),
             damaged(REFLEX, on_record(damage.gain("force", -1.0)))),
    ]  # fmt: skip
    looked: list[tuple[str, str, tuple[str, ...], Any]] = [
        ("force in mN", "x 1000", UNITS, damage.gain("force", 1000.0)),
        ("force in kgf", "/ 9.81", UNITS, damage.gain("force", 1 / 9.81)),
        ("position in mm", "x 1000", UNITS, damage.gain("position", 1000.0)),
        ("force's sign", "turned", ("force sign",), damage.gain("force", -1.0)),
        ("force's axes swapped", "", ("axes", "force sign"), damage.swapped_axes("force")),
        ("every trial twice", "16 trials", ("copies",), damage.copied),
        ("one long trial among many", "100 mm in 2 s", ("disturbance",), one_long_trial),
        ("force clipped", "at 50 % of its peak", ("clipping",), damage.clipped("force", 0.5)),
        ("samples lost", "5 %, 20 ms each", ("held",),
         damage.held("position", 0.05, 0.02)),
    ]  # fmt: skip
    cells += [
        Cell(INSPECT, v, size, names, damaged(INSPECT, on_record(how)))
        for v, size, names, how in looked
    ]
    reaches = silent(own(Hand(amplitude_m=0.1, duration_s=0.6, returns=False)))
    cells.append(
        Cell(INSPECT, "reaches that never return", "100 mm", ("disturbance", "returns to start"),
             reaches)
    )  # fmt: skip
    mapped: list[tuple[str, str, tuple[str, ...], Any]] = [
        *(
            ("lengths of the arm", f"{100 * p:g} % too long", ("lengths", "reach", "limb"),
             damage.subject(upper_arm_m=1 + p, forearm_hand_m=1 + p))
            for p in (0.03, 0.1)
        ),
        ("shoulder's place", "5 cm off", ("shoulder", "reach", "posture", "lengths"),
         damage.told(shoulder_m=np.array([0.05, 0.0]))),
        ("lengths in cm", "x 100", ("lengths", "units", "reach"),
         damage.subject(upper_arm_m=100, forearm_hand_m=100)),
        ("force in kgf", "/ 9.81", UNITS, damage.gain("force", 1 / 9.81)),
    ]  # fmt: skip
    cells += [
        Cell(MAP, v, size, names, damaged(MAP, on_record(how))) for v, size, names, how in mapped
    ]
    compared: list[tuple[str, str, tuple[str, ...], Any]] = [
        ("force's gain between the conditions", f"{100 * p:g} % more",
         ("gain", "inertia", "session", *UNITS), lambda r, _g, p=p: second_half(r, "force", 1 + p))
        for p in (0.05, 0.3)
    ]  # fmt: skip
    compared += [
        ("every trial twice", "32 trials", ("copies",), damage.copied),
        ("force's sign, second condition", "turned", ("force sign",),
         lambda r, _g: second_half(r, "force", -1.0)),
    ]  # fmt: skip
    return cells + [
        Cell(COMPARE, v, size, names, damaged(COMPARE, on_record(how)))
        for v, size, names, how in compared
    ]


CLEAN = (
    BENCH, SUBJECT, SERVO, REFLEX, REFLEX_SUBJECT, INSPECT, INSPECT_SUBJECT, MAP, COMPARE,
    COMPARE_MORE, SESSION, *ALIKE,
)  # fmt: skip


def cells() -> list[Cell]:
    """All of these commands'."""
    return [*estimate_cells(), *session_cells(), *filter_cells(), *other_cells()]
