"""Can one number tell two groups of people apart, such as patients' and controls' stiffness?

Examples:
  armimpedance discriminate --group controls c*.json --group patients p*.json --parameter k
  armimpedance discriminate --group controls c*.json --group patients p*.json --parameter k \\
      --joint 2 --out groups.json --figure groups.png

Each FIT.json is one person (as `passive` writes it). Printed: the difference of means, the effect
size (Hedges' g), Mann-Whitney's test, the area under the ROC curve, and how many people a threshold
puts right that was made without them; all with 95 % intervals.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from armimpedance.comparison import Group


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "--group",
        action="append",
        nargs="+",
        required=True,
        metavar=("NAME", "FIT.json"),
        help="a name, then one file a person; twice",
    )
    parser.add_argument("--parameter", default="k", metavar="NAME", help="default: k")
    parser.add_argument("--joint", type=int, metavar="N", help="where a fit has several, from 1")
    parser.add_argument("--out", type=Path, metavar="GROUPS.json")
    parser.add_argument("--figure", type=Path, metavar="PATH.png")


def run(arguments: argparse.Namespace) -> int:
    """Read, tell apart, print, write."""
    from armimpedance.cli.parts.checks import check_outputs
    from armimpedance.comparison import discriminate
    from armimpedance.errors import InputError
    from armimpedance.files import write_json
    from armimpedance.report import discrimination_object, discrimination_text

    check_outputs(figure=arguments.figure, out=arguments.out)
    if len(arguments.group) != 2:
        raise InputError(f"{len(arguments.group)} groups", expected="two, each after --group")
    (first, unit), (second, other) = (_group(given, arguments) for given in arguments.group)
    if unit != other:
        raise InputError(f"{arguments.parameter} in {unit} and in {other}", expected="one unit")
    result = discriminate(first, second)
    quantity = f"{arguments.parameter} ({unit})" if unit else arguments.parameter
    print(discrimination_text(result, quantity))
    if arguments.out is not None:
        write_json(discrimination_object(result, quantity), arguments.out)
    if arguments.figure is not None:
        from armimpedance.plots import plot_discrimination, save

        figure, path = plot_discrimination(result, quantity).get_figure(), arguments.figure
        save(figure, path.with_suffix(""), (path.suffix[1:],))  # type: ignore[arg-type]
    return 0


def _group(given: list[str], arguments: argparse.Namespace) -> tuple[Group, str]:
    """A group and the unit of its values."""
    import numpy as np

    from armimpedance.comparison import Group
    from armimpedance.errors import InputError
    from armimpedance.files import read_parameter

    name, *files = given
    if not files:
        raise InputError(f"--group {name} without files", expected="a name, then one file a person")
    if Path(name).suffix == ".json":
        raise InputError(f"--group {name}", expected="the group's name before its files")
    twice = {file for file in files if files.count(file) > 1}
    if twice:
        raise InputError(f"group {name}: {min(twice)} stands twice", expected="one file a person")
    read = [read_parameter(file, arguments.parameter, arguments.joint) for file in files]
    units = {parameter.unit for parameter in read}
    if len(units) > 1:
        raise InputError(f"group {name}: {' and '.join(sorted(units))}", expected="one unit")
    people = tuple(Path(file).stem for file in files)
    values, sds = np.array([(p.value, p.sd_robust) for p in read]).T
    return Group(name, people, values, sds), read[0].unit
