"""Turn a lab's files into a recording: a folder of three tables that every command reads.

Examples:
  armimpedance convert exam.zip session
  armimpedance convert exam.zip hard --protocol 3 --protocol 4 --event PERTURB_ON --without-errors
  armimpedance convert exam.zip first --events PERTURB_ON PERTURB_OFF \\
      --where "TP in (3, 4) and block == 1 and is_error == 0"
  armimpedance convert exam_folder session --force-by limb --side right --emg ACH0=biceps_long
  armimpedance convert session session_csv --table csv
  armimpedance convert swing.c3d relaxed --skeleton elbow --mass-kg 70 --height-m 1.75 \\
      --marker RSHO=acromion_right --standing upright.c3d --emg Biceps.EMG4=biceps

Kinarm (Dexterit-E) exams: a .kinarm archive, a folder or zip of BB_TT_RR.c3d and common.c3d, or one
trial's file with common.c3d beside it. Whose force the sensor's columns hold no file says: it is
found from the robot's own inertias and motor torques, with the evidence, or --force-by states it
(where both are there and contradict each other, a warning says so). The tables of trial protocols,
targets and loads become columns of the trial table. Personal fields (subject, operator, dates) stay
out unless --keep-personal. What no file says can be given: the mass between sensor and hand, where
the shoulder was (endpoint robots), the subject's size.

Trials without samples, and trials that are broken or not as the others (not finite, another rate,
a channel that is missing, a dead sensor), are left out; how many, which and why stands in the
provenance and on stderr.

Exit status: 0 done, also where trials without samples were left out; 3 done, but trials that hold
samples were left out because they are broken; 2 the input or the call is wrong, nothing is
written; 1 anything else.

Motion capture: a C3D or .trc becomes a recording of markers, a .mot or .sto one of joint angles,
each with a skeleton; `passive` and `body` read them.

A folder that is there already is replaced only with --replace, and only if it is a recording.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from armimpedance.app.cli.convert_motion import (
    add_skeleton,
    refuse_markers,
    skeleton_of,
    with_names,
    with_standing,
)
from armimpedance.core.errors import InputError, check_number
from armimpedance.show.command.options import add_reading, reading_options
from armimpedance.show.command.outputs import OutputPath, add_replace, check_folder

if TYPE_CHECKING:
    from armimpedance.recordings import AnyRecording

#: Exit status where trials that hold samples were left out.
LEFT_OUT = 3

SUBJECT_FIELDS = ("mass_kg", "height_m", "upper_arm_m", "forearm_hand_m")


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("input", metavar="INPUT", type=Path)
    parser.add_argument("output", metavar="OUTPUT_FOLDER", type=OutputPath)
    add_reading(parser)
    add_skeleton(parser)
    stated = parser.add_argument_group("what the files do not say")
    stated.add_argument("--handle-mass-kg", type=float, metavar="KG")
    stated.add_argument("--shoulder-m", type=float, nargs=2, metavar=("X", "Y"))
    for field in SUBJECT_FIELDS:
        unit = field.rsplit("_", 1)[1].upper()
        stated.add_argument(f"--{field.replace('_', '-')}", type=float, metavar=unit)
    parser.add_argument("--table", choices=("parquet", "csv"), default="parquet")
    add_replace(parser)


def run(arguments: argparse.Namespace) -> int:
    """Read, write, say what was done."""
    from armimpedance.core.motion import MarkerRecording
    from armimpedance.recordings import FOLDER_FILES, write_recording
    from armimpedance.show.text import describe
    from armimpedance.show.verbs.results import read

    if arguments.output.resolve() == arguments.input.resolve():
        raise InputError("is read and written", file=arguments.output, expected="another folder")
    check_folder(arguments.output, FOLDER_FILES, replace=arguments.replace)
    if arguments.standing is not None and arguments.skeleton is None:
        raise InputError("--standing without --skeleton", expected="the segments markers sit on")
    sizes = _sizes(arguments)
    options = reading_options(arguments)
    recording = read(arguments.input, skeleton=skeleton_of(arguments), **options)
    if isinstance(recording, MarkerRecording):
        recording = with_standing(with_names(recording, arguments), arguments, options)
    else:
        refuse_markers(arguments)
    recording = _with_statements(recording, sizes, arguments)
    write_recording(recording, arguments.output, arguments.table)
    print(describe(recording, f"{arguments.input} -> {arguments.output}"))
    return _told(recording)


def _told(recording: AnyRecording) -> int:
    """Say on stderr what was left out or contradicts itself; the exit status."""
    from armimpedance.core.records import Recording

    findings = recording.findings if isinstance(recording, Recording) else ()
    for finding in findings:
        if finding.verdict == "warning":
            print(f"armimpedance convert: {finding.sentence}", file=sys.stderr)
    return LEFT_OUT if any(f.name == "broken trials" for f in findings) else 0


def _sizes(arguments: argparse.Namespace) -> dict[str, Any]:
    """The subject's measures that were given."""
    measures = {name: getattr(arguments, name) for name in SUBJECT_FIELDS}
    sizes = {name: value for name, value in measures.items() if value is not None}
    for name, value in sizes.items():
        check_number(value, f"--{name.replace('_', '-')} {value:g}", above=0)
    return sizes


def _with_statements(
    recording: AnyRecording, sizes: dict[str, Any], arguments: argparse.Namespace
) -> AnyRecording:
    """The recording with what the user knows and the files do not."""
    from dataclasses import replace

    import numpy as np

    from armimpedance.core.records import Recording

    subject = replace(recording.subject, **sizes)
    if not isinstance(recording, Recording):
        for name in ("handle_mass_kg", "shoulder_m"):
            if getattr(arguments, name) is not None:
                option = f"--{name.replace('_', '-')} with motion capture"
                raise InputError(option, expected="it with recordings of the hand only")
        return replace(recording, subject=subject)
    changes: dict[str, object] = {}
    if arguments.handle_mass_kg is not None:
        changes["handle_mass_kg"] = arguments.handle_mass_kg
    if arguments.shoulder_m is not None:
        changes["shoulder_m"] = np.array(arguments.shoulder_m)
    stated = ", ".join(sorted(set(changes) | set(sizes)))
    if not stated:
        return recording
    if sizes:
        changes["subject"] = subject
    return recording.with_step(f"Stated at conversion: {stated}.", **changes)
