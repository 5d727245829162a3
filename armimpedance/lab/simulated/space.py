"""A hand on a robot of three axes."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from armimpedance.core.progress import Progress
from armimpedance.lab.parts.simulation import MOMENT_ARMS_FILE, Simulated, SimulatedRig, given

if TYPE_CHECKING:
    from manipulandum_sim.space import SpaceCondition


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--sets", type=int, default=2, help="times each direction is taken (2)")
    parser.add_argument(
        "--directions", type=int, help="on a sphere: 6, 8, 12, 14, 18 or 26 (default)"
    )
    parser.add_argument(
        "--elbow", choices=("held", "free"), default="held", help="the upper arm's turning"
    )
    parser.add_argument(
        "--wrist",
        choices=("locked", "free"),
        default="locked",
        help="free: seven joints, the handle on a ball joint; 32 muscles (--arm myoarm7)",
    )
    parser.add_argument(
        "--posture", nargs="+", default=["nominal"], metavar="NAME", help="nominal, far, near, …"
    )
    parser.add_argument(
        "--postures",
        type=Path,
        metavar="FILE.csv",
        help="q_1_rad to q_4_rad of each, in place of --posture and --cocontraction; and where it "
        "has them q_5_rad to q_7_rad of a free wrist, cocontraction, force_x_N, "
        "force_y_N, force_z_N",
    )
    parser.add_argument(
        "--emg",
        action="store_true",
        help=f"of twelve muscles; {MOMENT_ARMS_FILE} lies beside it: another person's, 10 %% off "
        "(with a free wrist of 32: myoarm7 is another person's)",
    )
    parser.add_argument(
        "--cocontraction", type=float, nargs="+", default=[12.0], metavar="PERCENT", help="(12)"
    )
    parser.add_argument("--force", type=float, nargs=3, metavar="N", help="by the hand (0 -5 3)")
    parser.add_argument("--disturbance", metavar="SHAPE", help="minimum_jerk, designed, plateau, …")
    parser.add_argument("--duration-s", type=float, help="of a disturbance (0.3)")
    parser.add_argument("--amplitude-mm", type=float, help="of a disturbance (10)")
    parser.add_argument("--control", choices=("position", "force"), help="by the robot")


def _simulate(name: str, arguments: argparse.Namespace, progress: Progress) -> Simulated:
    del name  # one rig only
    from manipulandum_sim.space import simulate_space, write_moment_arms

    asked = arguments.amplitude_mm
    recording, truth = simulate_space(
        _conditions(arguments),
        seed=arguments.seed,
        subject=arguments.subject or "A",
        sets=arguments.sets,
        progress=progress,
        elbow=arguments.elbow,
        wrist=arguments.wrist,
        noise=arguments.noise,
        emg=arguments.emg,
        **given(
            directions=arguments.directions,
            disturbance=arguments.disturbance,
            duration_s=arguments.duration_s,
            amplitude_m=None if asked is None else asked / 1e3,
            control=arguments.control,
        ),
    )
    anatomy = {MOMENT_ARMS_FILE: partial(write_moment_arms, seed=arguments.seed)}
    locked = arguments.wrist == "locked"
    return Simulated(recording, truth, anatomy if arguments.emg and locked else {})


def _conditions(arguments: argparse.Namespace) -> list[SpaceCondition]:
    """Every posture at every level, or the rows of a table."""
    from armimpedance.show.files import table_rows
    from manipulandum_sim.space import SpaceCondition

    force = given(force=None if arguments.force is None else tuple(arguments.force))
    if arguments.postures is None:
        return [
            SpaceCondition(posture, percent / 100, **force)
            for posture in arguments.posture
            for percent in arguments.cocontraction
        ]
    level, made = arguments.cocontraction[0] / 100, []
    for row in table_rows(arguments.postures, "a table with q_1_rad to q_4_rad"):
        pushed = row.vector("force_{}_N", "xyz")
        own = force if pushed is None else {"force": tuple(pushed.tolist())}
        angles = row.vector("q_{}_rad", range(1, 8), row.angle)
        if angles is None:
            raise row.error("empty", "q_1_rad", "the angles of a posture, rad")
        share = row.optional("cocontraction", level)
        made.append(SpaceCondition(tuple(angles.tolist()), share, **own))
    return made


RIGS: Final = (
    SimulatedRig(
        "space",
        "a hand in space, pushed along directions on a sphere",
        "--elbow free --cocontraction 5 20 --seed 7 --out session",
        _simulate,
        _add_options,
        subjects="A (default) to D",
    ),
)
