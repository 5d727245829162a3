"""Plan an experiment: trials needed, the best disturbance, what a reflex would do.

Examples:
  armimpedance plan --k-percent 10
  armimpedance plan --k-percent 5 --orientation-deg 3 --shape designed --servo 20000
  armimpedance plan --pilot session --condition posture_01 --k-percent 5 --figure plan.png
  armimpedance plan --design --duration-s 0.25 --max-acceleration 4 --out-profile profile.csv
  armimpedance plan --design --separate-reflex --out-profile profile.csv

"K within X %": the 95 % interval of each diagonal element of K is at most +- X % of the element.
Arm and noise are those of a pilot recording, or the arm of a row of RESULTS, or a relaxed arm of
70 kg body mass with nominal noise. Shapes that would exceed the acceleration get a smaller
amplitude; with --shape and --amplitude-mm they are refused. The profile is written at 1 kHz.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.planning import (
        Candidate,
        Limits,
        Plan,
        PlannedArm,
        Profile,
        Servo,
        Setting,
        Wish,
    )

#: Of the stiffness, where no wish is given.
DEFAULT_K_PERCENT = 10.0
#: Name of a disturbance designed here.
NEW = "new design"


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.cli.estimate import add_force_by

    arm = parser.add_argument_group("arm and noise")
    source = arm.add_mutually_exclusive_group()
    source.add_argument("--pilot", type=Path, metavar="RECORDING", help="arm and noise from it")
    source.add_argument("--results", type=Path, metavar="RESULTS", help="arm from a row of it")
    arm.add_argument("--condition", metavar="NAME", help="of pilot or results (default: the first)")
    arm.add_argument("--noise", help="nominal (default) or sensor; a pilot brings its own")
    add_force_by(parser)
    wish = parser.add_argument_group("wish")
    wish.add_argument(
        "--k-percent",
        type=float,
        metavar="X",
        help="K within X %% (default without another wish: 10)",
    )
    wish.add_argument("--orientation-deg", type=float, metavar="Y", help="of K's ellipse")
    wish.add_argument("--max-trials", type=int, default=1000, metavar="N", help="default: 1000")
    wish.add_argument("--trials", type=int, default=40, help="of the table's intervals")
    shape = parser.add_argument_group("disturbance")
    shape.add_argument("--shape", default="all", metavar="NAME", help="or all (default)")
    shape.add_argument("--duration-s", type=float, metavar="T", help="default: 0.15, 0.2 and 0.3")
    shape.add_argument("--amplitude-mm", type=float, metavar="A", help="default: at most 5")
    shape.add_argument(
        "--max-acceleration", type=float, default=5.3, metavar="A", help="m/s^2 (default: 5.3)"
    )
    shape.add_argument("--design", action="store_true", help="optimise a disturbance")
    shape.add_argument(
        "--separate-reflex", action="store_true", help="design for K and a reflex apart"
    )
    shape.add_argument(
        "--reflex-delay-ms", type=float, default=55.0, metavar="MS", help="default: 55"
    )
    robot = parser.add_argument_group("robot")
    robot.add_argument("--servo", metavar="N_PER_M", help="stiffness, or ideal (default)")
    robot.add_argument("--bandwidth-hz", type=float, help="of a servo without feedforward")
    robot.add_argument(
        "--robot-kg", type=float, default=2.0, help="robot and handle as felt (default: 2)"
    )
    out = parser.add_argument_group("output")
    out.add_argument("--out-profile", type=Path, metavar="CSV", help="the best one, at 1 kHz")
    out.add_argument("--figure", type=Path, metavar="PNG", help="or .svg, .pdf")


def run(arguments: argparse.Namespace) -> int:
    """Plan, print, write profile and figure; an unmet wish is an error after the table."""
    from armimpedance.cli.parts.checks import check_outputs
    from armimpedance.errors import InputError
    from armimpedance.planning import make_plan, write_profile
    from armimpedance.report import plan_text

    check_outputs(figure=arguments.figure, out=arguments.out_profile)
    if arguments.trials < 8:
        raise InputError(f"--trials {arguments.trials}", expected="8 or more: one set")
    wish = _wish(arguments)
    setting, measured = _setting(arguments, wish)
    limits = _limits(arguments)
    plan = make_plan(
        setting,
        _profiles(arguments, setting, limits),
        wish,
        limits,
        delay_s=arguments.reflex_delay_ms / 1e3,
        measured=measured,
    )
    print(plan_text(plan, arguments.trials))
    if arguments.out_profile is not None:
        profile = _best_profile(plan)
        write_profile(profile, arguments.out_profile)
        print(f"\n{profile.shape.name} written to {arguments.out_profile}")
    if arguments.figure is not None:
        _draw(plan, arguments.figure)
    if plan.obstacle:
        raise InputError(f"cannot be met: {plan.obstacle}")
    return 0


def _wish(arguments: argparse.Namespace) -> Wish:
    from math import radians

    from armimpedance.planning import Wish

    k, angle = arguments.k_percent, arguments.orientation_deg
    if k is None and angle is None:
        k = DEFAULT_K_PERCENT
    return Wish(
        None if k is None else k / 100,
        None if angle is None else radians(angle),
        arguments.max_trials,
    )


def _limits(arguments: argparse.Namespace) -> Limits:
    from armimpedance.planning import Limits

    amplitude = 5.0 if arguments.amplitude_mm is None else arguments.amplitude_mm
    duration = 0.3 if arguments.duration_s is None else arguments.duration_s
    return Limits(amplitude / 1e3, duration, arguments.max_acceleration)


def _profiles(arguments: argparse.Namespace, setting: Setting, limits: Limits) -> list[Profile]:
    from armimpedance.errors import InputError
    from armimpedance.planning import (
        COMPARED,
        DURATIONS_S,
        Goal,
        candidates_of,
        design,
        shape_named,
        within,
    )

    delay = arguments.reflex_delay_ms / 1e3
    profiles: list[Profile] = []
    if arguments.design or arguments.separate_reflex:
        goal = Goal()
        if arguments.separate_reflex:
            around = (delay - 0.015, delay, delay + 0.015)
            goal = Goal(around, delay_known=False)
        degree = 9 if arguments.separate_reflex else 5
        profiles.append(design(setting, limits, goal, degree=degree, name=NEW).profile)
    asked = DURATIONS_S if arguments.duration_s is None else (limits.duration_s,)
    if arguments.shape == "all":
        return [*profiles, *candidates_of(COMPARED, asked, limits)]
    shape = shape_named(arguments.shape)
    if arguments.amplitude_mm is None:
        return [*profiles, *candidates_of([shape.name], asked, limits)]
    made, refused = [], None
    for duration in asked:
        try:
            made.append(within(shape, replace(limits, duration_s=duration), reduce=False))
        except InputError as error:
            refused = error
    if refused is not None and not made and not profiles:
        raise refused
    return [*profiles, *made]


def _setting(arguments: argparse.Namespace, wish: Wish) -> tuple[Setting, list[Candidate]]:
    """Setting, and the pilot's own disturbance as a candidate."""
    from armimpedance.planning import Setting, noise_named, relaxed_arm

    servo = _servo(arguments)
    if arguments.pilot is not None:
        return _from_pilot(arguments, servo, wish)
    noise = noise_named(arguments.noise or "nominal")
    arm = relaxed_arm() if arguments.results is None else _arm_of_results(arguments)
    return Setting(arm, noise, servo), []


def _servo(arguments: argparse.Namespace) -> Servo:
    from armimpedance.errors import InputError
    from armimpedance.planning import Servo

    if arguments.bandwidth_hz is not None:
        if arguments.servo is not None:
            raise InputError("--servo and --bandwidth-hz", expected="one of them")
        return Servo.of_bandwidth(arguments.bandwidth_hz, arguments.robot_kg)
    if arguments.servo in (None, "ideal"):
        return Servo(mass_kg=arguments.robot_kg)
    try:
        return Servo(float(arguments.servo), arguments.robot_kg)
    except ValueError as error:
        raise InputError(f"--servo {arguments.servo}", expected="N/m, or ideal") from error


def _arm_of_results(arguments: argparse.Namespace) -> PlannedArm:
    from armimpedance.errors import InputError
    from armimpedance.files import condition_of, read_results
    from armimpedance.planning import PlannedArm

    rows = read_results(arguments.results)
    wanted = arguments.condition
    for row in rows:
        name = condition_of(row)
        if wanted is None or wanted == row.keys.get("condition"):
            try:
                return PlannedArm.of(row, name)
            except InputError as error:
                raise InputError(str(error), file=arguments.results) from error
    known = ", ".join(str(row.keys.get("condition")) for row in rows[:5])
    raise InputError(
        f"no condition {wanted!r}", file=arguments.results, expected=f"such as {known}"
    )


def _from_pilot(
    arguments: argparse.Namespace, servo: Servo, wish: Wish
) -> tuple[Setting, list[Candidate]]:
    from armimpedance.cli.estimate import open_checked
    from armimpedance.errors import ArmImpedanceError, InputError
    from armimpedance.planning import judge_pilot, pilot_of

    if arguments.noise is not None:
        raise InputError("--noise with --pilot", expected="one of them: a pilot brings its own")
    recording = open_checked(arguments.pilot, arguments.force_by)
    try:
        pilot = pilot_of(recording, arguments.condition)
    except ArmImpedanceError as error:
        raise InputError(str(error), file=arguments.pilot) from error
    setting = replace(pilot.setting, servo=servo)
    return setting, [judge_pilot(pilot, wish)]


def _best_profile(plan: Plan) -> Profile:
    from armimpedance.errors import InputError

    able = [
        (c.name != NEW, c.found.k_part(40), c.profile)
        for c in plan.candidates
        if c.profile is not None and c.found is not None and c.recommendable
    ]
    if not able:
        raise InputError("no profile to write: none of these can be recommended")
    return min(able, key=lambda ranked: ranked[:2])[2]


def _draw(plan: Plan, path: Path) -> None:
    from armimpedance.plots import plan_figure, save

    save(plan_figure(plan), path.with_suffix(""), [path.suffix.removeprefix(".")])
    print(f"\nfigure written to {path}")
