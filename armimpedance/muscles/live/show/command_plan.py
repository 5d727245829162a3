"""`armimpedance plan --live`: the conditions of a calibration of the live stiffness."""

from __future__ import annotations

import argparse
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.described import Meaning

if TYPE_CHECKING:
    from armimpedance.muscles.live.calibration import CalibrationPlan, CalibrationWish, Workspace

#: Options of `plan` that say nothing of a calibration, and those that say nothing of anything else.
_ELSEWHERE = (
    *("pilot", "results", "condition", "noise", "k_percent", "orientation_deg", "figure"),
    *("movement", "phase", "max_force_n", "max_displacement_mm", "duration_s", "amplitude_mm"),
    *("servo", "bandwidth_hz", "robot_kg", "out_profile"),
)
OWN = (
    *("recording", "error_percent", "minutes", "condition_s", "condition_percent"),
    *("activation_percent", "box_deg", "levels", "force_n", "elbow", "out_calibration"),
)


def add_live(parser: argparse.ArgumentParser) -> None:
    """Options of a calibration."""
    from armimpedance.show.command.outputs import OutputPath

    live = parser.add_argument_group("a calibration of the live stiffness")
    live.add_argument(
        "--live",
        metavar="NAME|TABLE.csv",
        help="moment arms: planar6, arm26; in space myoarm4, myoarm7; or a table",
    )
    live.add_argument("--recording", type=Path, metavar="RECORDING", help="whose arm it is")
    live.add_argument(
        "--error-percent", type=float, metavar="X", help="wanted of the live K (default: 10)"
    )
    live.add_argument("--minutes", type=float, help="at most so long (default: 5)")
    live.add_argument(
        "--condition-s", type=float, metavar="S", help="time of one condition (default: 12)"
    )
    _add_precision(live)
    live.add_argument(
        "--elbow", choices=("held", "free"), help="in space (default: what the recording says)"
    )
    live.add_argument("--out-calibration", type=OutputPath, metavar="CSV", help="the conditions")


def _add_precision(live: argparse._ArgumentGroup) -> None:
    live.add_argument(
        "--condition-percent",
        type=float,
        metavar="X",
        help="standard error of an element of K from one condition (default: 6)",
    )
    live.add_argument(
        "--activation-percent",
        type=float,
        metavar="X",
        help="standard error of an activation (default: 10)",
    )
    live.add_argument(
        "--box-deg",
        type=float,
        nargs="+",
        metavar="DEG",
        help="lowest and highest angle of each joint (default: those of the moment arms)",
    )
    live.add_argument(
        "--levels", type=float, nargs="+", metavar="PERCENT", help="(default: 3 10 20)"
    )
    live.add_argument("--force-n", type=float, metavar="N", help="by the hand (default: 8)")


def refuse_own(args: argparse.Namespace) -> None:
    """Refuse what belongs to a calibration where none is planned."""
    from armimpedance.core.errors import InputError

    for name in OWN:
        if getattr(args, name) is not None:
            raise InputError(f"--{name.replace('_', '-')}", expected="it with --live")


def plan_live(args: argparse.Namespace) -> int:
    """Plan, write the conditions, print; an unmet wish is an error after the table."""
    from armimpedance.core.errors import InputError
    from armimpedance.limb.arm import arm_named
    from armimpedance.muscles.live.calibration import plan_calibration
    from armimpedance.show.command.outputs import TABLE, Output, check_outputs
    from armimpedance.show.files import table_content, write_content

    for name in _ELSEWHERE:
        if getattr(args, name) is not None:
            raise InputError(f"--{name.replace('_', '-')} with --live", expected="it without")
    if args.recording is None:
        raise InputError("whose arm is it?", expected="--recording RECORDING")
    out = Output("--out-calibration", args.out_calibration, TABLE)
    check_outputs(out, reads=[args.recording])
    muscles = arm_named(args.live)
    wish, space = _wish(args), _workspace(args, muscles.angle_range)
    made = plan_calibration(muscles, args.recording, wish, space, elbow=args.elbow)
    if args.out_calibration is not None:
        write_content(table_content(_rows(made), described=PLANNED), args.out_calibration)
    print(_text(made))
    if args.out_calibration is not None:
        print(f"\n{len(made.conditions)} conditions written to {args.out_calibration}")
    if not made.met:
        raise InputError(
            f"{wish.error_percent:g} % cannot be met in {wish.minutes:g} minutes: "
            f"{made.expected_percent[-1]:.1f} % is foretold, {made.floor_percent:.1f} % by the "
            "activations alone",
            expected="more time, or a larger error",
        )
    return 0


def _wish(args: argparse.Namespace) -> CalibrationWish:
    from armimpedance.muscles.live.calibration import CalibrationWish

    names = (
        *("error_percent", "minutes", "condition_s"),
        *("condition_percent", "activation_percent"),
    )
    given = {name: getattr(args, name) for name in names}
    return CalibrationWish(**{name: value for name, value in given.items() if value is not None})


def _workspace(args: argparse.Namespace, limits: Any) -> Workspace:
    import numpy as np

    from armimpedance.core.errors import InputError
    from armimpedance.muscles.live.calibration import Workspace

    box, given = limits, dict[str, Any]()
    if args.box_deg is not None:
        if len(args.box_deg) != 2 * len(limits):
            raise InputError(
                f"--box-deg with {len(args.box_deg)} angles",
                expected=f"{2 * len(limits)}: the lowest and the highest of each joint",
            )
        box = np.radians(args.box_deg).reshape(-1, 2)
        if (box[:, 0] >= box[:, 1]).any() or (
            np.abs(box - np.clip(box.T, *limits.T).T) > 1e-6
        ).any():
            degrees_text = " ".join(f"{x:.0f}" for x in np.degrees(limits).ravel())
            raise InputError(
                "--box-deg", expected=f"rising, and within the moment arms' {degrees_text}"
            )
    if args.levels is not None:
        given["levels"] = tuple(percent / 100 for percent in args.levels)
        if not all(0 < level <= 1 for level in given["levels"]):
            raise InputError("--levels", expected="per cent, above 0 and up to 100")
    if args.force_n is not None:
        if not 0 <= args.force_n < np.inf:
            raise InputError(f"--force-n {args.force_n:g}", expected="0 or more")
        given["force_N"] = args.force_n
    return Workspace(np.asarray(box), **given)


#: What the columns of the conditions are, beside posture and force.
PLANNED: Final = {
    "cocontraction": Meaning("level of co-contraction, part of a maximal contraction", "1"),
    "force_{}_N": Meaning("force of the hand along {}", "N"),
    "expected_percent": Meaning("error of K that is expected after this condition", "%"),
}


def _rows(plan: CalibrationPlan) -> list[dict[str, Any]]:
    """A row a condition, as `simulate space --postures` reads them."""
    from armimpedance.muscles.models import angle_columns

    at = plan.conditions
    columns = angle_columns(at.joint_angles.shape[1])
    forces = [f"force_{axis}_N" for axis in "xyz"[: at.force.shape[1]]]
    return [
        {
            **dict(zip(columns, at.joint_angles[c].tolist(), strict=True)),
            "cocontraction": float(at.level[c]),
            **dict(zip(forces, at.force[c].tolist(), strict=True)),
            "expected_percent": float(plan.expected_percent[c + 1]),
        }
        for c in range(len(at))
    ]


def _text(plan: CalibrationPlan) -> str:
    """The conditions with what is foretold after each."""
    import numpy as np

    lines = ["condition  posture, deg              level, %  force, N        K live, %"]
    for c in range(len(plan.conditions)):
        at = plan.conditions
        posture = " ".join(f"{x:5.0f}" for x in np.degrees(at.joint_angles[c]))
        force = " ".join(f"{x:4.0f}" for x in at.force[c])
        lines.append(
            f"{c + 1:9d}  {posture:24s}  {100 * at.level[c]:8.0f}  {force:15s}  "
            f"{plan.expected_percent[c + 1]:8.1f}"
        )
    sentence = (
        f"{len(plan.conditions)} conditions in {plan.minutes:.1f} minutes: K of the live hand is "
        f"foretold within {plan.expected_percent[-1]:.1f} % (root mean square over the workspace, "
        f"Frobenius norm; wanted {plan.wish.error_percent:g} %), of which errors of the "
        f"activations alone make {plan.floor_percent:.1f} %. It counts with moment arms within "
        "20 % of the table's and with muscles whose stiffness goes with activation as "
        "`fit muscles` has it."
    )
    return "\n".join([*lines, "", textwrap.fill(sentence, 100)])
