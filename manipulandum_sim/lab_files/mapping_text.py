"""The mapping of a simulated session, as a laboratory would write it once for its files."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from typing import Literal

import pandas as pd

from armimpedance.core.conventions import force_columns, position_columns
from armimpedance.core.records import Recording
from manipulandum_sim.lab_files.trial_columns import sample_names

#: What the trial table holds beside the samples.
_NAMED = ("trial", "condition")
_BY = {
    "limb": 'by = "limb"  # the force that the limb exerts on the device',
    "device": 'by = "device"  # the force that the device exerts on the limb',
}


def mapping_text(
    recording: Recording,
    column: Callable[[str], str] = str,
    *,
    head: Iterable[str] = (),
    trials: Iterable[str] = (),
    condition: str | None = "condition",
    facts: Callable[[str], str] | None = str,
    units: Literal["SI", "small"] = "SI",
    by: Literal["limb", "device"] = "limb",
) -> str:
    """The text of ``columns.toml`` for files of a simulated session.

    Parameters
    ----------
    recording : Recording
    column : callable
        The simulator's name of a column -> its name in the file; "" where the file itself knows
        the time.
    head : iterable of str
        Further lines above the sections, such as ``files = "*.csv"``.
    trials : iterable of str
        Lines of the section ``[trials]``.
    condition : str or None
        The file's column with the condition; None: the name of the file tells it.
    facts : callable or None
        Column of the trial table -> its name in the file, "" where it has none of it; None: the
        file has none of them.

    units : {"SI", "small"}
        m, s and rad, or mm, ms and degrees.
    by : {"limb", "device"}
        Whose force on the other the columns hold.

    Returns
    -------
    str
    """
    kind, axes = recording.kind, recording.axes
    second, metre, turn = ("ms", "mm", "deg") if units == "small" else ("s", "m", "rad")
    place, push = (metre, "N") if kind == "hand" else (turn, "N m")
    lines = [
        "# Which column of these files is what; see docs/reference/files/mapping.md.",
        f'kind = "{kind}"',
        f"sample_rate_hz = {float(recording.sample_rate_hz)!r}",
        f'perturbation = "{recording.perturbation}"',
        f"handle_mass_kg = {float(recording.handle_mass_kg)!r}",
        *_optional(recording),
        *head,
        "",
        *_time(column("time_s"), second),
        *_section("position", _columns(position_columns(kind, axes), column), f'unit = "{place}"'),
        *_section(
            "force",
            _columns(force_columns(kind, axes), column),
            f'unit = "{push}"',
            _BY[by],
        ),
    ]
    if recording.joint_angles is not None:
        names = ("q_shoulder_rad", "q_elbow_rad")[: recording.joint_angles.shape[1]]
        lines += _section("joint_angles", _columns(names, column), f'unit = "{turn}"')
    if recording.emg is not None:
        pairs = [f"{muscle} = {_text(column(f'emg_{muscle}'))}" for muscle in recording.muscles]
        unit = "V" if recording.emg_unit == "V" else "normalised"
        lines += _section("emg", f"muscles = {{ {', '.join(pairs)} }}", f'unit = "{unit}"')
    lines += ["[trials]", *trials, "", "[trials.columns]"]
    if condition is not None:
        lines.append(f"condition = {_text(condition)}")
    if facts is not None:
        named = [(name, facts(name)) for name in numeric_facts(recording)]
        lines += [f"{name} = {_text(there)}" for name, there in named if there]
    return "\n".join(lines) + "\n"


def numeric_facts(recording: Recording) -> list[str]:
    """Columns of the trial table that hold a number for every trial.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    list of str
    """
    table, samples = recording.trials, {*sample_names(recording)}
    return [
        str(name)
        for name in table.columns
        if name not in _NAMED
        and name not in samples
        and pd.api.types.is_numeric_dtype(table[name])
        and table[name].notna().all()
    ]


def _optional(recording: Recording) -> list[str]:
    lines = []
    if recording.shoulder_m is not None:
        lines.append(f"shoulder_m = {recording.shoulder_m.tolist()}")
    if recording.gravity_m_s2 is not None:
        lines.append(f"gravity = {list(recording.gravity_m_s2)}")
    for name in ("torque", "imposed"):
        value = getattr(recording, name)
        if value is not None:
            lines.append(f'{name} = "{value}"')
    subject = {k: v for k, v in vars(recording.subject).items() if v is not None}
    inner = ", ".join(f"{name} = {json.dumps(value)}" for name, value in subject.items())
    return [*lines, f"subject = {{ {inner} }}"]


def _time(name: str, unit: str) -> list[str]:
    return _section("time", f"column = {_text(name)}", f'unit = "{unit}"') if name else []


def _section(name: str, *lines: str) -> list[str]:
    return [f"[{name}]", *lines, ""]


def _columns(names: Iterable[str], column: Callable[[str], str]) -> str:
    return f"columns = [{', '.join(_text(column(name)) for name in names)}]"


def _text(text: str) -> str:
    """A text as TOML writes it."""
    return json.dumps(text, ensure_ascii=False)
