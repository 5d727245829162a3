"""Write recordings or results in the forms that data repositories ask for.

Examples:
  armimpedance share session --as bids --out dataset --name "Stiffness of the arm" --licence CC0-1.0
  armimpedance share hand.csv --as bids-derivative --out derivatives --creator "A. Example"
  armimpedance share session hand.csv --as json-ld --out dataset.jsonld --description "..."
  armimpedance share session --as datasheet --out DATASHEET.md

bids: one recording as a raw dataset of Motion-BIDS, a table of text in which every number keeps all
its digits; `convert` reads it again, bit for bit (EMG of motion capture is written in 24 bits).
bids-derivative: tables of results, every column described with its unit. json-ld: metadata in the
words of schema.org/Dataset, with the variables, their units and the files' checksums. datasheet:
what is known filled in, the questions that only you can answer left open.

What only you can know (name, creators, licence, ...) is written where you give it, and otherwise
left out; the command says what is missing. Personal data are not written: no names, no dates. The
person's label, mass and height are, where the recording has them; --subject gives another label.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import inputs_now
from armimpedance.show.command.options import SHARED_FORMS, add_reading, reading_options
from armimpedance.show.command.outputs import Output, OutputPath, add_replace, check_outputs

_RESULTS = ".csv"
_MARK = "dataset_description.json"
_TOP = (_MARK, "README.md", "participants.tsv", "participants.json", "code", ".bidsignore")


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("inputs", metavar="RECORDING|RESULTS.csv", type=Path, nargs="+")
    parser.add_argument("--as", dest="form", required=True, choices=SHARED_FORMS.names)
    parser.add_argument(
        "--out", required=True, type=OutputPath, metavar="PLACE", help="folder or file"
    )
    add_replace(parser)
    group = parser.add_argument_group("what only you can say")
    group.add_argument("--name", metavar="TEXT")
    group.add_argument("--description", metavar="TEXT")
    for option, what in (("creator", "a person"), ("keyword", "a word"), ("funding", "a grant")):
        group.add_argument(
            f"--{option}",
            action="append",
            default=[],
            metavar="TEXT",
            help=f"{what}; may be repeated",
        )
    group.add_argument("--licence", metavar="NAME", help="such as CC0-1.0, or an address")
    group.add_argument("--identifier", metavar="DOI")
    group.add_argument("--url", metavar="URL", help="where the data are (derivative: the source's)")
    group.add_argument("--subject", metavar="LABEL", help="of the person, letters and digits")
    group.add_argument("--task", metavar="LABEL", help="what the person did, letters and digits")
    add_reading(parser)
    parser.add_argument("--skeleton", type=Path, metavar="FILE.json", help="of markers or angles")


def run(arguments: argparse.Namespace) -> int:
    """Read, write, say what was left out."""
    form = SHARED_FORMS.named(arguments.form)
    _check(arguments, form)
    notes = _written(form, arguments)
    print(f"{' '.join(map(str, arguments.inputs))} -> {arguments.out} ({form.what})")
    for sentence in notes:
        print(f"  {sentence}")
    return 0


def _check(arguments: argparse.Namespace, form: Any) -> None:
    """Refuse an output that cannot be written, before anything is read."""
    from armimpedance.core.outputs import check_replaceable

    out = arguments.out
    inputs = [path.resolve() for path in arguments.inputs]
    if form.endings:
        check_outputs(Output("--out", out, form.endings), reads=arguments.inputs)
        exists = out.exists()
    else:
        if any(p == out.resolve() or p in out.resolve().parents for p in inputs):
            raise InputError("lies in what is read", file=out, expected="another folder")
        check_replaceable(out, _MARK, _known(out))
        exists = out.exists() and any(out.iterdir())
    if exists and not arguments.replace:
        raise InputError("exists already", file=out, expected="another place, or --replace")


def _known(folder: Path) -> tuple[str, ...]:
    """Names that an earlier dataset may hold at its top level."""
    people = [p.name for p in folder.glob("sub-*")] if folder.is_dir() else []
    return (*_TOP, *people)


def _is_table(path: Path) -> bool:
    return path.suffix == _RESULTS and path.is_file()


def _written(form: Any, arguments: argparse.Namespace) -> tuple[str, ...]:
    """Read all that is shared, and write it whole or not at all."""
    from armimpedance import __version__
    from armimpedance.core.outputs import staged_file, staged_folder

    for path in arguments.inputs:
        kind = "results" if _is_table(path) else "recording"
        if kind not in form.takes:
            what = "a recording" if "recording" in form.takes else "a table of results (.csv)"
            raise InputError(f"--as {arguments.form}", file=path, expected=what)
    before = inputs_now(*arguments.inputs)
    recordings = _recordings(arguments)
    tables = [path for path in arguments.inputs if _is_table(path)]
    out = arguments.out
    place = staged_file(out) if form.endings else staged_folder(out, _MARK, _known(out))
    with place as staged:
        notes: tuple[str, ...] = form.share(
            recordings,
            tables,
            Path(staged),
            said=_said(arguments),
            person=arguments.subject,
            task=arguments.task,
            version=__version__,
        )
        before.check()  # the sums that are written are of what was read
    return notes


def _recordings(arguments: argparse.Namespace) -> list[tuple[Path, Any]]:
    from armimpedance.recordings import read_skeleton
    from armimpedance.show.verbs.results import read

    skeleton = None if arguments.skeleton is None else read_skeleton(arguments.skeleton)
    options = reading_options(arguments)
    paths = [path for path in arguments.inputs if not _is_table(path)]
    return [(path, read(path, skeleton=skeleton, **options)) for path in paths]


def _said(arguments: argparse.Namespace) -> dict[str, Any]:
    """The owner's statement on the data, from the options."""
    plain = ("name", "description", "licence", "identifier", "url")
    lists = {"creators": "creator", "keywords": "keyword", "funding": "funding"}
    statement: dict[str, Any] = {name: getattr(arguments, name) for name in plain}
    return statement | {field: tuple(getattr(arguments, option)) for field, option in lists.items()}
