"""Map hand-level results to the joints, or on to the muscles, the covariance carried along.

Examples:
  armimpedance map hand.csv --recording session --to joint --out joint.csv
  armimpedance map hand.csv --recording session --to joint --no-force-term --out paper.csv
  armimpedance map hand.csv --recording session --to muscle --arm planar6 --out muscle.csv
  armimpedance map joint.csv --recording session --to muscle --arm arms.csv --share emg --out m.csv

To the joints: K_j = J^T K_e J - Gamma(F) - dg/dq, B_j = J^T B_e J, M_j = J^T M_e J, with J at each
row's posture and Gamma the term that the mean hand force adds; --no-force-term leaves it out, as
Tsuji (1997) does. dg/dq is what the arm's weight adds where recording.json says that gravity acts
in the plane ("gravity": [0, -9.81]); without, the plane is taken as horizontal. Segment lengths
come from the recording's subject, or from its height, masses from the body's mass.
In three axes the arm has a shoulder of three hinges (turn, elevation, axial) and an elbow. Where
the upper arm was kept from turning about its own axis (--elbow held) the three others follow; of a
free arm four joints do not follow from three axes, and it says what its stiffness is at least.

To the muscles: K_j = G^T K_m G + sum f d2L, B_j = G^T B_m G, with the moment arms G of --arm at
each row's posture. Three numbers do not determine the stiffness of six muscles: the result holds
the sums that they do determine, and for each muscle the range of all K_m >= 0 that give this K_j.
Tensions f make the mean torque J^T F with least effort; --no-curvature leaves their term out.
Rows may be at the hand or at the joints already. --arm: planar6 (horizontal, six muscles, constant
moment arms), arm26 (OpenSim's, sagittal), or a CSV with the columns muscle, q_shoulder_rad,
q_elbow_rad, G_shoulder_m, G_elbow_m (dL/dq, positive where the muscle lengthens), all muscles on
one grid of angles, and optionally max_tension_N and stiffness_per_tension_per_m.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from armimpedance.hand.levels.show.options import TO_JOINT, TO_MUSCLE

if TYPE_CHECKING:
    from armimpedance.hand.show.estimates import Estimates

FORCE_TERM: Final = (
    "Stiffness of the joints with the term that the mean hand force adds (filled, solid) and "
    "without it (open, dashed): ellipses to one scale where there are two joints, then the "
    "elements with 95 % intervals."
)
RANGES: Final = (
    "Stiffness that each muscle may have: the range of all K_m >= 0 that make the joints' "
    "stiffness, dark as measured, light with its 95 % interval."
)


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.show.command.outputs import TABLE, add_figure, add_out

    parser.add_argument("results", metavar="RESULTS.csv", type=Path)
    parser.add_argument("--recording", required=True, type=Path, metavar="RECORDING")
    parser.add_argument("--to", choices=("joint", "muscle"), required=True)
    add_out(parser, "the mapped results", TABLE, long=True, required=True)
    add_figure(parser, "K of the joints with and without the force term; ranges of the muscles")
    TO_JOINT.configure(parser)
    parser.add_argument("--arm", metavar="ARM", help="planar6, arm26 or a TABLE.csv (to muscle)")
    TO_MUSCLE.configure_beside(parser, TO_JOINT)


def run(args: argparse.Namespace) -> int:
    """Map every row, write the results, print a table."""
    from armimpedance.show.command.outputs import FIGURE, TABLE, Output, check_long, check_outputs

    _check(args)
    check_outputs(
        Output("--out", args.out, TABLE),
        Output("--figure", args.figure, FIGURE),
        reads=[args.results, args.recording],
    )
    check_long(args)
    return _to_joints(args) if args.to == "joint" else _to_muscles(args)


def _to_joints(args: argparse.Namespace) -> int:
    from armimpedance.hand.levels.show.plot import plot_force_term
    from armimpedance.hand.levels.show.verb import to_joint
    from armimpedance.hand.show.text import summary_table
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.outputs import write_result

    options = TO_JOINT.keywords(args)
    force_term = options["force_term"]

    def mapped(with_force: bool) -> Estimates:
        chosen = {**options, "force_term": with_force}
        return to_joint(args.results, recording=args.recording, **chosen)

    joint = mapped(force_term)
    write_result(joint.content, args)
    print(summary_table(joint))
    print(f"\n{len(joint)} rows written to {args.out}")

    def draw() -> Any:
        other = mapped(not force_term)
        return plot_force_term(*((joint, other) if force_term else (other, joint)))

    draw_picture(args, draw, FORCE_TERM)
    return 0


def _to_muscles(args: argparse.Namespace) -> int:
    from armimpedance.hand.levels.show.muscle_estimates import muscle_text
    from armimpedance.hand.levels.show.plot import plot_muscle_ranges
    from armimpedance.hand.levels.show.verb import to_muscle
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.outputs import write_result

    muscles = to_muscle(
        args.results,
        arm=args.arm,
        recording=args.recording,
        **TO_MUSCLE.keywords(args),
    )
    write_result(muscles.content, args)
    print(muscle_text(muscles))
    print(f"\n{len(muscles)} rows written to {args.out}")
    draw_picture(args, lambda: plot_muscle_ranges(muscles), RANGES)
    return 0


def _check(args: argparse.Namespace) -> None:
    from armimpedance.core.errors import InputError

    if args.to == "muscle" and args.arm is None:
        raise InputError("--to muscle", expected="--arm planar6, arm26 or a TABLE.csv")
    if args.to == "joint" and args.arm is not None:
        raise InputError("--arm", expected="it with --to muscle only")
    if args.to == "joint":
        TO_MUSCLE.refuse(args, TO_JOINT, "it with --to muscle only")
    else:
        TO_JOINT.refuse(args, TO_MUSCLE, "it with --to joint only")
