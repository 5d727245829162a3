"""Motion capture behind `armimpedance convert`: names of markers, the skeleton that they sit on."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from armimpedance.core.errors import InputError
from armimpedance.show.command.options import pairs

if TYPE_CHECKING:
    from armimpedance.core.motion import MarkerRecording
    from armimpedance.core.skeleton import Skeleton

MODELS = ("elbow", "body")


def add_skeleton(parser: argparse.ArgumentParser) -> None:
    """The options of the skeleton and of the markers on it."""
    group = parser.add_argument_group("the skeleton (motion capture)")
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
        help="what the skeleton calls a marker, as RSHO=acromion_right; may be repeated",
    )


def skeleton_of(arguments: argparse.Namespace) -> Skeleton | None:
    """The skeleton that the options ask for; None where they ask for none.

    Raises InputError: the file cannot be read, or a model lacks the subject's mass and height.
    """
    from armimpedance.limb.arm import body_skeleton, elbow_skeleton
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


def refuse_markers(arguments: argparse.Namespace) -> None:
    """Refuse the options of markers with a recording that has none."""
    for option, asked in (("--marker", arguments.marker), ("--standing", arguments.standing)):
        if asked:
            raise InputError(option, file=arguments.input, expected="it with markers only")


def with_names(recording: MarkerRecording, arguments: argparse.Namespace) -> MarkerRecording:
    """The recording with its markers named as the options say.

    Raises InputError: there is no such marker; the message lists those that there are.
    """
    from dataclasses import replace

    names = pairs(arguments.marker, "--marker", "LABEL=NAME, as RSHO=acromion_right")
    unknown = [label for label in names if label not in recording.names]
    if unknown:
        raise InputError(
            f"no marker {unknown[0]!r}", file=arguments.input, expected=", ".join(recording.names)
        )
    return replace(recording, names=tuple(names.get(n, n) for n in recording.names))


def with_standing(
    recording: MarkerRecording, arguments: argparse.Namespace, options: dict[str, Any]
) -> MarkerRecording:
    """The recording with marker sites where the subject wears them.

    `options`: how the recording was read; the standing trial is read in the same way, without EMG
    and forces.
    Raises InputError: the standing trial cannot be read, or holds no markers.
    """
    from dataclasses import replace

    from armimpedance.core.motion import MarkerRecording
    from armimpedance.limb.mocap import calibrate_sites
    from armimpedance.show.verbs.results import read

    if arguments.standing is None:
        return recording
    standing = read(arguments.standing, **{**options, "emg_channels": {}, "forces": None})
    if not isinstance(standing, MarkerRecording) or recording.skeleton is None:
        raise InputError("no markers", file=arguments.standing, expected="a standing trial")
    skeleton = calibrate_sites(recording.skeleton, with_names(standing, arguments))
    return replace(recording, skeleton=skeleton)
