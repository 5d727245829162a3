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
    from dataclasses import replace

    from armimpedance.levels.joint import to_joint
    from armimpedance.levels.posture import arm_posture_for
    from armimpedance.recordings.metadata import read_metadata
    from armimpedance.report.results_csv import read_results, write_results
    from armimpedance.report.text_table import summary_table

    subject = read_metadata(arguments.recording / "recording.json").subject
    mapped = []
    for row in read_results(arguments.results):
        posture, source = arm_posture_for(row, subject)
        joint = to_joint(row, posture, force_dependent=not arguments.no_force_term)
        mapped.append(replace(joint, provenance=(*joint.provenance, source)))
    print(summary_table(mapped))
    write_results(mapped, arguments.out)
    print(f"\n{len(mapped)} rows written to {arguments.out}")
    return 0
