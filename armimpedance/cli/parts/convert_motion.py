"""Motion capture behind `armimpedance convert`: C3D, .trc, .mot and .sto -> markers or motion."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.errors import InputError

if TYPE_CHECKING:
    from armimpedance.motion import MarkerRecording
    from armimpedance.recordings import ReadOptions
    from armimpedance.skeleton import Skeleton

MODELS = ("elbow", "body")
#: Options that belong to recordings of the hand.
_HAND = ("force_by", "side", "onset_event", "end_event", "handle_mass_kg", "shoulder_m")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Arguments for motion capture."""
    group = parser.add_argument_group("motion capture (.c3d, .trc, .mot, .sto: one trial a file)")
    group.add_argument(
        "--skeleton",
        metavar="elbow|body|FILE.json",
        help="a model for --mass-kg and --height-m, or a skeleton of yours",
    )
    group.add_argument("--standing", type=Path, metavar="FILE", help="upright: where markers sit")
    group.add_argument(
        "--marker",
        action="append",
        default=[],
        metavar="LABEL=NAME",
        help="what the skeleton calls a marker, as RSHO=acromion_right; may be given again",
    )
    group.add_argument(
        "--angle",
        action="append",
        default=[],
        metavar="COORDINATE=COLUMN",
        help=".mot, .sto: the column of an angle, -COLUMN turns its sign; may be given again",
    )
    group.add_argument("--prefix", metavar="NAME", help=".c3d: whose markers (NAME:marker)")
    group.add_argument("--axes", metavar="X,Y,Z", help="axes forward, left, up, such as x,-z,y")
    group.add_argument("--in-degrees", choices=("yes", "no"), help="where a table does not say")


def is_motion_capture(path: Path) -> bool:
    """Whether this is a file of motion capture, by its suffix, or a recording of it."""
    from armimpedance.recordings import is_moving

    return path.suffix.lower() in (".c3d", ".trc", ".mot", ".sto") or is_moving(path)


def convert_motion(arguments: argparse.Namespace, emg_channels: dict[str, str]) -> int:
    """Read, name, calibrate, write; say what was done."""
    from dataclasses import replace

    from armimpedance.cli.parts.inspect_motion import describe_moving
    from armimpedance.motion import MarkerRecording
    from armimpedance.recordings import open_recording, write_markers, write_motion

    _refuse_others(arguments)
    options = _options(arguments, emg_channels)
    recording = open_recording(arguments.input, options)
    sizes = {name: getattr(arguments, name) for name in ("mass_kg", "height_m")}
    known = {name: value for name, value in sizes.items() if value is not None}
    for name, value in known.items():
        if not value > 0:
            raise InputError(f"--{name.replace('_', '-')} {value:g}", expected="more than 0")
    subject = replace(recording.subject, **known)
    if isinstance(recording, MarkerRecording):
        named = _with_standing(_renamed(recording, arguments), arguments, options)
        recording = replace(named, subject=subject)
        write_markers(recording, arguments.output, arguments.table)
    else:
        recording = replace(recording, subject=subject)
        write_motion(recording, arguments.output, arguments.table)
    print(describe_moving(recording, f"{arguments.input} -> {arguments.output}"))
    return 0


def _refuse_others(arguments: argparse.Namespace) -> None:
    for name in _HAND:
        if getattr(arguments, name) is not None:
            raise InputError(
                f"--{name.replace('_', '-')} with motion capture",
                expected="it with recordings of the hand only",
            )
    if arguments.standing is not None and arguments.skeleton is None:
        raise InputError("--standing without --skeleton", expected="the segments markers sit on")


def _options(arguments: argparse.Namespace, emg_channels: dict[str, str]) -> ReadOptions:
    from armimpedance.recordings import ReadOptions

    axes = None if arguments.axes is None else tuple(arguments.axes.split(","))
    degrees = None if arguments.in_degrees is None else arguments.in_degrees == "yes"
    return ReadOptions(
        axes=axes,
        prefix=arguments.prefix,
        emg_channels=emg_channels,
        skeleton=_skeleton(arguments),
        angles=pairs(arguments.angle, "--angle", "COORDINATE=COLUMN"),
        in_degrees=degrees,
    )


def _skeleton(arguments: argparse.Namespace) -> Skeleton | None:
    from armimpedance.arm import body_skeleton, elbow_skeleton
    from armimpedance.recordings import read_skeleton

    wanted = arguments.skeleton
    if wanted is None:
        return None
    if wanted not in MODELS:
        return read_skeleton(wanted)
    if arguments.mass_kg is None or arguments.height_m is None:
        raise InputError(f"--skeleton {wanted}", expected="--mass-kg and --height-m with it")
    if wanted == "body":
        return body_skeleton(arguments.mass_kg, arguments.height_m)
    return elbow_skeleton(
        arguments.mass_kg,
        arguments.height_m,
        upper_arm_m=arguments.upper_arm_m,
        forearm_hand_m=arguments.forearm_hand_m,
    )


def _renamed(recording: MarkerRecording, arguments: argparse.Namespace) -> MarkerRecording:
    from dataclasses import replace

    names = pairs(arguments.marker, "--marker", "LABEL=NAME, as RSHO=acromion_right")
    unknown = [label for label in names if label not in recording.names]
    if unknown:
        raise InputError(
            f"no marker {unknown[0]!r}", file=arguments.input, expected=", ".join(recording.names)
        )
    return replace(recording, names=tuple(names.get(n, n) for n in recording.names))


def _with_standing(
    recording: MarkerRecording, arguments: argparse.Namespace, options: ReadOptions
) -> MarkerRecording:
    """The recording with marker sites where the subject wears them."""
    from dataclasses import replace

    if arguments.standing is None:
        return recording
    from armimpedance.mocap import calibrate_sites
    from armimpedance.motion import MarkerRecording
    from armimpedance.recordings import open_recording

    plain = replace(options, emg_channels={}, skeleton=None)
    standing = open_recording(arguments.standing, plain)
    if not isinstance(standing, MarkerRecording) or recording.skeleton is None:
        raise InputError("no markers", file=arguments.standing, expected="a standing trial")
    skeleton = calibrate_sites(recording.skeleton, _renamed(standing, arguments))
    return replace(recording, skeleton=skeleton)


def pairs(words: list[str], option: str, expected: str) -> dict[str, str]:
    """``LEFT=RIGHT`` words as a mapping.

    Raises
    ------
    InputError
        A word of another form.
    """
    found = {}
    for word in words:
        left, equals, right = word.partition("=")
        if not (left and equals and right):
            raise InputError(f"{option} {word}", expected=expected)
        found[left] = right
    return found
