"""Options that several commands have: of reading, figures, overruled checks, sharing."""

from __future__ import annotations

import argparse
import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Final, NoReturn

from armimpedance.core.errors import LONGEST_MESSAGE, InputError, shortened, shown
from armimpedance.core.method_table import MethodTable
from armimpedance.show.command.failures import WRONG_INPUT
from armimpedance.show.verbs.chosen import ChosenPath
from armimpedance.show.verbs.options import LEAVE_OUT


def add_reading(parser: argparse.ArgumentParser) -> None:
    """The options of all formats; one that the file at hand cannot use is refused."""
    _add_where(parser)
    _add_kinarm(parser.add_argument_group("Kinarm exams"))
    parser.add_argument(
        "--emg",
        action="append",
        default=[],
        metavar="CHANNEL=MUSCLE",
        help="an analog channel that holds EMG, for example ACH0=biceps_long; may be repeated",
    )
    _add_mapping(parser)
    parser.add_argument(
        "--strict",
        action="store_true",
        help="refuse a table whose time stamps scatter; else it is brought to an even clock",
    )
    title = "motion capture (.c3d, .trc, .mot, .sto: one trial a file)"
    _add_capture(parser.add_argument_group(title))


def _add_where(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--where",
        metavar="EXPRESSION",
        help="trials for which this holds only, over the columns of the trial table: "
        '"TP == 3 and is_error == 0", "block in (1, 2)"',
    )


def _add_mapping(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--mapping",
        type=Path,
        metavar="FILE.toml",
        help="what the columns of a table of any layout mean; `map-columns` proposes one "
        "(default: columns.toml beside it)",
    )


def _add_kinarm(kinarm: argparse._ArgumentGroup) -> None:
    kinarm.add_argument(
        "--force-by",
        choices=("limb", "device"),
        help="whose force on the other the sensor's columns (a C3D's force plates) hold; else "
        "the robot's own inertias and motor torques (the plates' load) must show it",
    )
    kinarm.add_argument("--side", choices=("right", "left"), help="arm, where both are recorded")
    kinarm.add_argument(
        "--events",
        nargs=2,
        metavar=("ONSET", "END"),
        help="events at which the disturbance begins and is back",
    )
    kinarm.add_argument("--onset-event", metavar="LABEL", help="event at the disturbance's onset")
    kinarm.add_argument("--end-event", metavar="LABEL", help="event when it is back")
    kinarm.add_argument(
        "--protocol",
        action="append",
        default=[],
        type=int,
        metavar="N",
        help="trials of this trial protocol only; may be repeated",
    )
    kinarm.add_argument(
        "--event",
        action="append",
        default=[],
        metavar="LABEL",
        help="trials in which this event occurred only; may be repeated",
    )
    kinarm.add_argument(
        "--without-errors", action="store_true", help="no trials that the task marked as errors"
    )
    kinarm.add_argument("--keep-personal", action="store_true", help="keep subject and dates")


def _add_capture(capture: argparse._ArgumentGroup) -> None:
    capture.add_argument("--prefix", metavar="NAME", help=".c3d: whose markers (NAME:marker)")
    capture.add_argument("--axes", metavar="X,Y,Z", help="axes forward, left, up, such as x,-z,y")
    capture.add_argument(
        "--angle",
        action="append",
        default=[],
        metavar="COORDINATE=COLUMN",
        help=".mot, .sto: the column of an angle, -COLUMN turns its sign; may be repeated",
    )
    capture.add_argument(
        "--forces",
        type=Path,
        metavar="FILE.mot",
        help=".trc: ground reaction forces, points and torques beside it",
    )
    capture.add_argument("--in-degrees", choices=("yes", "no"), help="where a table does not say")


def add_choice(parser: argparse.ArgumentParser, *recordings: str, leave_out: bool = True) -> None:
    """The options of every analysis: which trials, by which mapping, without which.

    `recordings`: the arguments that hold paths of recordings; `choose` puts the choice to them.
    `leave_out`: whether there is ``--leave-out``; else the command has its own.
    """
    _add_where(parser)
    _add_mapping(parser)
    if leave_out:
        LEAVE_OUT.add(parser)
    parser.set_defaults(chosen=(recordings, leave_out))


def choose(arguments: argparse.Namespace) -> None:
    """Put what is chosen of the recordings to their paths."""
    names, leave_out = getattr(arguments, "chosen", ((), False))
    chosen = [arguments.where, arguments.mapping] if names else []
    chosen += [arguments.leave_out if leave_out else None]
    for name in names:
        given = getattr(arguments, name)
        if isinstance(given, Path):
            setattr(arguments, name, ChosenPath.of(given, *chosen))
        elif given is not None:
            setattr(arguments, name, [ChosenPath.of(path, *chosen) for path in given])


def reading_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options as fields of `recordings.ReadOptions`, the skeleton aside.

    Raises InputError: a word is not of the form LEFT=RIGHT, or the events are told twice.
    """
    axes, degrees = arguments.axes, arguments.in_degrees
    onset, end = _events(arguments)
    return {
        "force_by": arguments.force_by,
        "side": arguments.side,
        "onset_event": onset,
        "end_event": end,
        "protocols": tuple(arguments.protocol),
        "events": tuple(arguments.event),
        "without_errors": arguments.without_errors,
        "keep_personal": arguments.keep_personal,
        "emg_channels": pairs(arguments.emg, "--emg", "CHANNEL=MUSCLE, as ACH0=biceps_long"),
        "prefix": arguments.prefix,
        "axes": None if axes is None else tuple(axes.split(",")),
        "angles": pairs(arguments.angle, "--angle", "COORDINATE=COLUMN"),
        "forces": arguments.forces,
        "in_degrees": None if degrees is None else degrees == "yes",
        "mapping": arguments.mapping,
        "strict": arguments.strict,
        "where": arguments.where,
    }


def _events(arguments: argparse.Namespace) -> tuple[str | None, str | None]:
    """The events of the onset and the end, told together or one by one."""
    single = arguments.onset_event, arguments.end_event
    if arguments.events is None:
        return single
    if single != (None, None):
        problem = "--events with --onset-event or --end-event"
        raise InputError(problem, expected="one way to tell the onset and the end")
    onset, end = arguments.events
    return onset, end


def pairs(words: list[str], option: str, expected: str) -> dict[str, str]:
    """``LEFT=RIGHT`` words as a mapping.

    Raises InputError: a word of another form.
    """
    split = {}
    for word in words:
        left, equals, right = word.partition("=")
        if not (left and equals and right):
            raise InputError(f"{option} {word}", expected=expected)
        split[left] = right
    return split


# The option ``--figure``: drawn for print or a talk, the caption beside it or below.


def draw_picture(
    arguments: argparse.Namespace,
    draw: Callable[[], Any],
    caption: str,
    suffix: str = "",
) -> None:
    """Draw and write what ``--figure`` asks for, if it does, and say where.

    `arguments`: with the options of `outputs.add_figure`.
    `draw`: gives a figure, axes or an array of axes; called only where a figure is asked for.
    `suffix`: added to the name, where a command draws more than one picture.
    """
    if arguments.figure is None:
        return
    from armimpedance.show.plots import drawn_for, save_with_caption

    path = arguments.figure.with_name(f"{arguments.figure.stem}{suffix}{arguments.figure.suffix}")
    with drawn_for(arguments.style):
        drawn = draw()
        drawn = drawn.flat[0] if hasattr(drawn, "flat") else drawn
        figure = drawn if hasattr(drawn, "savefig") else drawn.get_figure(root=True)
        formats, stem = (path.suffix[1:],), path.with_suffix("")
        save_with_caption(figure, stem, formats, caption, baked=arguments.caption)
    print(f"figure written to {path}")


# What a page may be called.

PAGE: Final = (".html",)

# The forms in which recordings and results are shared, by their names.

#: Each with `what`, `endings`, `takes` and `share`; nothing is imported for their names.
SHARED_FORMS: Final[MethodTable[Any]] = MethodTable(
    "armimpedance.show.files.sharing.forms", "FORM", "form", joint="-"
)

# The parser whose errors are one line, and its subcommands. Standard library only.


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Print one line on stderr and exit 2."""
        message = _did_you_mean(message)
        hint = f" (see {self.prog} --help)"
        line = shortened(shown(message), LONGEST_MESSAGE - len(hint))
        self.exit(WRONG_INPUT, f"{self.prog}: {line}{hint}\n")


def _did_you_mean(message: str) -> str:
    """Replace a long list of choices in argparse's message by those nearest to the word."""
    match = re.search(r"argument (\w+): invalid choice: '(.*)' \(choose from (.*)\)$", message)
    if match is None:
        return message
    kind, word, listed = match.groups()
    choices = [choice.strip("' ") for choice in listed.split(",")]
    near = _close(word, choices, most=2, alike=0.7)
    if near:
        return f"no {kind.lower()} {word!r}: did you mean {' or '.join(near)}?"
    return message if len(choices) <= _FEW else f"no {kind.lower()} {word!r}"


def _close(word: str, choices: Sequence[str], most: int, alike: float) -> list[str]:
    """The choices that are most like a word."""
    from difflib import get_close_matches  # only where something is misspelt

    return get_close_matches(word, choices, n=most, cutoff=alike)


def nearest_options(parser: argparse.ArgumentParser, prog: str, words: Sequence[str]) -> str:
    """The options of a subcommand that are nearest to words it does not know; "" for none."""
    if parser.prog == prog:
        options = [name for action in parser._actions for name in action.option_strings]
        near = [_close(word.partition("=")[0], options, most=1, alike=0.6) for word in words]
        return " or ".join(dict.fromkeys(name for found in near for name in found))
    for action in parser._actions:
        choices: Any = action.choices if isinstance(action.choices, dict) else {}
        for below in choices.values():
            if prog == below.prog or prog.startswith(f"{below.prog} "):
                return nearest_options(below, prog, words)
    return ""


#: So many choices are listed where none is near.
_FEW: Final = 28


def grouped(groups: Mapping[str, Sequence[str]], lines: Mapping[str, str]) -> str:
    """Commands by what a reader wants to do, with their lines; of an overview."""
    width = max(map(len, lines)) + 2
    indent = " " * (width + 2)
    parts = []
    for title, names in groups.items():
        rows = [
            textwrap.fill(
                lines[name].replace("%%", "%"),
                width=80,
                initial_indent=f"  {name:<{width}}",
                subsequent_indent=indent,
            )
            for name in names
        ]
        parts.append("\n".join([f"{title}:", *rows]))
    return "\n\n".join(parts)


def add_commands(
    parser: argparse.ArgumentParser,
    lines: Mapping[str, str],
    places: str | Mapping[str, str],
    metavar: str,
    argv: Sequence[str] | None = None,
    *,
    listed: bool = True,
) -> None:
    """Add a subcommand for each line.

    `lines`: name of a subcommand -> its line in the overview.
    `places`: the package whose modules bear these names, or name -> module. Each module has
    `configure`, `run` and a docstring, which is the subcommand's help.
    `metavar`: name of the subcommands in the help.
    `argv`: the words of the call; modules that it does not ask for are not imported. Where the
    first word is a subcommand no other is added.
    `listed`: whether the help lists them; else the overview does.
    """
    plain = argparse.RawDescriptionHelpFormatter
    commands: Any = add_parsers(parser, metavar, listed=listed)
    chosen = next((word for word in argv or () if word in lines), None)
    alone = chosen is not None and argv is not None and argv[0] == chosen
    for name, line in lines.items():
        if alone and name != chosen:
            continue
        if argv is not None and name != chosen:
            commands.add_parser(name, **({"help": line} if listed else {}))
            continue
        own = f"{places}.{name.replace('-', '_')}"
        module = import_module(own if isinstance(places, str) else places[name])
        described: dict[str, Any] = {"description": module.__doc__, "formatter_class": plain}
        sub = commands.add_parser(name, **described, **({"help": line} if listed else {}))
        if hasattr(module, "run"):
            sub.set_defaults(run=module.run, prog=sub.prog)
        module.configure(sub)


def add_parsers(
    parser: argparse.ArgumentParser, metavar: str, *, listed: bool = True
) -> argparse._SubParsersAction[OneLineParser]:
    """Where the subcommands of a parser are added, whose errors are one line."""
    return parser.add_subparsers(
        dest=metavar.lower(),
        metavar=metavar,
        prog=parser.prog,
        required=True,
        parser_class=OneLineParser,
        help=None if listed else argparse.SUPPRESS,
    )
