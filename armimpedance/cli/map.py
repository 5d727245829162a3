"""Map hand-level results to the joints, or on to the muscles, the covariance carried along.

Examples:
  armimpedance map hand.csv --recording session --to joint --out joint.csv
  armimpedance map hand.csv --recording session --to joint --no-force-term --out paper.csv
  armimpedance map hand.csv --recording session --to muscle --arm planar6 --out muscle.csv
  armimpedance map joint.csv --recording session --to muscle --arm arms.csv --share emg --out m.csv

To the joints: K_j = J^T K_e J - Gamma(F), B_j = J^T B_e J, M_j = J^T M_e J, with J at each row's
posture and Gamma the term that the mean hand force adds; --no-force-term leaves it out, as Tsuji
(1997) does. Segment lengths come from the recording's subject, or from its height.

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
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.arm import MuscularArm
    from armimpedance.arrays import FloatArray
    from armimpedance.levels import MuscleEstimate
    from armimpedance.recordings import Metadata
    from armimpedance.records import ImpedanceEstimate


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("results", metavar="RESULTS.csv", type=Path)
    parser.add_argument("--recording", required=True, type=Path, metavar="RECORDING")
    parser.add_argument("--to", choices=("joint", "muscle"), required=True)
    parser.add_argument("--out", required=True, type=Path, metavar="RESULTS2.csv")
    parser.add_argument(
        "--no-force-term", action="store_true", help="leave Gamma(F) out, as the source does"
    )
    parser.add_argument("--arm", metavar="ARM", help="planar6, arm26 or a TABLE.csv (to muscle)")
    parser.add_argument(
        "--no-curvature",
        action="store_true",
        help="leave the curvature term out, as the source does (to muscle)",
    )
    parser.add_argument(
        "--share",
        choices=("effort", "emg"),
        help="tensions of least effort (default), or nearest to the measured activation (to "
        "muscle)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Map every row, print a table, write the results."""
    from armimpedance.cli.parts.checks import check_outputs
    from armimpedance.files import read_results
    from armimpedance.recordings import read_metadata

    _check(arguments)
    check_outputs(figure=None, out=arguments.out)
    recorded = read_metadata(arguments.recording / "recording.json")
    rows = read_results(arguments.results)
    force_term = not arguments.no_force_term
    if arguments.to == "joint":
        _write_joint([_at_joint(row, recorded, force_term) for row in rows], arguments.out)
    else:
        _write_muscle(_at_muscle(rows, recorded, arguments), arguments.out)
    print(f"\n{len(rows)} rows written to {arguments.out}")
    return 0


def _check(arguments: argparse.Namespace) -> None:
    from armimpedance.errors import InputError

    if arguments.to == "muscle" and arguments.arm is None:
        raise InputError("--to muscle", expected="--arm planar6, arm26 or a TABLE.csv")
    given = {
        "--arm": arguments.arm is not None,
        "--no-curvature": arguments.no_curvature,
        "--share": arguments.share is not None,
    }
    for name, is_given in given.items():
        if arguments.to == "joint" and is_given:
            raise InputError(name, expected="it with --to muscle only")


def _at_joint(row: ImpedanceEstimate, recorded: Metadata, force_term: bool) -> ImpedanceEstimate:
    from dataclasses import replace

    from armimpedance.levels import arm_posture_for, to_joint

    posture, source = arm_posture_for(row, recorded.subject)
    joint = to_joint(row, posture, force_dependent=force_term)
    return replace(joint, provenance=(*joint.provenance, source))


def _at_muscle(
    rows: list[ImpedanceEstimate], recorded: Metadata, arguments: argparse.Namespace
) -> list[MuscleEstimate]:
    from armimpedance.arm import arm_named
    from armimpedance.errors import ArmImpedanceError, InputError
    from armimpedance.files import condition_of
    from armimpedance.levels import to_muscle

    arm = arm_named(arguments.arm)
    found = []
    for row in rows:
        try:
            activation = _activation(row, recorded, arm) if arguments.share == "emg" else None
            joint = _with_torque(row, recorded)
            if row.level == "hand":
                joint = _at_joint(row, recorded, not arguments.no_force_term)
            found.append(
                to_muscle(joint, arm, curvature=not arguments.no_curvature, activation=activation)
            )
        except ArmImpedanceError as error:
            raise InputError(f"{condition_of(row)}: {error}", file=arguments.results) from error
    return found


def _with_torque(row: ImpedanceEstimate, recorded: Metadata) -> ImpedanceEstimate:
    """A row mapped to the joints before torques were written: J^T F from its angles and force."""
    from dataclasses import replace

    from armimpedance.levels import arm_posture_for

    if row.level != "joint" or row.torque is not None:
        return row
    if row.force is None or row.joint_angles is None:
        return row
    posture, _ = arm_posture_for(row, recorded.subject)
    return replace(row, torque=posture.jacobian.T @ row.force)


def _activation(row: ImpedanceEstimate, recorded: Metadata, arm: MuscularArm) -> FloatArray:
    """The measured activation of the arm's muscles, in their order."""
    from armimpedance.errors import InputError

    if row.activation is None:
        raise InputError("--share emg without activation", expected="columns alpha_1, alpha_2, …")
    names = row.muscles or recorded.muscles or ()
    if len(names) != len(row.activation):
        raise InputError(
            f"{len(row.activation)} activations, {len(names)} muscles in recording.json",
            expected="as many",
        )
    missing = [name for name in arm.paths.muscles if name not in names]
    if missing:
        raise InputError(
            f"no activation of {missing[0]}, a muscle of {arm.name}",
            expected=f"it in the recording beside {', '.join(names)}",
        )
    return row.activation[[names.index(name) for name in arm.paths.muscles]]


def _write_joint(rows: list[ImpedanceEstimate], out: Path) -> None:
    from armimpedance.files import write_results
    from armimpedance.report import summary_table

    print(summary_table(rows))
    write_results(rows, out)


def _write_muscle(rows: list[MuscleEstimate], out: Path) -> None:
    from armimpedance.files import write_muscle_results
    from armimpedance.report import muscle_text

    print(muscle_text(rows))
    write_muscle_results(rows, out)
