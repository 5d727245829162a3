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

from armimpedance.core.errors import InputError
from armimpedance.show.command.outputs import (
    FIGURE,
    TABLE,
    Output,
    add_figure,
    add_out,
    check_outputs,
)


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
    add_out(
        parser, "how far the groups stand apart; in a .json everybody's value too", TABLE, long=True
    )
    add_figure(parser, "everybody's value, the groups' means and the threshold")


def run(arguments: argparse.Namespace) -> int:
    """Read, tell apart, write, print."""
    from armimpedance.app.study import discriminate
    from armimpedance.hand.comparison.show import discrimination_text, plot_discrimination
    from armimpedance.show.command.options import draw_picture
    from armimpedance.show.command.outputs import check_long, write_result

    out, figure, groups = arguments.out, arguments.figure, arguments.group
    files = [Path(file) for _, *given in groups for file in given]
    check_outputs(Output("--out", out, TABLE), Output("--figure", figure, FIGURE), reads=files)
    check_long(arguments)
    _check_names(groups)
    result = discriminate(
        {name: given for name, *given in groups},
        parameter=arguments.parameter,
        joint=arguments.joint,
    )
    write_result(result.content, arguments)
    print(discrimination_text(result))
    draw_picture(
        arguments,
        lambda: plot_discrimination(result),
        "The value of every person, the groups' means with their standard deviations, and the "
        "threshold that tells the groups apart.",
    )
    return 0


def _check_names(groups: list[list[str]]) -> None:
    """Refuse groups without a name of their own, or without people."""
    for name, *files in groups:
        if not files:
            raise InputError(
                f"--group {name} without files", expected="a name, then one file a person"
            )
        if Path(name).suffix == ".json":
            raise InputError(f"--group {name}", expected="the group's name before its files")
    names = [name for name, *_ in groups]
    if len(names) > len(set(names)):
        raise InputError(f"two groups of the name {names[0]}", expected="a name each")
