"""Plan an experiment: trials needed, the best disturbance, what a reflex would do.

Examples:
  armimpedance plan --k-percent 10
  armimpedance plan --k-percent 5 --orientation-deg 3 --shape designed --servo 20000
  armimpedance plan --pilot session --condition posture_01 --k-percent 5 --figure plan.png
  armimpedance plan --design --duration-s 0.25 --max-acceleration 4 --out-profile profile.csv
  armimpedance plan --design --separate-reflex --out-profile profile.csv
  armimpedance plan --movement reaches --phase 50% --k-percent 10
  armimpedance plan --live planar6 --recording session --error-percent 10 --out-calibration cal.csv

"K within X %": the 95 % interval of each diagonal element of K is at most +- X % of the element.
Arm and noise are those of a pilot recording, or the arm of a row of RESULTS, or a relaxed arm of
70 kg body mass with nominal noise. Shapes that would exceed the acceleration get a smaller
amplitude; with --shape and --amplitude-mm they are refused. The profile is written at 1 kHz.

--movement takes a pilot of reaches (see `armimpedance movement --help`), ten free and eight pushed
ones of a phase at least, and compares pushes by the trials that they need.

--live says which postures, levels of co-contraction and hand forces calibrate the live stiffness of
the hand (`armimpedance live`) to a wanted error in five minutes or less.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.hand.planning.show import PLAN

if TYPE_CHECKING:
    from armimpedance.hand.planning import Servo


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.muscles.live import add_live

    PLAN.configure(parser)
    parser.add_argument(
        "--trials",
        type=int,
        default=40,
        help="trials that the table's intervals are for (default: 40)",
    )
    _add_robot(parser)
    _add_movement(parser)
    add_live(parser)


def _add_movement(parser: argparse.ArgumentParser) -> None:
    moving = parser.add_argument_group("a hand that moves")
    moving.add_argument("--movement", type=Path, metavar="RECORDING", help="a pilot of reaches")
    moving.add_argument("--phase", metavar="NAME", help="default: the pilot's first")
    moving.add_argument("--max-force-n", type=float, metavar="N", help="of a push (default: 10)")
    moving.add_argument(
        "--max-displacement-mm", type=float, metavar="MM", help="of the hand (default: 10)"
    )


def _of_movement(args: argparse.Namespace) -> int:
    """Plan pushes of a moving hand."""
    from armimpedance.core.errors import InputError
    from armimpedance.hand.reaching.show import movement_plan_text, plan_movement

    for name in ("pilot", "results", "figure", "out_profile", "servo", "orientation_deg"):
        if getattr(args, name) is not None:
            option = name.replace("_", "-")
            raise InputError(f"--{option} with --movement", expected="a pilot of reaches alone")
    given = {
        "k_percent": args.k_percent,
        "phase": args.phase,
        "robot_kg": args.robot_kg,
        "max_force_n": args.max_force_n,
        "max_displacement_m": None
        if args.max_displacement_mm is None
        else args.max_displacement_mm / 1e3,
    }
    chosen = {name: value for name, value in given.items() if value is not None}
    result = plan_movement(args.movement, force_by=args.force_by, despite=args.despite, **chosen)
    print(movement_plan_text(result))
    return 0


def _add_robot(parser: argparse.ArgumentParser) -> None:
    from armimpedance.show.command.outputs import OutputPath, add_figure

    robot = parser.add_argument_group("robot")
    robot.add_argument("--servo", metavar="N_PER_M", help="stiffness, or ideal (default)")
    robot.add_argument(
        "--bandwidth-hz", type=float, help="bandwidth of a servo without feedforward"
    )
    robot.add_argument("--robot-kg", type=float, help="robot and handle as felt (default: 2)")
    out = parser.add_argument_group("output")
    out.add_argument("--out-profile", type=OutputPath, metavar="CSV", help="the best one, at 1 kHz")
    add_figure(out, "courses and intervals")


def run(args: argparse.Namespace) -> int:
    """Plan, write profile and figure, print; an unmet wish is an error after the table."""
    from armimpedance.muscles.live import plan_live, refuse_own

    if args.live is not None:
        return plan_live(args)
    refuse_own(args)
    if args.movement is not None:
        return _of_movement(args)
    from armimpedance.core.errors import InputError
    from armimpedance.hand.planning.show import plan, plan_figure, plan_text
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.outputs import FIGURE, Output, check_outputs
    from armimpedance.show.command.screen import bar

    check_outputs(
        Output("--out-profile", args.out_profile, (".csv",)),
        Output("--figure", args.figure, FIGURE),
        reads=[args.pilot, args.results],
    )
    if args.trials < 8:
        raise InputError(f"--trials {args.trials}", expected="8 or more: one set")
    with bar("planning") as progress:
        result = plan(**PLAN.keywords(args), servo=_servo(args), progress=progress)
    if args.out_profile is not None and result.profile is not None:
        result.write_profile(args.out_profile)
    print(plan_text(result, args.trials))
    if args.out_profile is not None:
        if result.profile is None:
            raise InputError("no profile to write: none of these can be recommended")
        print(f"\n{result.profile.shape.name} written to {args.out_profile}")
    draw_picture(
        args,
        lambda: plan_figure(result),
        "Disturbances by shape, each with the duration of the smallest interval: commanded "
        "displacement (a) and acceleration (b), and half the 95 % interval of K against the "
        "number of trials (c).",
    )
    if result.obstacle:
        raise InputError(f"cannot be met: {result.obstacle}")
    return 0


def _servo(args: argparse.Namespace) -> Servo:
    from armimpedance.core.errors import InputError
    from armimpedance.hand.planning import Servo

    mass = 2.0 if args.robot_kg is None else args.robot_kg
    if args.bandwidth_hz is not None:
        if args.servo is not None:
            raise InputError("--servo and --bandwidth-hz", expected="one of them")
        return Servo.of_bandwidth(args.bandwidth_hz, mass)
    if args.servo in (None, "ideal"):
        ideal = Servo(mass_kg=mass)
        if args.robot_kg is not None:
            raise InputError("--robot-kg with an ideal servo", expected="--servo or --bandwidth-hz")
        return ideal
    try:
        stiffness = float(args.servo)
    except ValueError as error:
        raise InputError(f"--servo {args.servo}", expected="N/m, or ideal") from error
    return Servo(stiffness, mass)
