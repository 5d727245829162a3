"""The manipulandum in a closed loop: `next` chooses each push by what the last ones gave."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.progress import Progress
from armimpedance.lab.parts.simulation import Simulated, SimulatedRig
from armimpedance.lab.simulated.hand import servo_asked

if TYPE_CHECKING:
    from armimpedance.core.records import Recording
    from armimpedance.hand.adaptive import Push, RecordedTrial
    from manipulandum_sim.hand import AskedArm

#: Conditions of the cocontraction experiment where none is asked for.
CONDITIONS: Final = ("cocontraction_00",)


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--k-percent", type=float, default=10.0, help="K within so many %% (10)")
    parser.add_argument(
        "--conditions", nargs="+", default=CONDITIONS, metavar="NAME", help="cocontraction_00 ..."
    )
    parser.add_argument("--max-trials", type=int, default=400, metavar="N", help="(400)")
    parser.add_argument(
        "--shapes", nargs="+", metavar="NAME", help="courses to choose from (default: all)"
    )
    parser.add_argument("--servo", metavar="STIFFNESS", help="N/m, or ideal (20000)")
    parser.add_argument(
        "--reflex", type=float, metavar="SHARE", help="of the stiffness, 55 ms late"
    )
    parser.add_argument(
        "--drift-percent",
        type=float,
        default=0.0,
        metavar="X",
        help="muscles change their strength by X %% over 100 pushes (0)",
    )


def _simulate(_: str, arguments: argparse.Namespace, progress: Progress) -> Simulated:
    from manipulandum_sim.hand import (
        AskedArm,
        Reflex,
        Rig,
        conditions_named,
        find_experiment,
        find_subject,
    )

    person = find_subject(arguments.subject or "A")
    known = find_experiment("cocontraction").conditions(person)
    rig = Rig(
        servo=servo_asked(arguments.servo),
        noise=arguments.noise,
        reflex=None if arguments.reflex is None else Reflex(arguments.reflex),
        emg=False,
    )
    arm = AskedArm(
        person,
        conditions_named(arguments.conditions, known),
        rig,
        arguments.seed,
        drift=arguments.drift_percent / 100,
    )
    recording = closed_loop(
        arm,
        progress,
        most_trials=arguments.max_trials,
        k_percent=arguments.k_percent,
        shapes=arguments.shapes,
        seed=arguments.seed,
    )
    return Simulated(recording, arm.truth)


def closed_loop(
    arm: AskedArm, progress: Progress | None, *, most_trials: int, **wish: Any
) -> Recording:
    """Push until the wish is met, or so many times; what was recorded.

    `wish`: keywords of `next_trials`.
    """
    from armimpedance.hand.adaptive import OneCourse, PushSession, Setup
    from armimpedance.hand.adaptive.show import next_trials

    names = [condition.name for condition in arm.conditions]
    setup = Setup(1000.0, arm.rig.handle_mass_kg, arm.subject.record, (0.0, 0.0))
    choose = OneCourse(partial(next_trials, conditions=names, checks=False, **wish))
    session = PushSession(choose, setup)
    try:
        while len(session.trials) < most_trials and (pushes := session.known()):
            for trial in _pushed(arm, pushes, len(session.trials)):
                session.add(trial)
            if progress is not None:
                left = sum(session.remaining().values())
                progress(len(session.trials), max(left, len(session.trials)))
    finally:
        session.close()
    return session.recording()


def _pushed(arm: AskedArm, pushes: Sequence[Push], first: int) -> list[RecordedTrial]:
    import numpy as np

    from armimpedance.hand.adaptive import RecordedTrial
    from manipulandum_sim.hand import AskedPush

    asked = []
    for push in pushes:
        course, way = push.profile, (push.direction[0], push.direction[1])
        asked.append(
            AskedPush(push.condition, way, course.shape.name, course.amplitude_m, course.duration_s)
        )
    return [
        RecordedTrial(
            one.condition,
            np.array(one.direction),
            made.onset_s,
            made.end_s,
            made.position,
            made.force,
            made.joint_angles,
        )
        for one, made in zip(asked, arm.push(asked, first), strict=True)
    ]


RIGS: Final = (
    SimulatedRig(
        name="adaptive",
        line="a hand whose pushes are chosen one after another, until K is known well enough",
        options="--k-percent 5 --out session",
        simulate=_simulate,
        add_options=_add_options,
        subjects="A, B, C or D (A)",
        noise=("nominal", "sensor", "none"),
    ),
)
