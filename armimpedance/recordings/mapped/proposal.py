"""A mapping that is proposed for a file, from names, units and data, and what they cannot tell."""

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
    force_told,
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

#: So many columns that differ in a number only are trials side by side, no joints.
_SIDE_BY_SIDE: Final = 3
#: So many runs are looked at for the force's sign.
_MOST_RUNS: Final = 40
#: A fact that is named like a rate is one, between these.
_SLOWEST_HZ, _FASTEST_HZ = 1.0, 1e6


def proposal_for(raw: RawFile, files: int = 1) -> Proposal:
    """Propose a mapping for what a file holds.

    `raw`: all of its columns.
    `files`: how many files of the kind there are, each a run.
    """
    runs = [run for run in raw.runs if any(table.columns for table in run.tables)]
    found = Proposal()
    if not runs:
        found.cannot_tell.append("no columns with samples were found")
        return found
    starred = side_by_side(runs[0])
    columns = ReadColumns(runs[0], starred)
    numbers = trial_column(columns)
    if numbers is not None and not starred:
        found.trials = {"by": "column", "column": numbers}
        columns.per_trial = constant_in_trials(columns, numbers)
    elif starred:
        # what stands beside them with a value for each trial is no signal
        trials = max(map(len, starred.values()))
        rows = {n: len(v) for n, v in columns.values.items() if n not in starred}
        columns.per_trial = tuple(n for n, count in rows.items() if count == trials)
    elif len(runs) > 1 or files > 1:
        # each run is a trial: what stays in it may be said of it
        columns.per_trial = tuple(n for n, v in columns.values.items() if stays(v))
    _position_and_force(found, columns)
    _joints(found, columns)
    _muscles(found, columns)
    _time(found, columns, runs)
    propose_trials(found, columns, runs, files, bool(starred))
    _whose_force(found, columns, runs, starred)
    _rest(found, columns, runs)
    return found


def side_by_side(run: RawRun) -> dict[str, list[str]]:
    """Columns that differ in a number only, by a pattern; none where they are joints or axes."""
    groups: dict[str, list[str]] = {}
    for table in run.tables:
        for name in table.columns:
            for number in re.finditer(r"\d+", name):
                pattern = f"{name[: number.start()]}*{name[number.end() :]}"
                groups.setdefault(pattern, []).append(name)
    large = {p: sorted(n, key=natural) for p, n in groups.items() if len(n) >= _SIDE_BY_SIDE}
    # of an array (trials, samples, axes) the last number is the axis, and the first the trial
    twice = Counter(name for names in large.values() for name in names)
    large = {p: n for p, n in large.items() if max(twice[m] for m in n) == 1 or _one_axis(n)}
    roles = {p: read_name(p.replace("*", "")) for p in large}
    both = {r.role for r in roles.values() if r.axis} >= {"position", "force"} or (
        {r.role for r in roles.values()} >= {"position", "force"}
    )
    return large if both else {}


def _one_axis(names: Sequence[str]) -> bool:
    return len({read_name(name).axis for name in names}) == 1


def _position_and_force(found: Proposal, columns: ReadColumns) -> None:
    position = _axes(found, columns, "position", "hand")
    force = _axes(found, columns, "force", "force")
    angle = _axes(found, columns, "angle", "joint") if position is None or force is None else None
    torque = _axes(found, columns, "torque", "torque") if angle is not None else None
    if position is not None and force is not None:
        found.kind = "hand"
    elif angle is not None and torque is not None:
        found.kind, position, force = "joint", angle, torque
    _with_units(found, columns, position, force)
    if found.position is not None and found.force is not None:
        a, b = len(found.position.columns), len(found.force.columns)
        if a != b:
            _same_axes(found)


def _with_units(
    found: Proposal,
    columns: ReadColumns,
    position: list[ReadName] | None,
    force: list[ReadName] | None,
) -> None:
    """Position and force with the units that the file states or the numbers suggest."""
    joint = found.kind == "joint"
    if position is not None:
        by_data = angle_unit if joint else length_unit
        values = [columns.values[n.name] for n in position]
        unit = _stated(position) or by_data([v[: measured_rows(v)] for v in values])
        found.position = _proposed(position, unit)
    if force is not None:
        word = "N m" if joint else "N"
        unit = _stated(force) or FoundMeaning(None, f"nothing states it; {word} is usual")
        found.force = _proposed(force, unit)


def _same_axes(found: Proposal) -> None:
    """Keep the axes that both position and force have."""
    position, force = found.position, found.force
    if position is None or force is None:
        return
    common = [axis for axis in position.axes if axis in force.axes]
    if not common:
        found.cannot_tell.append("position and force have different numbers of columns")
        return
    for name, given in (("position", position), ("force", force)):
        kept = [(c, a) for c, a in zip(given.columns, given.axes, strict=True) if a in common]
        columns, axes = tuple(c for c, _ in kept), tuple(a for _, a in kept)
        setattr(found, name, ProposedColumns(columns, axes, given.unit))


def _proposed(names: Sequence[ReadName], unit: FoundMeaning) -> ProposedColumns:
    labels = tuple(n.label for n in names if n.label)
    return ProposedColumns(tuple(n.name for n in names), tuple(n.axis for n in names), unit, labels)


def _stated(names: Iterable[ReadName]) -> FoundMeaning | None:
    """The unit that all of these columns state."""
    units = {n.unit for n in names}
    unit = units.pop() if len(units) == 1 else None
    known = None if unit is None else known_unit(unit)
    return None if known is None else FoundMeaning(known.symbol, "stated by the file")


def _sets(columns: ReadColumns, role: Role) -> list[list[ReadName]]:
    """The columns of a role that belong together by their names, in the order of their axes."""
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


def _axes(found: Proposal, columns: ReadColumns, role: Role, what: str) -> list[ReadName] | None:
    """The columns of a role, one an axis; where several sets are there, the one that moves."""
    sets = _sets(columns, role)
    moving = [s for s in sets if any(moves(columns.values[n.name]) for n in s)]
    if not moving:
        return None
    if len(moving) > 1:
        shown = "; ".join(", ".join(n.name for n in s) for s in moving[:4])
        found.cannot_tell.append(f"which of these is the {what}: {shown} (the first is taken)")
    best = moving[0]
    if role in ("position", "force") and len(best) == 3 and not moves(columns.values[best[2].name]):
        best = best[:2]  # a planar robot's third axis
    return best


def _joints(found: Proposal, columns: ReadColumns) -> None:
    if found.kind != "hand":
        return
    angles = [n for n in columns.of("angle") if n.axis and moves(columns.values[n.name])]
    stem = angles[0].stem if angles else ""
    angles = [n for n in angles if n.stem == stem]
    if len(angles) >= 2:
        unit = _stated(angles) or angle_unit([columns.values[n.name] for n in angles])
        found.joint_angles = _proposed(angles, unit)


def _muscles(found: Proposal, columns: ReadColumns) -> None:
    names = columns.of("emg")
    if names:
        unit = _stated(names) or FoundMeaning(None, "V, mV or normalised are possible")
        muscles = [_muscle(n.name) for n in names]
        muscles = [m if muscles.count(m) == 1 else f"{m}_{i}" for i, m in enumerate(muscles)]
        found.emg = ProposedColumns(tuple(n.name for n in names), tuple(muscles), unit)


def _muscle(name: str) -> str:
    words = [w for w in read_name(name).stem.split() if w not in ("emg", "myo", "channel", "ch")]
    return "_".join([*words, *([a] if (a := read_name(name).axis) else [])]) or "muscle"


def _unit_of_time(name: ReadName, columns: ReadColumns) -> FoundMeaning | None:
    """The unit of a column that runs as time does; None: it does not."""
    steps, sure = time_steps(columns.values[name.name]), name.role == "time"
    if steps is None or (not sure and steps[1] < 0.9):
        return None
    unit = _stated([name]) or time_unit(steps[0])
    if steps[0] == 1.0 and unit.why != "stated by the file" and not sure:
        return FoundMeaning(None, "a step of 1: ms, or a count of samples")
    return unit


def _time(found: Proposal, columns: ReadColumns, runs: Sequence[RawRun]) -> None:
    """The column with the time, or the rate."""
    home = columns.tables.get(found.position.columns[0]) if found.position else None
    if home is not None and (home.time_s is not None or home.rate_hz is not None):
        return
    # LabVIEW calls its time X_Value: a name that says a position may stand over the time too.
    likely = [*columns.of("time"), *columns.of("unknown"), *columns.of("position")]
    taken = set(found.position.columns if found.position else ())
    for name in likely:
        if name.name in taken or not (home is None or columns.tables[name.name] is home):
            continue
        unit = _unit_of_time(name, columns)
        if unit is not None:
            found.time = ProposedColumns((name.name,), ("",), unit)
            return
    stated_by, rate = _stated_rate(runs[0].facts)
    if _SLOWEST_HZ < rate < _FASTEST_HZ:
        found.rate_hz, found.rate_from = rate, stated_by
    else:
        found.cannot_tell.append("the sample rate: no column runs as time does")


def _stated_rate(facts: Mapping[str, float | str]) -> tuple[str, float]:
    """The fact that states a rate, or a step as BIOPAC does (`isi`, `isi_units`), and the rate."""
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
    """Groups of columns as tables of numbers, () where one is not there or holds texts.

    None: they differ in length.
    """
    every = [n for names in named for n in names]
    if any(n not in values for n in every):
        return ()
    if len({len(values[n]) for n in every}) > 1:
        return None
    if any(values[n].dtype.kind != "f" for n in every):
        return ()
    return tuple(
        np.column_stack([np.asarray(values[n], dtype=np.float64) for n in names]) for names in named
    )


def _columns_of(run: RawRun) -> dict[str, NDArray[Any]]:
    return {n: c.values for table in run.tables for n, c in table.columns.items()}


def _own_of(own: Mapping[str, str], columns: Sequence[str]) -> list[str]:
    """The columns of one trial, where each has its own."""
    return [own.get(name, name) for name in columns]


def _whose_force(
    found: Proposal,
    columns: ReadColumns,
    runs: Sequence[RawRun],
    starred: Mapping[str, Sequence[str]],
) -> None:
    """Evidence on the sign of the force; never a decision."""
    position, force = found.position, found.force
    if position is None or force is None or len(position.columns) != len(force.columns):
        return
    records: list[tuple[FloatArray, FloatArray]] = []
    for run in runs[:_MOST_RUNS]:
        pairs = _pairs(run, position.columns, force.columns, starred)
        if pairs is None:
            told = "Position and force have clocks of their own; they were not compared."
            found.evidence = (told,)
            return
        for x, f in pairs:
            pieces = _pieces(found, columns, len(x)) if run is runs[0] else [slice(None)]
            records += [_measured(x[piece], f[piece]) for piece in pieces]
    found.evidence = force_told(position.columns, force_law(records, _step_s(found, columns)))


def _pairs(
    run: RawRun,
    position: Sequence[str],
    force: Sequence[str],
    starred: Mapping[str, Sequence[str]],
) -> list[tuple[FloatArray, FloatArray]] | None:
    """Position and force of a run, of each of the trials that stand side by side in it; None: their
    clocks differ.
    """
    values, pairs = _columns_of(run), []
    for trial in range(max((len(names) for names in starred.values()), default=1)):
        own = {n: names[trial] for n, names in starred.items()}
        pair = _numbers_of(values, [_own_of(own, names) for names in (position, force)])
        if pair is None:
            return None
        if pair:
            pairs.append((pair[0], pair[1]))
    return pairs


def _measured(x: FloatArray, f: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Without rows that fill a trial up: they leap, and would be taken for motion."""
    rows = measured_rows(np.hstack([x, f]))
    return x[:rows], f[:rows]


def _step_s(found: Proposal, columns: ReadColumns) -> float:
    """The usual step of the time, in s where its unit is known."""
    if found.time is not None and (steps := time_steps(columns.values[found.time.columns[0]])):
        unit = known_unit(found.time.unit.word or "")
        return steps[0] if unit is None else float(unit.to_si(np.array([steps[0]]))[0])
    home = columns.tables[found.position.columns[0]] if found.position else None
    if home is not None and home.time_s is not None and (steps := time_steps(home.time_s)):
        return steps[0]
    rate = found.rate_hz or (None if home is None else home.rate_hz)
    return 1.0 / rate if rate else 1.0


def _pieces(found: Proposal, columns: ReadColumns, rows: int) -> list[slice]:
    edges: Sequence[int] = []
    if found.trials.get("by") == "column":
        marks = columns.values[found.trials["column"]]
        edges = (np.flatnonzero(marks[1:] != marks[:-1]) + 1).tolist()
    elif found.trials.get("by") == "gap" and found.time is not None:
        step = np.diff(columns.values[found.time.columns[0]])
        edges = (np.flatnonzero((step < 0) | (step > 10 * np.median(step))) + 1).tolist()
    bounds = [0, *edges, rows]
    return [slice(a, b) for a, b in zip(bounds[:-1], bounds[1:], strict=True)]


def _rest(found: Proposal, columns: ReadColumns, runs: Sequence[RawRun]) -> None:
    """What is left over, and what stands undecided."""
    sections = (found.time, found.position, found.force, found.joint_angles, found.emg)
    used = {c for s in sections if s is not None for c in s.columns}
    used |= {value.column for value in found.values.values()}
    used |= {found.rate_from} | {str(v) for v in found.trials.values()}
    found.others = tuple(n for n in [*columns.names, *runs[0].facts] if n not in used)
    if found.kind is None:
        found.cannot_tell.insert(0, _no_kind(found, columns))
    named = {"time": found.time, "position": found.position, "force": found.force}
    named |= {"joint_angles": found.joint_angles, "emg": found.emg}
    for name, section in named.items():
        if section is not None and section.unit.word is None:
            found.cannot_tell.append(f"the unit of {name}: {section.unit.why}")


def _no_kind(found: Proposal, columns: ReadColumns) -> str:
    """Names say neither hand nor joint; the smoothest columns may be positions."""
    missing = "position" if found.position is None else "force"
    unknown = [n.name for n in columns.of("unknown") if moves(columns.values[n.name])]
    ranked = sorted(unknown, key=lambda n: roughness(columns.values[n]))
    told = f"which columns are the {missing}"
    if ranked:
        shown = ", ".join(f"{n} ({roughness(columns.values[n]):.2g})" for n in ranked[:6])
        told += f"; smooth to rough (positions are smooth): {shown}"
    return told
