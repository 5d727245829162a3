"""A robot pushes the hand of a simulated subject (Tsuji 1997)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.lab.simulate_study.fields import (
    Field,
    Settings,
    names_or_all,
    number,
    number_or,
    one_of,
    whole,
)
from armimpedance.lab.simulate_study.hand_numbers import (
    ESTIMATOR,
    EXTRAS,
    QUANTITIES,
    PreparedWindows,
    estimate_all,
    shortcut,
)
from armimpedance.lab.simulate_study.rig import BLOCK, Rig, Seeds

if TYPE_CHECKING:
    from manipulandum_sim.hand import Condition

#: The relaxed arm in the nominal posture; no experiment of the source.
NOMINAL: Final = "nominal"


def _experiments() -> Iterable[str]:
    from manipulandum_sim.hand import EXPERIMENTS

    return (NOMINAL, *EXPERIMENTS)


def _subjects() -> Iterable[str]:
    from manipulandum_sim.hand import SUBJECTS

    return SUBJECTS


def _noise() -> Iterable[str]:
    return ("nominal", "sensor", "none")


def _integrators() -> Iterable[str]:
    return ("numpy", "compiled")


def _disturbances() -> Iterable[str]:
    from manipulandum_sim.hand import DISTURBANCES

    return DISTURBANCES


def _known(settings: Settings) -> dict[str, Condition]:
    from manipulandum_sim.hand import Condition, find_experiment, find_subject, nominal_hand

    person = find_subject(str(settings["subject"]))
    if settings["experiment"] == NOMINAL:
        return {NOMINAL: Condition(NOMINAL, nominal_hand(person))}
    plan = find_experiment(str(settings["experiment"]))
    return {condition.name: condition for condition in plan.conditions(person)}


def _conditions(settings: Settings) -> tuple[str, ...]:
    from manipulandum_sim.hand import Rig as Manipulandum

    known, asked = _known(settings), settings["conditions"]
    for name in asked if isinstance(asked, tuple) else ():
        if name not in known:
            raise InputError(
                f"conditions: unknown {name!r} of experiment {settings['experiment']}",
                expected=f"among {', '.join(known)}",
            )
    # the workers are silent: whatever speaks against a disturbance is said here
    Manipulandum(**_manipulandum(settings)).shape.warn()
    return asked if isinstance(asked, tuple) else tuple(known)


def _manipulandum(settings: Settings) -> dict[str, Any]:
    """Fields of the simulator's rig."""
    from manipulandum_sim.hand import IDEAL, Reflex, Servo

    servo, reflex = settings["servo"], settings["reflex"]
    return {
        "noise": settings["noise"],
        "disturbance": settings["disturbance"],
        "amplitude_m": settings["amplitude_m"],
        "duration_s": settings["duration_s"],
        "servo": IDEAL if servo == "ideal" else Servo(float(servo)),  # type: ignore[arg-type]
        "reflex": Reflex(float(reflex)) if reflex else None,  # type: ignore[arg-type]
        "emg": False,
        "compiled": settings["integrator"] == "compiled",
    }


def _simulate(settings: Settings, seeds: Seeds, sessions: range) -> list[PreparedWindows]:
    """Each condition with all sessions side by side, which is many times as fast as one by one."""
    from armimpedance.hand.still import Group, groups_of
    from armimpedance.numerics.signals import cut_windows
    from manipulandum_sim.hand import simulate_condition

    known = _known(settings)
    made = []
    for name in _conditions(settings):
        recording, truth = simulate_condition(
            known[name],
            seed=seeds.of(list(known).index(name), sessions.start // BLOCK),
            subject=str(settings["subject"]),
            repeats=len(sessions),
            sets=int(settings["sets"]),  # type: ignore[arg-type]
            **_manipulandum(settings),
        )
        true = np.stack([truth.M_e[0], truth.B_e[0], truth.K_e[0]])
        windows = [cut_windows(recording, rows) for _, rows in groups_of(recording, ["condition"])]
        made.append(PreparedWindows(windows, Group.of(recording, {"condition": name}), true))
    return made


RIG: Final = Rig(
    line="a robot pushes the hand: inertia, viscosity, stiffness and their ellipses",
    fields=(
        Field("experiment", NOMINAL, one_of(_experiments)),
        Field("conditions", None, names_or_all),
        Field("subject", "A", one_of(_subjects)),
        Field("noise", "nominal", one_of(_noise)),
        Field("sets", 5, whole(1, 1000)),
        Field("disturbance", "minimum_jerk", one_of(_disturbances)),
        Field("amplitude_m", 0.005, number(1e-4, 0.05)),
        Field("duration_s", 0.3, number(0.02, 5)),
        Field("servo", 20_000.0, number_or("ideal", 100, 1e6)),
        Field("reflex", 0.0, number(0, 5)),
        Field("integrator", "numpy", one_of(_integrators)),
        *ESTIMATOR,
    ),
    quantities=QUANTITIES,
    extras=EXTRAS,
    conditions=_conditions,
    simulate=_simulate,
    estimate=estimate_all,
    shortcut=shortcut,
)
