"""Map hand-level results to the joints, the covariance carried along.

Examples:
  armimpedance map hand.csv --recording session --to joint --out joint.csv
  armimpedance map hand.csv --recording session --to joint --no-force-term --out paper.csv

K_j = J^T K_e J - Gamma(F), B_j = J^T B_e J, M_j = J^T M_e J, with J at each row's posture and
Gamma the term that the mean hand force adds; --no-force-term leaves it out, as Tsuji (1997) does.
Segment lengths come from the recording's subject, or from its height.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.arm.two_link import TwoLinkArm
    from armimpedance.records import Subject


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("results", metavar="RESULTS.csv", type=Path)
    parser.add_argument("--recording", required=True, type=Path, metavar="RECORDING")
    parser.add_argument("--to", choices=("joint",), required=True)
    parser.add_argument("--out", required=True, type=Path, metavar="RESULTS2.csv")
    parser.add_argument(
        "--no-force-term", action="store_true", help="leave Gamma(F) out, as the source does"
    )


def run(arguments: argparse.Namespace) -> int:
    """Map every row, print a table, write the results."""
    from armimpedance.levels.joint import arm_posture_for, to_joint
    from armimpedance.recordings.folder import read_subject
    from armimpedance.report.results_csv import read_results, write_results
    from armimpedance.report.text_table import summary_table

    arm = arm_of(read_subject(arguments.recording), str(arguments.recording))
    mapped = []
    for row in read_results(arguments.results):
        posture = arm_posture_for(row, arm)
        mapped.append(to_joint(row, posture, force_dependent=not arguments.no_force_term))
    print(summary_table(mapped))
    write_results(mapped, arguments.out)
    print(f"\n{len(mapped)} rows written to {arguments.out}")
    return 0


def arm_of(subject: Subject, where: str) -> TwoLinkArm:
    """The two-link arm of a recording's subject.

    Raises
    ------
    InputError
        If neither segment lengths nor height are known.
    """
    from armimpedance.arm.anthropometry import two_link_arm
    from armimpedance.errors import InputError

    known = subject.upper_arm_m is not None and subject.forearm_hand_m is not None
    if not known and subject.height_m is None:
        raise InputError(
            "the subject's segment lengths are not known",
            file=where,
            column="subject",
            expected="upper_arm_m and forearm_hand_m, or height_m, in recording.json",
        )
    # The mapping uses lengths only; masses matter to the model's inertia, not here.
    return two_link_arm(
        subject.mass_kg or 70.0,
        subject.height_m or 1.75,
        upper_arm_m=subject.upper_arm_m,
        forearm_hand_m=subject.forearm_hand_m,
    )
