"""`elbow`: one joint at an operating point, over time, and over EMG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from broken import damage
from broken.cell import Answer, Cell, Made, Rig, damaged, on_record, said, seed_of
from broken.joint_plant import Bent, Joint, bent, courses, linear, naive_joint

from armimpedance.joint.elbow.show import elbow, elbow_over_time, emg_law
from armimpedance.numerics.regression import NamedParameter
from manipulandum_sim.elbow import simulate_bench, simulate_elbow

CREEPING = Joint(0.07, 3.0, 9.0)
SWINGING = Joint(0.07, 0.6, 20.0)
JOINT = Joint()
IMPOSED = (0.0, 0.0, float("inf"))
HEAVY = (0.25, 3.0, 0.0)


def numbers_of(parameters: Sequence[NamedParameter]) -> dict[str, tuple[float, float, float]]:
    """Value and limits by name."""
    return {p.name: (p.value, *p.ci95) for p in parameters}


def ask_elbow(made: Made) -> Answer:
    """I, B and K; where a reflex may hide, what the warning says that they then would be."""
    fit = elbow(made.record)
    summary = fit.summary
    hides = any(c.name == "reflex" and c.verdict == "cannot tell" for c in summary.checks)
    parameters = fit.allowing if hides and fit.allowing is not None else fit.parameters
    return Answer(numbers_of(list(parameters)), **said(summary.checks, fit.warnings))


def of_simulator(indices: Sequence[int]) -> list[Made]:
    """The toolkit's own bench."""
    truth = {"I": 0.07, "B": 1.2, "K": 20.0}
    made = []
    for i in indices:
        seed = seed_of("bench", i)
        record, _ = simulate_bench(0.07, 1.2, 20.0, duration_s=6.0, snr_db=30.0, seed=seed)
        made.append(Made(record, truth))
    return made


def of_exoskeleton(indices: Sequence[int]) -> list[Made]:
    """A person in the exoskeleton, who is never quite still."""
    made = []
    for i in indices:
        record, truth = simulate_elbow(
            "posture", seed=seed_of("exo", i), repetitions=1, duration_s=10.0
        )
        values = {"I": truth.I, "B": float(truth.B.mean()), "K": float(truth.K.mean())}
        made.append(Made(record, values))
    return made


BENCH = Rig("elbow", "bench", linear(JOINT), ask_elbow, naive_joint)
SLOW = Rig("elbow", "creeping joint", linear(CREEPING), ask_elbow, naive_joint)
QUICK = Rig("elbow", "swinging joint", linear(SWINGING), ask_elbow, naive_joint)
THREE = Rig("elbow", "three trials", linear(replace(JOINT, trials=3)), ask_elbow, naive_joint)
OWN = Rig("elbow", "toolkit's bench", of_simulator, ask_elbow, naive_joint)
EXO = Rig("elbow", "exoskeleton", of_exoskeleton, ask_elbow, naive_joint)


def said_to_impose_the_torque(record: Any, _rng: np.random.Generator) -> Any:
    """A wrong word in recording.json."""
    return replace(record, imposed="torque")


def elbow_cells() -> list[Cell]:
    """At one operating point."""
    cells = []

    def joint(violation: str, size: str, names: tuple[str, ...], rig: Rig = BENCH, **changes: Any):
        base = {BENCH: JOINT, SLOW: CREEPING, QUICK: SWINGING}[rig]
        cells.append(Cell(rig, violation, size, names, linear(replace(base, **changes))))

    def broken(violation: str, size: str, names: tuple[str, ...], how: Any, rig: Rig = BENCH):
        cells.append(Cell(rig, violation, size, names, damaged(rig, on_record(how))))

    late = ("reflex", "late answer")
    for part in (0.1, 0.25, 0.5):
        joint("reflex", f"{100 * part:g} % at 55 ms", late, reflex=part * JOINT.K)
    joint("reflex", "25 % at 55 ms, creeping", late, SLOW, reflex=0.25 * 9)
    joint("reflex", "10 % at 40 ms, creeping", late, SLOW, reflex=0.1 * 9, delay_s=0.04)
    joint("reflex", "25 % at 40 ms, swinging", late, QUICK, reflex=0.25 * 20, delay_s=0.04)
    joint("reflex", "25 % and own torque .15 N m", late, reflex=0.25 * 20, own_Nm=0.15)
    for ms in (10, 20, 40):
        joint("reflex through a muscle", f"25 % at 45 ms, {ms} ms", late,
              reflex=5.0, delay_s=0.045, muscle_s=1e-3 * ms)  # fmt: skip
    joint("reflex through a muscle", "to the velocity, 25 ms", late,
          reflex_rate=0.4, delay_s=0.045, muscle_s=0.025)  # fmt: skip
    cells.append(
        Cell(
            BENCH, "reflex through a muscle", "to rising angles alone, 25 ms", late,
            bent(replace(JOINT, delay_s=0.045, muscle_s=0.025), Bent(one_way=0.8)),
        )
    )  # fmt: skip
    for ms in (0.5, 2.0, -3.0):
        joint("channels out of step", f"{ms:g} ms", ("skew",), late_s=1e-3 * ms)
    for size, cubic in (("weak", 200.0), ("strong", 2000.0)):
        cells.append(
            Cell(
                BENCH, "cubic stiffness", size, ("amplitude", "curvature"),
                bent(JOINT, Bent(cubic=cubic)),
            )
        )  # fmt: skip
    for nm in (0.1, 0.4):
        cells.append(
            Cell(
                BENCH, "dry friction in the joint", f"{nm:g} N m", ("amplitude", "friction"),
                bent(JOINT, Bent(friction=nm)),
            )
        )  # fmt: skip
    for part in (0.2, 0.5):
        cells.append(
            Cell(
                BENCH, "K goes up and down", f"{100 * part:g} %",
                ("varying", "time-varying", "constancy", "amplitude"),
                bent(JOINT, Bent(swing=part)),
            )
        )  # fmt: skip
    servo = ("imposed", "own torque", "voluntary")
    for nm in (0.1, 0.5, 3.0):
        joint("rig imposes the angle", f"own torque {nm:g} N m, no command", servo,
              device=IMPOSED, own_Nm=nm, tells=False)  # fmt: skip
    joint("rig imposes the angle", "own torque .5 N m, command", servo,
          device=IMPOSED, own_Nm=0.5)  # fmt: skip
    for nm in (0.1, 0.3):
        joint("heavy device, nothing recorded", f"own torque {nm:g} N m", servo,
              device=HEAVY, own_Nm=nm, tells=False)  # fmt: skip
    joint("own torque", "1 N m, perturbation recorded", servo, own_Nm=1.0)
    for nm in (0.3, 1.0):
        joint("own torque, nothing recorded", f"{nm:g} N m", servo, own_Nm=nm, tells=False)
    units = ("units", "plausible")
    broken("torque in mNm", "x 1000", units, damage.gain("force", 1000.0))
    cells.append(
        Cell(
            EXO,
            "torque in kgf m",
            "/ 9.81, elbow and body told",
            units,
            damaged(EXO, on_record(damage.gain("force", 1 / 9.81))),
        )
    )
    # Joints differ a thousandfold, wrist to hip: ten times less torque is a smaller joint's.
    cells.append(
        Cell(
            BENCH,
            "torque in kgf m",
            "/ 9.81, nothing told",
            units,
            damaged(BENCH, on_record(damage.gain("force", 1 / 9.81))),
            seen=False,
        )
    )
    cells.append(
        Cell(
            BENCH, "rig imposes the angle", "own torque .5 N m, said to impose the torque", servo,
            damaged(
                Rig("", "", linear(replace(JOINT, device=IMPOSED, own_Nm=0.5, tells=False)),
                    ask_elbow),
                on_record(said_to_impose_the_torque),
            ),
        )
    )  # fmt: skip
    broken("angle in degrees", "x 57", units, damage.gain("position", 180 / np.pi))
    cells.append(
        Cell(
            BENCH, "gain of the torque", "10 % off", units,
            damaged(BENCH, on_record(damage.gain("force", 1.1))), seen=False,
        )
    )  # fmt: skip
    broken("torque's sign", "turned", ("force sign", "torque sign", "sign"),
           damage.gain("force", -1.0))  # fmt: skip
    for part in (0.8, 0.4):
        broken("torque clipped", f"at {100 * part:g} % of its peak", ("clipping", "clipped"),
               damage.clipped("force", part))  # fmt: skip
    for step in (0.002, 0.02):
        broken("angle in coarse steps", f"{step:g} rad", ("position steps", "steps"),
               damage.quantised("position", step))  # fmt: skip
    broken("samples lost", "5 %, 20 ms each", ("dropout", "gaps", "stuck", "held"),
           damage.both(damage.held("position", 0.05, 0.02)))  # fmt: skip
    broken("torque sensor drifts", ".5 N m/s", ("drift",), damage.drifting("force", 0.5))
    broken("hum in the torque", ".5 N m", ("hum",), damage.hum("force", 0.5))
    broken("every trial twice", "3 trials", ("copies",), damage.copied, THREE)
    return cells


#: Times at which the bands are looked at, s.
LOOKED_AT = (2.0, 4.0, 6.0, 8.0)


def ask_course(made: Made) -> Answer:
    """I, and B and K at a few times."""
    course = elbow_over_time(made.record)
    numbers = numbers_of(list(course.parameters))
    half = 1.96
    for at in LOOKED_AT:
        i = int(np.abs(course.time_s - at).argmin())
        for name in "BK":
            value, sd = getattr(course, name)[i], getattr(course, f"sd_{name}")[i]
            numbers[f"{name} at {at:g} s"] = (value, value - half * sd, value + half * sd)
    return Answer(numbers, **said(getattr(course, "checks", ()), course.warnings))


def course_truth(joint: Joint, K: np.ndarray) -> dict[str, float]:
    """What `ask_course` looks at."""
    truth = {"I": joint.I}
    for at in LOOKED_AT:
        truth |= {f"B at {at:g} s": joint.B, f"K at {at:g} s": float(K[round(1000 * at)])}
    return truth


def over_time(joint: Joint, how: Bent | None = None) -> Any:
    """Records with the truth over time."""
    inner = linear(joint) if how is None else bent(joint, how)
    K = courses(joint, how or Bent())
    return lambda indices: [replace(made, truth=course_truth(joint, K)) for made in inner(indices)]


COURSE = Rig("elbow --time-varying", "bench", over_time(JOINT), ask_course)
SWING = Rig("elbow --time-varying", "K swings", over_time(JOINT, Bent(swing=0.3)), ask_course)


def course_cells() -> list[Cell]:
    """Bands over time."""
    own = ("voluntary", "own torque", "imposed")
    shapes: list[tuple[str, str, tuple[str, ...], Any]] = [
        ("own torque", f"{nm:g} N m", own, over_time(replace(JOINT, own_Nm=nm, tells=False)))
        for nm in (0.2, 0.5)
    ]
    shapes += [
        ("own torque and a step of K", ".2 N m, creeping, + 60 %", own,
         over_time(replace(CREEPING, own_Nm=0.2, tells=False), Bent(step=0.6))),
        ("reflex", "25 % at 55 ms", ("reflex", "late answer"),
         over_time(replace(JOINT, reflex=5.0))),
        ("channels out of step", "2 ms", ("skew",),
         over_time(replace(JOINT, late_s=2e-3))),
        ("rig imposes the angle", "own torque .5 N m", own,
         over_time(replace(JOINT, device=IMPOSED, own_Nm=0.5, tells=False))),
        ("cubic stiffness", "strong", ("amplitude", "curvature"),
         over_time(JOINT, Bent(cubic=2000.0))),
        ("angle in degrees", "x 57", ("units", "plausible"),
         damaged(COURSE, on_record(damage.gain("position", 180 / np.pi)))),
    ]  # fmt: skip
    return [Cell(COURSE, *shape) for shape in shapes]


def ask_law(made: Made) -> Answer:
    """Coefficients of the laws of K and B."""
    law = emg_law(made.record)
    numbers = numbers_of([p for one in law.laws for p in one.parameters])
    checks = law.summary.checks
    return Answer(numbers, **said(checks, (*law.warnings,)))


@lru_cache(maxsize=2)
def _sessions(indices: tuple[int, ...], options: tuple[tuple[str, Any], ...]) -> list[Made]:
    made = []
    for i in indices:
        record, truth = simulate_elbow(
            "cocontraction", seed=seed_of("law", i), repetitions=2, duration_s=5.0, **dict(options)
        )
        laws = (("k", truth.stiffness_law), ("b", truth.viscosity_law))
        names = ("{}0", "{}_biceps", "{}_triceps")
        values = {
            name.format(symbol): float(value)
            for symbol, law in laws
            for name, value in zip(names, law, strict=True)
        }
        # the elbow's own weight adds to K whatever the muscles do
        values["k0"] += float((truth.K - truth.K_muscle).mean())
        made.append(Made(record, values))
    return made


def sessions(**options: Any) -> Any:
    """Sessions in the exoskeleton at seven levels of contraction, two trials each."""
    return lambda indices: _sessions(tuple(indices), tuple(options.items()))


LAW = Rig("elbow --emg-law", "exoskeleton", sessions(), ask_law)


def slipping(record: Any, _rng: np.random.Generator) -> Any:
    """The biceps' electrodes slip in the middle of the session: half the gain from there on."""
    emg = np.array(record.emg)
    emg[record.offsets[record.n_trials // 2] :, 0] *= 0.5
    return replace(record, emg=emg)


def law_cells() -> list[Cell]:
    """Laws over EMG."""
    shapes: list[tuple[str, str, tuple[str, ...], Any]] = [
        (
            "crosstalk between the electrodes",
            f"{100 * part:g} %",
            ("crosstalk",),
            damaged(LAW, on_record(damage.mixed("emg", part))),
        )
        for part in (0.1, 0.2, 0.4)
    ]
    shapes += [
        ("K over EMG is bent", "saturating", ("curvature", "lack of fit"),
         sessions(law="saturating")),
        ("hum in the EMG", ".1 mV, not told", ("hum", "EMG hum", "mains"),
         damaged(LAW, on_record(damage.hum("emg", 1e-4)))),
        ("electrodes slip", "gain halves half-way", ("lack of fit", "electrodes", "gain"),
         damaged(LAW, on_record(slipping))),
        ("muscles' names swapped", "", ("muscles", "flexor"),
         damaged(LAW, on_record(damage.swapped_axes("emg")))),
        ("torque in mNm", "x 1000", ("units", "plausible"),
         damaged(LAW, on_record(damage.gain("force", 1000.0)))),
    ]  # fmt: skip
    return [Cell(LAW, *shape) for shape in shapes]


CLEAN = (BENCH, SLOW, QUICK, THREE, OWN, EXO, COURSE, SWING, LAW)


def cells() -> list[Cell]:
    """All of this command's."""
    return [*elbow_cells(), *course_cells(), *law_cells()]
