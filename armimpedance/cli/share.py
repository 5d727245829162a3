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
from typing import TYPE_CHECKING

from armimpedance.cli.parts.outputs import Output, add_replace, check_outputs
from armimpedance.cli.parts.reading import add_reading, reading_options
from armimpedance.errors import InputError

if TYPE_CHECKING:
    from armimpedance.files.sharing.form import Form, ResultTable, Shared

_RESULTS = ".csv"
_MARK = "dataset_description.json"
_TOP = (_MARK, "README.md", "participants.tsv", "participants.json", "code", ".bidsignore")


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from armimpedance.files.sharing.form import FORMS

    parser.add_argument("inputs", metavar="RECORDING|RESULTS.csv", type=Path, nargs="+")
    parser.add_argument("--as", dest="form", required=True, choices=FORMS.names)
    parser.add_argument("--out", required=True, type=Path, metavar="PLACE", help="folder or file")
    add_replace(parser)
    said = parser.add_argument_group("what only you can say")
    said.add_argument("--name", metavar="TEXT")
    said.add_argument("--description", metavar="TEXT")
    for option, what in (("creator", "a person"), ("keyword", "a word"), ("funding", "a grant")):
        said.add_argument(
            f"--{option}",
            action="append",
            default=[],
            metavar="TEXT",
            help=f"{what}; may be given again",
        )
    said.add_argument("--licence", metavar="NAME", help="such as CC0-1.0, or an address")
    said.add_argument("--identifier", metavar="DOI")
    said.add_argument("--url", metavar="URL", help="where the data are (derivative: the source's)")
    said.add_argument("--subject", metavar="LABEL", help="of the person, letters and digits")
    said.add_argument("--task", metavar="LABEL", help="what the person did, letters and digits")
    add_reading(parser)
    parser.add_argument("--skeleton", type=Path, metavar="FILE.json", help="of markers or angles")


def run(arguments: argparse.Namespace) -> int:
    """Read, write, say what was left out."""
    from armimpedance.files.sharing.form import FORMS

    form = FORMS.named(arguments.form)
    _check(arguments, form)
    shared = _shared(arguments, form)
    told = _written(form, shared, arguments.out)
    print(f"{' '.join(map(str, arguments.inputs))} -> {arguments.out} ({form.what})")
    for sentence in told:
        print(f"  {sentence}")
    return 0


def _check(arguments: argparse.Namespace, form: Form) -> None:
    """Refuse an output that cannot be written, before anything is read."""
    from armimpedance.outputs import check_replaceable

    out = arguments.out
    inputs = [path.resolve() for path in arguments.inputs]
    if form.endings:
        check_outputs(Output("--out", out, form.endings), reads=arguments.inputs)
        there = out.exists()
    else:
        if any(p == out.resolve() or p in out.resolve().parents for p in inputs):
            raise InputError("lies in what is read", file=out, expected="another folder")
        check_replaceable(out, _MARK, _known(out))
        there = out.exists() and any(out.iterdir())
    if there and not arguments.replace:
        raise InputError("exists already", file=out, expected="another place, or --replace")


def _known(folder: Path) -> tuple[str, ...]:
    """What an earlier dataset may hold at its top."""
    people = [p.name for p in folder.glob("sub-*")] if folder.is_dir() else []
    return (*_TOP, *people)


def _shared(arguments: argparse.Namespace, form: Form) -> Shared:
    """Read all that is shared."""
    from armimpedance import __version__
    from armimpedance.analyses import read
    from armimpedance.files.sharing.form import Shared, Statement
    from armimpedance.recordings import read_skeleton

    recordings, results = [], []
    skeleton = None if arguments.skeleton is None else read_skeleton(arguments.skeleton)
    for path in arguments.inputs:
        kind = "results" if path.suffix == _RESULTS and path.is_file() else "recording"
        if kind not in form.takes:
            what = "a recording" if "recording" in form.takes else "a table of results (.csv)"
            raise InputError(f"--as {arguments.form}", file=path, expected=what)
        if kind == "results":
            results.append(_table(path))
        else:
            options = reading_options(arguments)
            recordings.append((path, read(path, skeleton=skeleton, **options)))
    statement = Statement(
        name=arguments.name,
        description=arguments.description,
        creators=tuple(arguments.creator),
        licence=arguments.licence,
        identifier=arguments.identifier,
        url=arguments.url,
        keywords=tuple(arguments.keyword),
        funding=tuple(arguments.funding),
    )
    person, task = arguments.subject, arguments.task
    return Shared(recordings, results, statement, person, task, __version__)


def _table(path: Path) -> ResultTable:
    """A table of results, its cells as they are."""
    from armimpedance.files.sharing.form import ResultTable
    from armimpedance.files.table_row import table_rows

    rows = table_rows(path)
    columns = tuple(name for name in rows[0].cells if name) if rows else ()
    if not columns:
        raise InputError("holds no rows", file=path, expected="results")
    return ResultTable(path, columns, tuple(row.cells for row in rows))


def _written(form: Form, shared: Shared, out: Path) -> tuple[str, ...]:
    """Write whole or not at all."""
    from armimpedance.outputs import staged_file, staged_folder

    if form.endings:
        with staged_file(out) as staged:
            return form.write(shared, Path(staged))
    with staged_folder(out, _MARK, _known(out)) as staged:
        return form.write(shared, Path(staged))
