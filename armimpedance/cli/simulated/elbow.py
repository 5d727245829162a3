"""The elbow in a powered exoskeleton behind `armimpedance simulate`."""

from __future__ import annotations

import argparse
from typing import Final

from armimpedance.errors import InputError

#: Options of other rigs, and what they are when nobody gives them.
_OTHERS_ONLY: Final = {
    "disturbance": "minimum_jerk",
    "amplitude_mm": 5.0,
    "servo": None,
    "reflex": None,
    "markers": False,
}
#: Options of this rig alone.
_OWN: Final = {"commanded": False, "perturbation": None, "frequency_hz": None, "law": None}


def refuse_elbow_options(arguments: argparse.Namespace) -> None:
    """Refuse this rig's options with another one.

    Raises
    ------
    InputError
    """
    for name, default in _OWN.items():
        if getattr(arguments, name) != default:
            raise InputError(_given(name, arguments), expected="it with an elbow test")


def simulate_elbow_test(arguments: argparse.Namespace, test: str) -> int:
    """Simulate, write recording and truth, say what is there."""
    from armimpedance.cli.inspect import describe
    from armimpedance.cli.parts.progress import bar
    from armimpedance.cli.simulate import SETS, write_simulated
    from manipulandum_sim.elbow import simulate_elbow

    for name, default in _OTHERS_ONLY.items():
        if getattr(arguments, name) != default:
            raise InputError(_given(name, arguments), expected="an experiment that has it")
    if test != "varying" and arguments.frequency_hz is not None:
        raise InputError(_given("frequency_hz", arguments), expected="it with elbow-varying")
    own = {"frequency_hz": arguments.frequency_hz, "law": arguments.law}
    own |= {"perturbation": arguments.perturbation, "duration_s": arguments.duration_s}
    given = {name: value for name, value in own.items() if value is not None}
    with bar("simulating") as progress:
        recording, truth = simulate_elbow(
            test,  # type: ignore[arg-type]
            subject=arguments.subject or "1",
            seed=arguments.seed,
            repetitions=SETS if arguments.sets is None else arguments.sets,
            noise=arguments.noise,
            torque="commanded" if arguments.commanded else "interaction",
            progress=progress,
            **given,
        )
    write_simulated(recording, truth, arguments.out, arguments.table)
    print(describe(recording, str(arguments.out)))
    return 0


def _given(name: str, arguments: argparse.Namespace) -> str:
    return f"--{name.replace('_', '-')} with {arguments.experiment}"
