"""The kinds of file that a mapping explains; a proposed mapping as a text to edit."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import unchanged
from armimpedance.core.method_table import MethodTable
from armimpedance.recordings.mapped.columns_toml import MAPPING_FILE, UNDECIDED
from armimpedance.recordings.mapped.joined import table_beside, with_tables
from armimpedance.recordings.mapped.mapping import JoinedTable
from armimpedance.recordings.mapped.proposal import proposal_for
from armimpedance.recordings.mapped.proposed import Proposal, ProposedColumns, ProposedValue
from armimpedance.recordings.mapped.raw_file import (
    RawFile,
    ReadFile,
    Source,
    Wanted,
    names_in,
    natural,
)

#: One file in the folder is one kind.
SOURCES: Final = MethodTable[Source]("armimpedance.recordings.sources", "SOURCE", "kind of file")

#: Files of notes that lie in any folder: they do not make it a recording.
_NOTES: Final = (".txt", ".dat")


def source_of(path: Path) -> Source | None:
    """The kind of an existing file or folder, or None."""
    try:
        return next((source for source in SOURCES.values() if source.recognises(path)), None)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None


def is_mapped(path: Path) -> bool:
    """Whether a mapping can explain what is at an existing path."""
    if source_of(path) is not None:
        return True
    if not path.is_dir():
        return False
    return (path / MAPPING_FILE).is_file() or any(
        child.suffix.lower() not in _NOTES and source_of(child) is not None
        for child in sorted(path.iterdir())
        if child.is_file()
    )


def mapping_of(path: Path, stated: Path | None) -> Path:
    """The mapping file for a file or folder: the stated one, or `columns.toml` with it.

    Raises InputError: there is none.
    """
    if stated is not None:
        return stated
    found = (path if path.is_dir() else path.parent) / MAPPING_FILE
    if found.is_file():
        return found
    raise InputError(
        "nothing says what its columns mean",
        file=path,
        expected=f"--mapping FILE, or {found.name} beside it: `armimpedance map-columns "
        f"{path.name}` proposes one",
    )


def files_of(path: Path, pattern: str | None) -> tuple[Path, ...]:
    """The files that a path stands for: itself, or those of a folder, in their natural order.

    Raises InputError: the folder has none, or files of several kinds and nothing says which.
    """
    if source_of(path) is not None:
        return (path,)
    if not path.is_dir():
        names = "; ".join(source.name for source in SOURCES.values())
        raise InputError("is of no known kind", file=path, expected=names)
    known = _known_files(path, pattern)
    endings = sorted({file.suffix.lower() for file in known})
    if len(endings) > 1:
        expected = 'files = "*.csv" or the like in the mapping'
        raise InputError(f"holds {' and '.join(endings)} files", file=path, expected=expected)
    return tuple(sorted(known, key=lambda file: natural(str(file.relative_to(path)))))


def _known_files(path: Path, pattern: str | None) -> list[Path]:
    """The files of a folder of which some source knows the kind."""
    wanted = "*" if pattern is None else pattern
    if Path(wanted).is_absolute() or ".." in Path(wanted).parts:
        raise InputError(f"files = {wanted!r}", file=path, expected="names inside of the folder")
    there = [file for file in path.glob(wanted) if file.is_file() and file.name != MAPPING_FILE]
    known = [file for file in there if source_of(file) is not None]
    if pattern is None:
        known = [f for f in known if f.suffix.lower() not in _NOTES] or known
    if not known:
        raise InputError("holds no file of a known kind", file=path, expected=f"files = {wanted!r}")
    return known


def read_table(file: Path) -> RawFile:
    """The whole of a file of a known kind, such as a trial table.

    Raises InputError: it is not there or cannot be read.
    """
    if not file.is_file():
        raise InputError("no such file", file=file, expected="the table of [[tables]]")
    return read_files((file,), lambda _name: True)[0].raw


def read_files(files: tuple[Path, ...], wanted: Wanted) -> tuple[ReadFile, ...]:
    """Read files of known kinds.

    Raises InputError: what is wrong with one of them.
    """
    found = []
    for file in files:
        source = source_of(file)
        if source is None:
            raise InputError("is of no known kind", file=file)
        with unchanged(file):
            found.append(ReadFile(file, source.read(file, wanted)))
    return tuple(found)


# The text of a proposed `columns.toml`: to be read and edited, with a reason beside each line.


def mapping_text(found: Proposal, name: str) -> str:
    """The text of a mapping; a "?" stands for each word that is still to be decided.

    `name`: the file that it was made from.
    """
    lines = [
        f"# Proposed from {_plain(name)}. Check each line; replace each ? by your word.",
        "# Reference: docs/reference/files/mapping.md",
        *(f"# cannot tell: {_plain(question)}" for question in found.cannot_tell),
        "",
        f"kind = {_text(found.kind)}".ljust(30) + '# "hand" (m, N) or "joint" (rad, N m)',
    ]
    if found.files is not None:
        lines.append(f"files = {_text(found.files)}")
    if found.rate_hz is not None:
        lines.append(f"sample_rate_hz = {found.rate_hz!r}")
    elif any("sample rate" in question for question in found.cannot_tell):
        lines.append(f"sample_rate_hz = {_text(None)}")
    lines += ["# handle_mass_kg = 0.0           # mass between force sensor and hand", ""]
    if found.time is not None:
        lines += ["[time]", f"column = {_text(found.time.columns[0])}", _unit(found.time), ""]
    lines += _columns("position", found.position)
    lines += [*_columns("force", found.force)[:-1], *_whose(found), ""]
    if found.joint_angles is not None:
        lines += _columns("joint_angles", found.joint_angles)
    if found.emg is not None:
        pairs = zip(found.emg.axes, found.emg.columns, strict=True)
        lines += ["[emg]", _unit(found.emg), "", "[emg.muscles]"]
        lines += [f"{_key(muscle)} = {_text(column)}" for muscle, column in pairs] + [""]
    for table in found.tables:
        keys = f"{{ log = {_text(table.log_key)}, table = {_text(table.table_key)} }}"
        same = table.log_key == table.table_key
        key = _text(table.log_key) if same else keys
        lines += ["[[tables]]", f"file = {_text(table.file)}", f"key = {key}", ""]
    lines += _trials(found)
    if found.others:
        lines += ["", "# No meaning was found for:", *(f"#   {_plain(n)}" for n in found.others)]
    return "\n".join(lines) + "\n"


def _trials(found: Proposal) -> list[str]:
    lines = ["[trials]", *(f"{key} = {_value(value)}" for key, value in found.trials.items())]
    lines += ["", "[trials.columns]"]
    lines += [f"{_key(name)} = {_trial_value(value)}" for name, value in found.values.items()]
    if "condition" not in found.values:
        lines.append('# condition = "a column", or { value = "relaxed" } for all trials')
    if "onset_s" not in found.values and "disturbance" not in found.trials:
        lines.append('# onset_s = { column = "a column", unit = "ms" }, where a column tells it')
    return lines


def _columns(section: str, found: ProposedColumns | None) -> list[str]:
    if found is None:
        return [f"[{section}]", f'columns = ["{UNDECIDED}"]', f'unit = "{UNDECIDED}"', ""]
    names = ", ".join(_text(column) for column in found.columns)
    labels = f"  # {_plain(', '.join(found.labels))}" if found.labels else ""
    return [f"[{section}]", f"columns = [{names}]{labels}", _unit(found), ""]


def _unit(found: ProposedColumns) -> str:
    return f"unit = {_text(found.unit.word)}".ljust(30) + f"# {_plain(found.unit.why)}"


def _whose(found: Proposal) -> list[str]:
    return [
        "# cannot tell: whose force on the other this is. Take the # off one of the two lines.",
        *(f"#   {_plain(sentence)}" for sentence in found.evidence),
        '# by = "limb"                  # the force of the limb on the device',
        '# by = "device"                # the force of the device on the limb',
    ]


def _text(word: str | None) -> str:
    # JSON's strings are TOML's, but for the character 127.
    text = json.dumps(UNDECIDED if word is None else word, ensure_ascii=False)
    return text.replace("\x7f", "\\u007f")


def _trial_value(value: ProposedValue) -> str:
    if value.unit is None:
        return _text(value.column)
    return f"{{ column = {_text(value.column)}, unit = {_text(value.unit)} }}"


def _value(value: Any) -> str:
    return _text(value) if isinstance(value, str) else repr(value)


def _key(name: str) -> str:
    bare = name and all(c.isascii() and (c.isalnum() or c in "_-") for c in name)
    return name if bare else _text(name)


def _plain(text: str) -> str:
    """One line for a comment."""
    return "".join(c if c.isprintable() else " " for c in text)


# A mapping that is proposed for the files at a path.


def name_pattern(files: Sequence[Path]) -> str | None:
    """What the names of several files have in common: ``{condition}_{trial}``, or None."""
    parts = [re.fullmatch(r"(.*?[^\W_])([_\- .]?)(\d+)", file.stem) for file in files]
    found = [part.groups() for part in parts if part is not None]
    separators = {separator for _, separator, _ in found}
    if len(found) < max(len(files), 2) or len(separators) > 1:
        return None
    before = {first for first, _, _ in found}
    first = "{condition}" if len(before) > 1 else before.pop()
    return f"{first}{separators.pop()}{{trial}}"


def _table_beside(
    log: ReadFile, proposal: Proposal, chosen: Sequence[Path], pattern: str | None
) -> JoinedTable | None:
    """A trial table in the folder of the log, found by the numbers or names of its trials."""
    if proposal.trials.get("by") == "column":
        key = str(proposal.trials["column"])
        columns = {n: c for run in log.raw.runs for t in run.tables for n, c in t.columns.items()}
        trials: list[Any] = [*dict.fromkeys(columns[key].values.tolist())]
    elif pattern is not None:
        key, names = "trial", [names_in(pattern, file) or {} for file in chosen]
        trials = [name.get("trial", "") for name in names]
    else:
        return None
    beside = sorted(file for file in log.path.parent.iterdir() if file.is_file())
    known = [file for file in beside if file not in chosen and source_of(file) is not None]
    return table_beside(log, key, trials, known, read_table)


@dataclass(frozen=True)
class ProposedMapping:
    """A mapping to be read and edited.

    `text`: TOML with a reason beside each line; a "?" for each word that is still to be decided.
    `place`: where it would be found without being named: `columns.toml` with the file.
    `found`: what the columns were taken for, one line each.
    `cannot_tell`: what only the user can say.
    """

    text: str
    place: Path
    found: tuple[str, ...]
    cannot_tell: tuple[str, ...]


def propose_mapping(path: str | os.PathLike[str], files: str | None = None) -> ProposedMapping:
    """Propose which column of a file is what, from names, units and data.

    Whose force on the other the columns hold is never decided, only what the data say of it.

    Parameters
    ----------
    path : path
        A table of any layout, or a folder of them.
    files : str, optional
        Which files of a folder, such as ``"trial_*.csv"``.

    Returns
    -------
    ProposedMapping

    Raises
    ------
    InputError
        The file cannot be read, or no mapping can explain such a file.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from armimpedance.recordings import propose_mapping
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "log.csv")
    ...     rows = "".join(f"{i},0.0{i},0.4,1,{i}\\n" for i in range(9))
    ...     _ = file.write_text("Time (ms),x (m),y (m),Fx (N),Fy (N)\\n" + rows)
    ...     print(*propose_mapping(file).found, sep="\\n")
    time: Time (ms) in ms (stated by the file)
    position: x (m), y (m) in m (stated by the file)
    force: Fx (N), Fy (N) in N (stated by the file)
    trials: by run
    """
    place = Path(path)
    if not place.exists():
        raise InputError("no such file or folder", file=path, expected="a table")
    chosen = files_of(place, files)
    log = read_files(chosen[:1], lambda _name: True)[0]
    proposal = proposal_for(log.raw, len(chosen))
    pattern = name_pattern(chosen) if proposal.trials.get("by") == "run" else None
    table = _table_beside(log, proposal, chosen, pattern)
    if table is not None:
        (joined,) = with_tables([log], [table], read_table, pattern)
        proposal = proposal_for(joined.raw, len(chosen))
        proposal.tables = (table,)
    if pattern is not None:
        proposal.named_by(pattern)
    if place.is_dir() and chosen[0] != place:
        proposal.files = files or f"*{chosen[0].suffix}"
    whose = "whose force on the other it is" + (": " + " ".join(proposal.evidence)).rstrip(": ")
    return ProposedMapping(
        text=mapping_text(proposal, place.name),
        place=(place if place.is_dir() else place.parent) / MAPPING_FILE,
        found=proposal.lines(),
        cannot_tell=(*proposal.cannot_tell, whose),
    )
