"""A proposed mapping for a file, from names, units and data, with its open questions."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray
from armimpedance.recordings.mapped.evidence import (
    FoundMeaning,
    ReadName,
    Role,
    angle_unit,
    force_law,
    force_remarks,
    length_unit,
    measured_rows,
    moves,
    read_name,
    roughness,
    stays,
    time_steps,
    time_unit,
)
from armimpedance.recordings.mapped.mapping import known_unit
from armimpedance.recordings.mapped.proposed import (
    Proposal,
    ProposedColumns,
    ReadColumns,
    constant_in_trials,
    propose_trials,
    trial_column,
)
from armimpedance.recordings.mapped.raw_file import RawFile, RawRun, natural

#: Fewest columns differing only in a number that count as trials side by side, not as joints.
_SIDE_BY_SIDE: Final = 3
#: Most runs for the evidence on the force's sign.
_MOST_RUNS: Final = 40
#: Range of a fact that counts as a rate because of its name.
_SLOWEST_HZ, _FASTEST_HZ = 1.0, 1e6


def proposal_for(raw: RawFile, files: int = 1) -> Proposal:
    """Propose a mapping for the columns of a file.

    `raw`: all of its columns.
    `files`: number of files of this kind, each a run.
    """
    runs = [run for run in raw.runs if any(table.columns for table in run.tables)]
    proposal = Proposal()
    if not runs:
        proposal.cannot_tell.append("no columns with samples were found")
        return proposal
    starred = side_by_side(runs[0])
    columns = ReadColumns(runs[0], starred)
    numbers = trial_column(columns)
    if numbers is not None and not starred:
        proposal.trials = {"by": "column", "column": numbers}
        columns.per_trial = constant_in_trials(columns, numbers)
    elif starred:
        # further columns with one value per trial are not signals
        trials = max(map(len, starred.values()))
        rows = {n: len(v) for n, v in columns.values.items() if n not in starred}
        columns.per_trial = tuple(n for n, count in rows.items() if count == trials)
    elif len(runs) > 1 or files > 1:
        # each run is a trial: constant columns may be values of it
        columns.per_trial = tuple(n for n, v in columns.values.items() if stays(v))
    _position_and_force(proposal, columns)
    _joints(proposal, columns)
    _muscles(proposal, columns)
    _time(proposal, columns, runs)
    propose_trials(proposal, columns, runs, files, bool(starred))
    _whose_force(proposal, columns, runs, starred)
    _rest(proposal, columns, runs)
    return proposal


def side_by_side(run: RawRun) -> dict[str, list[str]]:
    """Columns that differ only in a number, by their pattern; empty if they are joints or axes."""
    groups: dict[str, list[str]] = {}
    for table in run.tables:
        for name in table.columns:
            for number in re.finditer(r"\d+", name):
                pattern = f"{name[: number.start()]}*{name[number.end() :]}"
                groups.setdefault(pattern, []).append(name)
    large = {p: sorted(n, key=natural) for p, n in groups.items() if len(n) >= _SIDE_BY_SIDE}
    # for an array (trials, samples, axes) the last number is the axis, and the first the trial
    twice = Counter(name for names in large.values() for name in names)
    large = {p: n for p, n in large.items() if max(twice[m] for m in n) == 1 or _one_axis(n)}
    roles = {p: read_name(p.replace("*", "")) for p in large}
    both = {r.role for r in roles.values() if r.axis} >= {"position", "force"} or (
        {r.role for r in roles.values()} >= {"position", "force"}
    )
    return large if both else {}


def _one_axis(names: Sequence[str]) -> bool:
    return len({read_name(name).axis for name in names}) == 1


def _position_and_force(proposal: Proposal, columns: ReadColumns) -> None:
    position = _axes(proposal, columns, "position", "hand")
    force = _axes(proposal, columns, "force", "force")
    angle = (
        _axes(proposal, columns, "angle", "joint") if position is None or force is None else None
    )
    torque = _axes(proposal, columns, "torque", "torque") if angle is not None else None
    if position is not None and force is not None:
        proposal.kind = "hand"
    elif angle is not None and torque is not None:
        proposal.kind, position, force = "joint", angle, torque
    _with_units(proposal, columns, position, force)
    if proposal.position is not None and proposal.force is not None:
        a, b = len(proposal.position.columns), len(proposal.force.columns)
        if a != b:
            _same_axes(proposal)


def _with_units(
    proposal: Proposal,
    columns: ReadColumns,
    position: list[ReadName] | None,
    force: list[ReadName] | None,
) -> None:
    """Propose position and force, with units stated in the file or suggested by the numbers."""
    joint = proposal.kind == "joint"
    if position is not None:
        by_data = angle_unit if joint else length_unit
        values = [columns.values[n.name] for n in position]
        unit = _stated(position) or by_data([v[: measured_rows(v)] for v in values])
        proposal.position = _proposed(position, unit)
    if force is not None:
        word = "N m" if joint else "N"
        unit = _stated(force) or FoundMeaning(None, f"nothing states it; {word} is usual")
        proposal.force = _proposed(force, unit)


def _same_axes(proposal: Proposal) -> None:
    """Keep the axes that both position and force have."""
    position, force = proposal.position, proposal.force
    if position is None or force is None:
        return
    common = [axis for axis in position.axes if axis in force.axes]
    if not common:
        proposal.cannot_tell.append("position and force have different numbers of columns")
        return
    for name, columns_of in (("position", position), ("force", force)):
        pairs = [
            (c, a) for c, a in zip(columns_of.columns, columns_of.axes, strict=True) if a in common
        ]
        columns, axes = tuple(c for c, _ in pairs), tuple(a for _, a in pairs)
        setattr(proposal, name, ProposedColumns(columns, axes, columns_of.unit))


def _proposed(names: Sequence[ReadName], unit: FoundMeaning) -> ProposedColumns:
    labels = tuple(n.label for n in names if n.label)
    return ProposedColumns(tuple(n.name for n in names), tuple(n.axis for n in names), unit, labels)


def _stated(names: Iterable[ReadName]) -> FoundMeaning | None:
    """Unit that all of these columns state, or None."""
    units = {n.unit for n in names}
    unit = units.pop() if len(units) == 1 else None
    known = None if unit is None else known_unit(unit)
    return None if known is None else FoundMeaning(known.symbol, "stated by the file")


def _sets(columns: ReadColumns, role: Role) -> list[list[ReadName]]:
    """Groups of columns of a role that belong together by name, in the order of their axes."""
    stems: dict[str, list[ReadName]] = {}
    for name in columns.of(role):
        stems.setdefault(name.stem, []).append(name)
    of_joint = role in ("angle", "torque")
    sets = []
    for names in stems.values():
        different = {n.axis: n for n in reversed(names)}
        ordered = sorted(different.values(), key=lambda n: natural(n.axis))
        if len(ordered) >= (1 if of_joint else 2):
            sets.append(ordered if of_joint else ordered[:3])
    return sets


def _axes(
    proposal: Proposal, columns: ReadColumns, role: Role, quantity: str
) -> list[ReadName] | None:
    """A role's columns, one per axis, from the first group that moves; None if none moves."""
    sets = _sets(columns, role)
    moving = [s for s in sets if any(moves(columns.values[n.name]) for n in s)]
    if not moving:
        return None
    if len(moving) > 1:
        shown = "; ".join(", ".join(n.name for n in s) for s in moving[:4])
        proposal.cannot_tell.append(
            f"which of these is the {quantity}: {shown} (the first is taken)"
        )
    best = moving[0]
    if role in ("position", "force") and len(best) == 3 and not moves(columns.values[best[2].name]):
        best = best[:2]  # a planar robot's third axis
    return best


def _joints(proposal: Proposal, columns: ReadColumns) -> None:
    if proposal.kind != "hand":
        return
    angles = [n for n in columns.of("angle") if n.axis and moves(columns.values[n.name])]
    stem = angles[0].stem if angles else ""
    angles = [n for n in angles if n.stem == stem]
    if len(angles) >= 2:
        unit = _stated(angles) or angle_unit([columns.values[n.name] for n in angles])
        proposal.joint_angles = _proposed(angles, unit)


def _muscles(proposal: Proposal, columns: ReadColumns) -> None:
    names = columns.of("emg")
    if names:
        unit = _stated(names) or FoundMeaning(None, "V, mV or normalised are possible")
        muscles = [_muscle(n.name) for n in names]
        muscles = [m if muscles.count(m) == 1 else f"{m}_{i}" for i, m in enumerate(muscles)]
        proposal.emg = ProposedColumns(tuple(n.name for n in names), tuple(muscles), unit)


def _muscle(name: str) -> str:
    words = [w for w in read_name(name).stem.split() if w not in ("emg", "myo", "channel", "ch")]
    return "_".join([*words, *([a] if (a := read_name(name).axis) else [])]) or "muscle"


def _unit_of_time(name: ReadName, columns: ReadColumns) -> FoundMeaning | None:
    """Unit of a column that increases like time; None if it does not."""
    steps, is_named = time_steps(columns.values[name.name]), name.role == "time"
    if steps is None or (not is_named and steps[1] < 0.9):
        return None
    unit = _stated([name]) or time_unit(steps[0])
    if steps[0] == 1.0 and unit.why != "stated by the file" and not is_named:
        return FoundMeaning(None, "a step of 1: ms, or a count of samples")
    return unit


def _time(proposal: Proposal, columns: ReadColumns, runs: Sequence[RawRun]) -> None:
    """Propose the column with the time, or the rate."""
    home = columns.tables.get(proposal.position.columns[0]) if proposal.position else None
    if home is not None and (home.time_s is not None or home.rate_hz is not None):
        return
    # LabVIEW calls its time X_Value: a column named like a position may hold the time
    likely = [*columns.of("time"), *columns.of("unknown"), *columns.of("position")]
    used = set(proposal.position.columns if proposal.position else ())
    for name in likely:
        if name.name in used or not (home is None or columns.tables[name.name] is home):
            continue
        unit = _unit_of_time(name, columns)
        if unit is not None:
            proposal.time = ProposedColumns((name.name,), ("",), unit)
            return
    stated_by, rate = _stated_rate(runs[0].facts)
    if _SLOWEST_HZ < rate < _FASTEST_HZ:
        proposal.rate_hz, proposal.rate_from = rate, stated_by
    else:
        proposal.cannot_tell.append("the sample rate: no column runs as time does")


def _stated_rate(facts: Mapping[str, float | str]) -> tuple[str, float]:
    """Fact that states a rate, or a step as in BIOPAC (`isi`, `isi_units`), and the rate."""
    for name, value in facts.items():
        if isinstance(value, str) or not value > 0:
            continue
        if read_name(name).role == "rate":
            return name, value
        if name.rpartition(".")[2] == "isi":
            unit = known_unit(str(facts.get(f"{name}_units", "ms")))
            if unit is not None and unit.dimension == "time":
                return name, 1.0 / float(unit.to_si(np.array([value]))[0])
    return "", np.nan


def _numbers_of(
    values: Mapping[str, NDArray[Any]], named: Sequence[Sequence[str]]
) -> tuple[FloatArray, ...] | None:
    """Return groups of columns as tables of numbers; () if one is missing or holds texts.

    None if they differ in length.
    """
    all_names = [n for names in named for n in names]
    if any(n not in values for n in all_names):
        return ()
    if len({len(values[n]) for n in all_names}) > 1:
        return None
    if any(values[n].dtype.kind != "f" for n in all_names):
        return ()
    return tuple(
        np.column_stack([np.asarray(values[n], dtype=np.float64) for n in names]) for names in named
    )


def _columns_of(run: RawRun) -> dict[str, NDArray[Any]]:
    return {n: c.values for table in run.tables for n, c in table.columns.items()}


def _own_of(column_of: Mapping[str, str], columns: Sequence[str]) -> list[str]:
    """Columns of one trial, if each trial has its own."""
    return [column_of.get(name, name) for name in columns]


def _whose_force(
    proposal: Proposal,
    columns: ReadColumns,
    runs: Sequence[RawRun],
    starred: Mapping[str, Sequence[str]],
) -> None:
    """Add evidence on the sign of the force to the proposal; never a decision."""
    position, force = proposal.position, proposal.force
    if position is None or force is None or len(position.columns) != len(force.columns):
        return
    records: list[tuple[FloatArray, FloatArray]] = []
    for run in runs[:_MOST_RUNS]:
        pairs = _pairs(run, position.columns, force.columns, starred)
        if pairs is None:
            message = "Position and force have clocks of their own; they were not compared."
            proposal.evidence = (message,)
            return
        for x, f in pairs:
            pieces = _pieces(proposal, columns, len(x)) if run is runs[0] else [slice(None)]
            records += [_measured(x[piece], f[piece]) for piece in pieces]
    proposal.evidence = force_remarks(
        position.columns, force_law(records, _step_s(proposal, columns))
    )


def _pairs(
    run: RawRun,
    position: Sequence[str],
    force: Sequence[str],
    starred: Mapping[str, Sequence[str]],
) -> list[tuple[FloatArray, FloatArray]] | None:
    """Position and force of a run, for each of its trials side by side; None if clocks differ."""
    values, pairs = _columns_of(run), []
    for trial in range(max((len(names) for names in starred.values()), default=1)):
        column_of = {n: names[trial] for n, names in starred.items()}
        pair = _numbers_of(values, [_own_of(column_of, names) for names in (position, force)])
        if pair is None:
            return None
        if pair:
            pairs.append((pair[0], pair[1]))
    return pairs


def _measured(x: FloatArray, f: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Remove padding rows at the end, whose jump would be taken for motion."""
    rows = measured_rows(np.hstack([x, f]))
    return x[:rows], f[:rows]


def _step_s(proposal: Proposal, columns: ReadColumns) -> float:
    """Usual step of the time, in s if its unit is known."""
    if proposal.time is not None and (
        steps := time_steps(columns.values[proposal.time.columns[0]])
    ):
        unit = known_unit(proposal.time.unit.word or "")
        return steps[0] if unit is None else float(unit.to_si(np.array([steps[0]]))[0])
    home = columns.tables[proposal.position.columns[0]] if proposal.position else None
    if home is not None and home.time_s is not None and (steps := time_steps(home.time_s)):
        return steps[0]
    rate = proposal.rate_hz or (None if home is None else home.rate_hz)
    return 1.0 / rate if rate else 1.0


def _pieces(proposal: Proposal, columns: ReadColumns, rows: int) -> list[slice]:
    edges: Sequence[int] = []
    if proposal.trials.get("by") == "column":
        marks = columns.values[proposal.trials["column"]]
        edges = (np.flatnonzero(marks[1:] != marks[:-1]) + 1).tolist()
    elif proposal.trials.get("by") == "gap" and proposal.time is not None:
        step = np.diff(columns.values[proposal.time.columns[0]])
        edges = (np.flatnonzero((step < 0) | (step > 10 * np.median(step))) + 1).tolist()
    bounds = [0, *edges, rows]
    return [slice(a, b) for a, b in zip(bounds[:-1], bounds[1:], strict=True)]


def _rest(proposal: Proposal, columns: ReadColumns, runs: Sequence[RawRun]) -> None:
    """Add unused columns and open questions to the proposal."""
    sections = (
        proposal.time,
        proposal.position,
        proposal.force,
        proposal.joint_angles,
        proposal.emg,
    )
    used = {c for s in sections if s is not None for c in s.columns}
    used |= {value.column for value in proposal.values.values()}
    used |= {proposal.rate_from} | {str(v) for v in proposal.trials.values()}
    proposal.others = tuple(n for n in [*columns.names, *runs[0].facts] if n not in used)
    if proposal.kind is None:
        proposal.cannot_tell.insert(0, _no_kind(proposal, columns))
    named = {"time": proposal.time, "position": proposal.position, "force": proposal.force}
    named |= {"joint_angles": proposal.joint_angles, "emg": proposal.emg}
    for name, section in named.items():
        if section is not None and section.unit.word is None:
            proposal.cannot_tell.append(f"the unit of {name}: {section.unit.why}")


def _no_kind(proposal: Proposal, columns: ReadColumns) -> str:
    """Question if names show neither hand nor joint, with columns ranked by smoothness."""
    missing = "position" if proposal.position is None else "force"
    unknown = [n.name for n in columns.of("unknown") if moves(columns.values[n.name])]
    ranked = sorted(unknown, key=lambda n: roughness(columns.values[n]))
    question = f"which columns are the {missing}"
    if ranked:
        shown = ", ".join(f"{n} ({roughness(columns.values[n]):.2g})" for n in ranked[:6])
        question += f"; smooth to rough (positions are smooth): {shown}"
    return question
