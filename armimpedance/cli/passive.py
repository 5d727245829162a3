"""Stiffness, viscosity and friction of relaxed joints, from markers, joint motion or torque.

Examples:
  armimpedance simulate p5 --out relaxed                  something to try it on
  armimpedance passive relaxed --rest-angle 1.5 --out fit.json
  armimpedance passive relaxed --rest-angle free --method output-error --out fit.json
  armimpedance passive arm --joint right_elbow_flexion --joint right_wrist_flexion \\
      --rest-angle right_elbow_flexion=1.5 --rest-angle right_wrist_flexion=0 --out fit.json

k (q - q_r) + h qd + f sign(qd) [+ K (q - q_r)^2] is fitted to the passive torque, after Venture.
The recording is a folder of kind "markers" or "motion" with its skeleton.json (the passive torque
is minus that of inertia and gravity), or of kind "joint" whose torque columns hold the passive
torque or its opposite.
Where the rest angle is not known it is fitted (free), which may widen the interval of k several
times; where the data contradict a given one, a warning says where they put it.
Trials are left out in turn and predicted from the others; --validate predicts another recording.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from armimpedance.passive import EmgLevel, PassiveFit, RestAngle


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("recording", metavar="RECORDING", type=Path)
    parser.add_argument("--out", type=Path, metavar="FIT.json")
    parser.add_argument(
        "--rest-angle",
        action="append",
        metavar="RAD|free|JOINT=RAD",
        help="where the elastic torque vanishes: once for all joints, or once per joint (default: "
        "free, that is fitted)",
    )
    parser.add_argument(
        "--method",
        metavar="NAME",
        help="parallel (default; every term through the filter), ls (the source's, sign "
        "unfiltered), output-error (the measured swing itself is fitted)",
    )
    parser.add_argument(
        "--joint",
        action="append",
        metavar="NAME",
        help="an angle of the skeleton (default: its only elbow); may be given again",
    )
    parser.add_argument("--quadratic", action="store_true", help="fit K (q - q_r)^2 too")
    parser.add_argument(
        "--cutoff-hz",
        metavar="HZ|none",
        help="of the zero-phase low-pass (default: 8; a joint that swings at 5 Hz needs 15)",
    )
    parser.add_argument(
        "--emg-gate",
        metavar="PERCENT|off",
        help="a muscle above this part of its maximum is not relaxed (default: 3)",
    )
    parser.add_argument(
        "--torque-sign",
        type=int,
        choices=(1, -1),
        help="kind joint: 1 passive torque, -1 torque of the limb on the device (default: found)",
    )
    parser.add_argument(
        "--longest-gap-s",
        type=float,
        default=0.2,
        metavar="S",
        help="longest loss of a marker to bridge (default: 0.2)",
    )
    parser.add_argument("--validate", type=Path, metavar="RECORDING", help="predict its torque too")
    parser.add_argument(
        "--figure", type=Path, metavar="PATH.png", help="draw torque and prediction"
    )


def run(arguments: argparse.Namespace) -> int:
    """Read, fit, print, write."""
    from armimpedance.cli.parts.checks import check_outputs, naming
    from armimpedance.cli.parts.passive_input import read_passive
    from armimpedance.files import write_fit
    from armimpedance.passive import DEFAULT_METHOD, identify_passive, method_named, summarise
    from armimpedance.report import passive_text

    check_outputs(figure=arguments.figure, out=arguments.out)
    method = method_named(arguments.method or DEFAULT_METHOD)
    given = read_passive(arguments.recording, arguments)
    rests = rest_angles(arguments.rest_angle, given.samples.joints)
    with naming(arguments.recording):
        fits = identify_passive(
            given.samples, rest_angle=rests, method=method.name, quadratic=arguments.quadratic
        )
    other = None
    if arguments.validate is not None:
        there = read_passive(arguments.validate, arguments).samples
        with naming(arguments.validate):
            other = tuple(fit.validate(there) for fit in fits)
    print(passive_text(fits, given.notes, other))
    if arguments.out is not None:
        write_fit(summarise(fits), arguments.out, **_more(arguments, fits, given.emg, other))
    if arguments.figure is not None:
        _draw(fits, given.samples, arguments.figure)
    return 0


def _more(
    arguments: argparse.Namespace,
    fits: tuple[PassiveFit, ...],
    emg: EmgLevel | None,
    other: Any,
) -> dict[str, Any]:
    from armimpedance.report import emg_object, passive_object

    more: dict[str, Any] = {"joints": passive_object(fits), "emg": emg_object(emg)}
    if other is not None:
        names = [fit.joint for fit in fits]
        more["validated_on"] = {
            "recording": str(arguments.validate),
            "joints": [
                {"joint": n, "rms_Nm": float(v.rms[0]), "r2": v.r2, "vaf": v.vaf}
                for n, v in zip(names, other, strict=True)
            ],
        }
    return more


def _draw(fits: tuple[PassiveFit, ...], samples: Any, path: Path) -> None:
    from armimpedance.plots import plot_passive_fits, save

    figure = plot_passive_fits(fits, samples)
    save(figure, path.with_suffix(""), (path.suffix[1:],))


def rest_angles(
    given: list[str] | None, joints: tuple[str, ...]
) -> RestAngle | dict[str, RestAngle]:
    """One rest angle for all joints, or one each; a joint that is not named is free.

    Raises
    ------
    InputError
        Not an angle, an unknown joint or one twice, or one angle for all beside one for a joint.
    """
    from armimpedance.errors import InputError

    words = given or ["free"]
    named = {w.split("=", 1)[0]: _angle(w.split("=", 1)[1]) for w in words if "=" in w}
    plain = [_angle(w) for w in words if "=" not in w]
    if len(plain) == len(words) == 1:
        return plain[0]
    unknown = sorted(set(named) - set(joints))
    if plain or unknown or len(named) != len(words):
        raise InputError(
            f"--rest-angle {' '.join(words)}",
            expected=f"one angle for all, or one each for {', '.join(joints)}",
        )
    return {joint: named.get(joint, "free") for joint in joints}


def _angle(word: str) -> RestAngle:
    from math import pi

    from armimpedance.errors import InputError

    if word == "free":
        return "free"
    try:
        value = float(word)
    except ValueError:
        value = float("nan")
    if abs(value) > 2 * pi:
        raise InputError(
            f"--rest-angle {word} looks like degrees", expected="radians within a turn of zero"
        )
    if value != value:
        raise InputError(f"--rest-angle {word}", expected="radians, or free")
    return value
