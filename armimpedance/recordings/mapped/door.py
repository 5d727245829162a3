"""Kinds of files that can be read with a mapping; a proposed mapping as a text to edit."""

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

#: Each module in the folder is one kind of file.
SOURCES: Final = MethodTable[Source]("armimpedance.recordings.sources", "SOURCE", "kind of file")

#: Endings of notes, which may be in any folder and do not make it a recording.
_NOTES: Final = (".txt", ".dat")


def source_of(path: Path) -> Source | None:
    """Return the kind of an existing file or folder, or None."""
    try:
        return next((source for source in SOURCES.values() if source.recognises(path)), None)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None


def is_mapped(path: Path) -> bool:
    """Return True if an existing path can be read with a mapping."""
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
    """Return the mapping of a file or folder: the stated one, or `columns.toml` beside it.

    Raises InputError: there is no mapping.
    """
    if stated is not None:
        return stated
    default = (path if path.is_dir() else path.parent) / MAPPING_FILE
    if default.is_file():
        return default
    raise InputError(
        "nothing says what its columns mean",
        file=path,
        expected=f"--mapping FILE, or {default.name} beside it: `armimpedance map-columns "
        f"{path.name}` proposes one",
    )


def files_of(path: Path, pattern: str | None) -> tuple[Path, ...]:
    """Return the files of a path: the file, or those of a folder in natural order.

    Raises InputError: the folder has no files, or files of several kinds.
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
    """Files of a folder that are of a known kind."""
    wanted = "*" if pattern is None else pattern
    if Path(wanted).is_absolute() or ".." in Path(wanted).parts:
        raise InputError(f"files = {wanted!r}", file=path, expected="names inside of the folder")
    candidates = [
        file for file in path.glob(wanted) if file.is_file() and file.name != MAPPING_FILE
    ]
    known = [file for file in candidates if source_of(file) is not None]
    if pattern is None:
        known = [f for f in known if f.suffix.lower() not in _NOTES] or known
    if not known:
        raise InputError("holds no file of a known kind", file=path, expected=f"files = {wanted!r}")
    return known


def read_table(file: Path) -> RawFile:
    """Read all of a file of a known kind, such as a trial table.

    Raises InputError: it is missing or cannot be read.
    """
    if not file.is_file():
        raise InputError("no such file", file=file, expected="the table of [[tables]]")
    return read_files((file,), lambda _name: True)[0].raw


def read_files(files: tuple[Path, ...], wanted: Wanted) -> tuple[ReadFile, ...]:
    """Read files of known kinds.

    Raises InputError: one of them cannot be read.
    """
    read = []
    for file in files:
        source = source_of(file)
        if source is None:
            raise InputError("is of no known kind", file=file)
        with unchanged(file):
            read.append(ReadFile(file, source.read(file, wanted)))
    return tuple(read)


# The text of a proposed `columns.toml`, with a reason beside each line.


def mapping_text(proposal: Proposal, name: str) -> str:
    """Return the text of a proposed mapping; a "?" marks each word that the user must decide.

    `name`: name of the file.
    """
    lines = [
        f"# Proposed from {_plain(name)}. Check each line; replace each ? by your word.",
        "# Reference: docs/reference/files/mapping.md",
        *(f"# cannot tell: {_plain(question)}" for question in proposal.cannot_tell),
        "",
        f"kind = {_text(proposal.kind)}".ljust(30) + '# "hand" (m, N) or "joint" (rad, N m)',
    ]
    if proposal.files is not None:
        lines.append(f"files = {_text(proposal.files)}")
    if proposal.rate_hz is not None:
        lines.append(f"sample_rate_hz = {proposal.rate_hz!r}")
    elif any("sample rate" in question for question in proposal.cannot_tell):
        lines.append(f"sample_rate_hz = {_text(None)}")
    lines += ["# handle_mass_kg = 0.0           # mass between force sensor and hand", ""]
    if proposal.time is not None:
        lines += ["[time]", f"column = {_text(proposal.time.columns[0])}", _unit(proposal.time), ""]
    lines += _columns("position", proposal.position)
    lines += [*_columns("force", proposal.force)[:-1], *_whose(proposal), ""]
    if proposal.joint_angles is not None:
        lines += _columns("joint_angles", proposal.joint_angles)
    if proposal.emg is not None:
        pairs = zip(proposal.emg.axes, proposal.emg.columns, strict=True)
        lines += ["[emg]", _unit(proposal.emg), "", "[emg.muscles]"]
        lines += [f"{_key(muscle)} = {_text(column)}" for muscle, column in pairs] + [""]
    for table in proposal.tables:
        keys = f"{{ log = {_text(table.log_key)}, table = {_text(table.table_key)} }}"
        same = table.log_key == table.table_key
        key = _text(table.log_key) if same else keys
        lines += ["[[tables]]", f"file = {_text(table.file)}", f"key = {key}", ""]
    lines += _trials(proposal)
    if proposal.others:
        lines += ["", "# No meaning was found for:", *(f"#   {_plain(n)}" for n in proposal.others)]
    return "\n".join(lines) + "\n"


def _trials(proposal: Proposal) -> list[str]:
    lines = ["[trials]", *(f"{key} = {_value(value)}" for key, value in proposal.trials.items())]
    lines += ["", "[trials.columns]"]
    lines += [f"{_key(name)} = {_trial_value(value)}" for name, value in proposal.values.items()]
    if "condition" not in proposal.values:
        lines.append('# condition = "a column", or { value = "relaxed" } for all trials')
    if "onset_s" not in proposal.values and "disturbance" not in proposal.trials:
        lines.append('# onset_s = { column = "a column", unit = "ms" }, where a column tells it')
    return lines


def _columns(section: str, proposed: ProposedColumns | None) -> list[str]:
    if proposed is None:
        return [f"[{section}]", f'columns = ["{UNDECIDED}"]', f'unit = "{UNDECIDED}"', ""]
    names = ", ".join(_text(column) for column in proposed.columns)
    labels = f"  # {_plain(', '.join(proposed.labels))}" if proposed.labels else ""
    return [f"[{section}]", f"columns = [{names}]{labels}", _unit(proposed), ""]


def _unit(proposed: ProposedColumns) -> str:
    return f"unit = {_text(proposed.unit.word)}".ljust(30) + f"# {_plain(proposed.unit.why)}"


def _whose(proposal: Proposal) -> list[str]:
    return [
        "# cannot tell: whose force on the other this is. Take the # off one of the two lines.",
        *(f"#   {_plain(sentence)}" for sentence in proposal.evidence),
        '# by = "limb"                  # the force of the limb on the device',
        '# by = "device"                # the force of the device on the limb',
    ]


def _text(word: str | None) -> str:
    # JSON strings are TOML strings, except for the character 127
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
    """Return a text on one line, for a comment."""
    return "".join(c if c.isprintable() else " " for c in text)


# A proposed mapping for the files at a path.


def name_pattern(files: Sequence[Path]) -> str | None:
    """Common pattern of the names of several files: ``{condition}_{trial}``, or None."""
    parts = [re.fullmatch(r"(.*?[^\W_])([_\- .]?)(\d+)", file.stem) for file in files]
    groups = [part.groups() for part in parts if part is not None]
    separators = {separator for _, separator, _ in groups}
    if len(groups) < max(len(files), 2) or len(separators) > 1:
        return None
    before = {first for first, _, _ in groups}
    first = "{condition}" if len(before) > 1 else before.pop()
    return f"{first}{separators.pop()}{{trial}}"


def _table_beside(
    log: ReadFile, proposal: Proposal, chosen: Sequence[Path], pattern: str | None
) -> JoinedTable | None:
    """Find a trial table in the folder of the log, by the numbers or names of its trials."""
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
    """A proposed mapping, to be read and edited.

    `text`: TOML with a reason beside each line; a "?" for each word that the user must decide.
    `place`: its default path: `columns.toml` beside the file.
    `found`: proposed meaning of the columns, one line each.
    `cannot_tell`: questions that only the user can answer.
    """

    text: str
    place: Path
    found: tuple[str, ...]
    cannot_tell: tuple[str, ...]


def propose_mapping(path: str | os.PathLike[str], files: str | None = None) -> ProposedMapping:
    """Propose the meaning of the columns of a file, from names, units and data.

    Whether a force is by the limb or by the device is never decided; the evidence is reported.

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
    location = Path(path)
    if not location.exists():
        raise InputError("no such file or folder", file=path, expected="a table")
    chosen = files_of(location, files)
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
    if location.is_dir() and chosen[0] != location:
        proposal.files = files or f"*{chosen[0].suffix}"
    whose = "whose force on the other it is" + (": " + " ".join(proposal.evidence)).rstrip(": ")
    return ProposedMapping(
        text=mapping_text(proposal, location.name),
        place=(location if location.is_dir() else location.parent) / MAPPING_FILE,
        found=proposal.lines(),
        cannot_tell=(*proposal.cannot_tell, whose),
    )
