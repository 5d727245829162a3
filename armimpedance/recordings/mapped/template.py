"""The text of a proposed `columns.toml`: to be read and edited, with a reason beside each line."""

from __future__ import annotations

import json
from typing import Any

from armimpedance.recordings.mapped.columns_toml import UNDECIDED
from armimpedance.recordings.mapped.proposed import Proposal, ProposedColumns, ProposedValue


def mapping_text(found: Proposal, name: str) -> str:
    """The text of a mapping; a "?" stands for each word that is still to be decided.

    Parameters
    ----------
    found : Proposal
    name : str
        The file that it was made from.
    """
    lines = [
        f"# Proposed from {_plain(name)}. Check each line; replace each ? by your word.",
        "# Reference: docs/mapping.md",
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
    return [f"[{section}]", f"columns = [{names}]", _unit(found), ""]


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
