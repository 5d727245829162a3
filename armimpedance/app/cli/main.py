"""Parse the call, run one command, turn errors into one line and an exit status.

Standard library only at import: a command imports what it needs when it runs.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Final

from armimpedance.core.errors import ArmImpedanceError, InputError, shortened, shown
from armimpedance.show.command.failures import (
    TRACEBACK,
    WRONG_INPUT,
    AskedToEnd,
    library_warnings,
    naming,
    stopped_in_order,
    told,
)
from armimpedance.show.command.options import (
    OneLineParser,
    add_commands,
    choose,
    grouped,
    nearest_options,
)
from armimpedance.show.command.screen import Screen, safe_screen

#: What a reader wants to do -> command, its module in the package, its line in the overview. A
#: command of one topic stands in the folder of its topic, one that spans the topics here.
_TABLE: Final = {
    "First steps": (
        (
            "demo",
            "lab.demo",
            "the whole study on a simulated subject: recordings, estimates, models, figures",
        ),
        ("new", "lab.new", "an example folder for a laboratory like yours: data, script, notebook"),
        (
            "exam",
            "app.cli.exam",
            "look at a Kinarm exam: protocols, blocks, conditions, events, what to type next",
        ),
        ("app", "app.cli.app", "a page to work in, without programming: from a file to a report"),
        (
            "map-columns",
            "app.cli.map_columns",
            "propose what the columns of a table of any layout mean",
        ),
        ("convert", "app.cli.convert", "turn a lab's files into a recording"),
        ("inspect", "app.cli.inspect", "say what a recording holds and whether it can be used"),
        (
            "trials",
            "hand.still.show.trials_command",
            "look at every trial in a page, leave some out",
        ),
    ),
    "Before the experiment": (
        ("plan", "app.cli.plan", "before the experiment: trials needed, the best disturbance"),
        (
            "next",
            "hand.adaptive.show.command",
            "during the experiment: the next pushes, and how many it still needs",
        ),
        ("simulate", "lab.simulate", "write a simulated experiment and its truth"),
    ),
    "Estimate, compare, show": (
        (
            "estimate",
            "hand.still.show.command",
            "inertia, viscosity and stiffness with 95 %% intervals",
        ),
        (
            "reflex",
            "hand.still.show.reflex_command",
            "is the stiffness the limb's own, or does a reflex stand in it?",
        ),
        (
            "compare",
            "hand.comparison.show.command",
            "what differs between groups of trials, and whether chance could do it",
        ),
        (
            "report",
            "app.cli.report",
            "one page to show: verdict, pictures, intervals, checks, methods paragraph",
        ),
    ),
    "Joints, muscles, models over posture and EMG": (
        (
            "map",
            "hand.levels.show.command",
            "from the hand to the joints, from the joints to the muscles",
        ),
        (
            "fit",
            "muscles.show.command",
            "models over posture and muscle activation, from joint-level results",
        ),
        (
            "predict",
            "muscles.show.predict_command",
            "joint or hand impedance where nobody measured, from a fitted model",
        ),
        (
            "explore",
            "muscles.show.explore_command",
            "an arm to play with: drag the hand, stiffness and viscosity follow",
        ),
        (
            "live",
            "muscles.live.show.command",
            "stiffness of the hand from posture and muscle activity, sample by sample",
        ),
    ),
    "Other experiments": (
        (
            "movement",
            "hand.reaching.show.command",
            "inertia, viscosity and stiffness of the hand while it reaches",
        ),
        (
            "random",
            "hand.random.show.command",
            "a hand, wrist or ankle under random perturbations in 2 or 3 axes: M, B, K, reflex",
        ),
        (
            "elbow",
            "joint.elbow.show.command",
            "one joint under a random perturbation: I, B, K, over time, over EMG",
        ),
        (
            "passive",
            "joint.relaxed.show.command",
            "stiffness, viscosity and friction of relaxed joints (motion capture or torque)",
        ),
        (
            "body",
            "joint.body.show.command",
            "masses and inertias of a moving body from contact forces; a robot's from its torques",
        ),
        (
            "therapy",
            "joint.therapy.show.commands",
            "how much of a movement with a therapy robot is the patient's own",
        ),
    ),
    "Many people, and sharing": (
        (
            "study",
            "app.cli.study",
            "a folder of people to one table and one report; repeats only what changed",
        ),
        ("discriminate", "app.cli.discriminate", "can one number tell two groups of people apart?"),
        (
            "share",
            "app.cli.share",
            "recordings and results as BIDS, JSON-LD or a datasheet, for a data repository",
        ),
    ),
    "Check the methods": (
        (
            "simulate-study",
            "lab.simulate_study",
            "many simulated sessions: coverage, power, methods against each other",
        ),
        (
            "benchmark",
            "lab.benchmark_command",
            "tasks with sealed truths, submissions in any language, one table of scores",
        ),
        ("figures", "lab.figures", "draw the sources' figures from simulated subjects"),
    ),
}
#: Heading of the overview -> its commands.
GROUPS: Final = {title: [name for name, _, _ in rows] for title, rows in _TABLE.items()}
COMMANDS: Final = {name: line for rows in _TABLE.values() for name, _, line in rows}
PLACES: Final = {
    name: f"armimpedance.{place}" for rows in _TABLE.values() for name, place, _ in rows
}

OVERVIEW: Final = """\
Inertia, viscosity and stiffness of the human arm from small disturbances.

A first session:
  armimpedance demo --quick                       see everything work, in seconds
  armimpedance convert exam.kinarm session        a Kinarm exam, a C3D, a CSV, ...
  armimpedance inspect session                    can it be used?
  armimpedance estimate session --out hand.csv --figure hand.png
  armimpedance compare session --by condition --figure postures.png
  armimpedance report session --out report.html   a page to show
  armimpedance map hand.csv --recording session --to joint --out joint.csv
  armimpedance fit moment-arms joint.csv --out posture.json
"""
#: Each command has examples of its own.
CLOSING: Final = "armimpedance COMMAND --help shows the options of a command, and examples."


def make_parser(argv: Sequence[str]) -> argparse.ArgumentParser:
    """The parser for this call; only the module of the command that it names is imported."""
    from armimpedance import __version__

    plain = argparse.RawDescriptionHelpFormatter
    parser = OneLineParser(
        prog="armimpedance",
        usage="armimpedance [-h] [--version] COMMAND ...",
        description=OVERVIEW,
        epilog=f"{grouped(GROUPS, COMMANDS)}\n\n{CLOSING}",
        formatter_class=plain,
    )
    parser.add_argument("--version", action="version", version=f"armimpedance {__version__}")
    add_commands(parser, COMMANDS, PLACES, "COMMAND", argv, listed=False)
    return parser


def run(argv: list[str]) -> int:
    """Run one call, and turn whatever goes wrong into one line.

    Exit status: 0 done, 2 the input or the call is wrong, 130 interrupted, 143 ended by SIGTERM,
    129 by SIGHUP, 1 anything else. A command may add its own, documented in its help: `convert`
    has 3.
    """
    if "_ARGCOMPLETE" in os.environ:
        return _complete()
    try:
        with stopped_in_order() as asked:
            return _run_call(argv, asked)
    except KeyboardInterrupt as error:  # before or after the command itself
        return _fail("armimpedance", error)


def _complete() -> int:
    """Offer the shell the words that may follow; argcomplete says what was typed and ends here."""
    try:
        import argcomplete
    except ImportError:
        return 1
    typed = os.environ.get("COMP_LINE", "")[: int(os.environ.get("COMP_POINT", "0"))]
    argcomplete.autocomplete(make_parser(typed.split()[1:]))
    return 1


def _run_call(argv: list[str], asked: AskedToEnd) -> int:
    with safe_screen() as screen:
        parser = make_parser(argv)
        arguments, unknown = parser.parse_known_args(argv)
        if unknown:
            words = shortened(shown(" ".join(unknown)), 200)
            near = nearest_options(parser, arguments.prog, unknown)
            hint = f": did you mean {near}?" if near else ""
            see = f"(see {arguments.prog} --help)"
            _tell(arguments.prog, f"no such option here: {words}{hint} {see}")
            return WRONG_INPUT
        status = _run(arguments, asked)
    if status == 0 and screen is not None and screen.failed is not None:
        return _fail(arguments.prog, screen.failed)
    return status


def _run(arguments: argparse.Namespace, asked: AskedToEnd) -> int:
    """Run a command; its exit status."""
    warned: list[str] = []
    earlier = _earlier_files(arguments)
    with library_warnings(warned.append):
        status = _status(arguments, asked)
    if status == 0:
        warned += [f"{path}: an earlier file was replaced" for path in earlier]
    # Where the input is refused, the refusal says it all.
    for line in warned if status != WRONG_INPUT else ():
        _tell(arguments.prog, line)
    return status


def _earlier_files(arguments: argparse.Namespace) -> list[str]:
    """Files that stand already where the command will write, and that nobody agreed to replace.

    A result is made anew by typing its command again, so it needs no option; a line tells of it.
    """
    from armimpedance.show.command.outputs import OutputPath

    if getattr(arguments, "replace", False):
        return []
    values = vars(arguments).values()
    return [shown(str(path)) for path in values if isinstance(path, OutputPath) and path.is_file()]


def _status(arguments: argparse.Namespace, asked: AskedToEnd) -> int:
    try:
        _check_environment()
        choose(arguments)
        return int(arguments.run(arguments) or 0)
    except Exception as error:
        _settle_what_was_printed(error)
        if os.environ.get(TRACEBACK) and not isinstance(error, ArmImpedanceError):
            raise
        return _fail(arguments.prog, asked.why or error, arguments)
    except KeyboardInterrupt as error:
        _settle_what_was_printed(error)
        return _fail(arguments.prog, error)


def _settle_what_was_printed(error: BaseException) -> None:
    """Print the buffered text before a refusal; drop it before another error.

    It may name files that were never written.
    """
    if isinstance(sys.stdout, Screen):
        if isinstance(error, InputError):
            sys.stdout.flush()
        else:
            sys.stdout.forget()


def _check_environment() -> None:
    """Refuse what libraries would fail on in the midst of the work, with words of their own."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    if epoch is not None and not (epoch.isascii() and epoch.isdigit()):
        problem = f"SOURCE_DATE_EPOCH={shortened(shown(epoch), 40)} in the environment"
        raise InputError(problem, expected="whole seconds since 1970")
    if sys.flags.optimize > 1:
        problem = "Python leaves the texts of functions out (PYTHONOPTIMIZE=2 or -OO)"
        raise InputError(
            problem, expected="PYTHONOPTIMIZE=1 or none: libraries of pictures read them"
        )


def _fail(prog: str, error: BaseException, arguments: argparse.Namespace | None = None) -> int:
    line, status = told(error)
    if arguments is not None and isinstance(error, ArmImpedanceError):
        line = naming(line, vars(arguments))
    _tell(prog, line)
    return status


def _tell(prog: str, line: str) -> None:
    # Where standard error is closed too, only the exit status is left to tell it.
    if sys.stderr is None:  # print would take standard output in its place
        return
    with suppress(OSError, ValueError):
        print(f"{prog}: {line}", file=sys.stderr, flush=True)
