"""MATLAB variables as runs of columns: structs by their fields, cells and struct arrays as runs.

A column has the name by which MATLAB would give it: ``data.hand(:,1)``, ``trial.pos(2,:)``.
"""

from __future__ import annotations

import math
import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Final

import numpy as np

from armimpedance.core.findings import not_taken
from armimpedance.recordings.mapped.mapping import known_unit
from armimpedance.recordings.mapped.raw_file import RawColumn, RawFile, RawRun, RawTable, Wanted

#: An array with more columns than this is no record of signals.
_MOST_COLUMNS: Final = 5_000
_TIMES: Final = ("time", "Time")
_DATA: Final = ("data", "Data", "values", "signals.values", "Values")


@dataclass(frozen=True)
class Leaf:
    """An array that is read when it is asked for."""

    shape: tuple[int, ...]
    read: Callable[[], np.ndarray[Any, Any]]

    @property
    def size(self) -> int:
        """Number of its values."""
        return math.prod(self.shape)


@dataclass(frozen=True)
class Refused:
    """What cannot be a column, and what it is."""

    what: str


Node = dict[str, "Node"] | list["Node"] | Leaf | Refused | str


@dataclass(frozen=True)
class _Found:
    """What lies in a struct: arrays, texts, lists of parts, and what cannot be read, by path."""

    leaves: dict[str, Leaf]
    texts: dict[str, str]
    lists: dict[str, list[Node]]
    refused: dict[str, str]


def runs_of_tree(tree: dict[str, Node], wanted: Wanted) -> RawFile:
    """The runs of a file's variables.

    `tree`: name of a variable -> its content.
    """
    told: dict[str, list[str]] = {}
    runs = tuple(_runs(tree, "", {}, wanted, told, 0))
    sentences = [s for why, names in told.items() for s in not_taken([*dict.fromkeys(names)], why)]
    return RawFile(runs, tuple(sentences))


def _runs(
    tree: dict[str, Node],
    name: str,
    facts: Mapping[str, float | str],
    wanted: Wanted,
    told: dict[str, list[str]],
    depth: int,
) -> Iterator[RawRun]:
    found = _flat(tree)
    for path, what in found.refused.items():
        told.setdefault(_why(what), []).append(path)
    lists = {path: parts for path, parts in found.lists.items() if parts}
    if not lists or depth > 10:
        yield _run(found, name, facts, wanted, told)
        return
    length = _number_of_runs(lists)
    for path in [p for p, parts in lists.items() if len(parts) != length]:
        why = f"their number of parts is not that of the {length} runs"
        told.setdefault(why, []).append(path)
    together = {p: parts for p, parts in lists.items() if len(parts) == length}
    every, each = _shared(found, length)
    own = {**facts, **found.texts, **_scalars(found)}
    first = next(iter(together))
    for i in range(length):
        part: dict[str, Node] = {**every, **{path: parts[i] for path, parts in together.items()}}
        values = {path: leaf[i] for path, leaf in each.items()}
        yield from _runs(part, f"{first}({i + 1})", {**own, **values}, wanted, told, depth + 1)


def _number_of_runs(lists: Mapping[str, Sequence[Node]]) -> int:
    """The length that most lists have; the longest of those."""
    counts = Counter(len(parts) for parts in lists.values())
    return max(counts, key=lambda n: (counts[n], n))


def _shared(found: _Found, length: int) -> tuple[dict[str, Leaf], dict[str, list[float | str]]]:
    """Arrays that hold for every run, and those with one value for each."""
    every: dict[str, Leaf] = {}
    each: dict[str, list[float | str]] = {}
    for path, leaf in found.leaves.items():
        if leaf.size == length and max(leaf.shape, default=0) == length and length > 1:
            each[path] = [_fact(v) for v in leaf.read().ravel()]
        elif leaf.size > 1:
            every[path] = leaf
    return every, each


def _fact(value: Any) -> float | str:
    return str(value) if isinstance(value, str) else float(value)


def _scalars(found: _Found) -> dict[str, float | str]:
    return {p: _fact(leaf.read().ravel()[0]) for p, leaf in found.leaves.items() if leaf.size == 1}


def _joined(node: Sequence[Node]) -> Leaf | None:
    """A list of texts or of single numbers as one array; None: it is neither."""
    if node and all(isinstance(p, str) for p in node):
        joined = np.array([str(p)[:1000] for p in node], dtype=np.str_)
    elif node and all(isinstance(p, Leaf) and p.size == 1 for p in node):
        joined = np.array([p.read().ravel()[0] for p in node if isinstance(p, Leaf)])
    else:
        return None
    return Leaf(joined.shape, lambda: joined)


def _flat(tree: dict[str, Node], path: str = "", into: _Found | None = None) -> _Found:
    """All that lies in nested structs, by its path."""
    found = into if into is not None else _Found({}, {}, {}, {})
    for name, node in _numbered(tree).items():
        at = f"{path}.{name}" if path else name
        if isinstance(node, dict):
            _flat(node, at, found)
        elif isinstance(node, Leaf):
            found.leaves[at] = node
        elif isinstance(node, str):
            found.texts[at] = node
        elif isinstance(node, Refused):
            found.refused[at] = node.what
        elif (leaf := _joined(node)) is not None:
            found.leaves[at] = leaf
        elif any(not (isinstance(p, Leaf) and p.size == 0) for p in node):
            found.lists[at] = node
    return found


def _numbered(tree: dict[str, Node]) -> dict[str, Node]:
    """Structs called trial_1, trial_2, ... as one list of them."""
    groups: dict[str, list[tuple[int, str]]] = {}
    for name, node in tree.items():
        match = re.fullmatch(r"(.*?[^\d])0*(\d{1,6})", name)
        if match and isinstance(node, dict):
            groups.setdefault(match.group(1).rstrip("_"), []).append((int(match.group(2)), name))
    lists = {base: sorted(names) for base, names in groups.items() if len(names) > 1}
    inside = {name for names in lists.values() for _, name in names}
    rest: dict[str, Node] = {name: node for name, node in tree.items() if name not in inside}
    made: dict[str, Node] = {base: [tree[n] for _, n in names] for base, names in lists.items()}
    return rest | {base: parts for base, parts in made.items() if base not in rest}


def _run(
    found: _Found,
    name: str,
    facts: Mapping[str, float | str],
    wanted: Wanted,
    told: dict[str, list[str]],
) -> RawRun:
    """A run without any parts."""
    arrays = {path: leaf for path, leaf in found.leaves.items() if leaf.size > 1}
    own: dict[str, float | str] = {**facts, **found.texts, **_scalars(found)}
    lengths = Counter(leaf.size for leaf in arrays.values() if leaf.size == max(leaf.shape))
    _told_by_motion(arrays, lengths, wanted)
    tables: dict[int, dict[str, RawColumn]] = {}
    timed: list[RawTable] = []
    series = _time_series(arrays)
    labels, units = _texts_beside(arrays)
    for path, leaf in arrays.items():
        columns = _of_channels(_columns(path, leaf, lengths, wanted, told), leaf, labels, units)
        if path in series:
            time = np.asarray(arrays[series[path]].read(), dtype=np.float64).ravel()
            fits = [c for c in columns.values() if len(c.values) == len(time)]
            if len(fits) == len(columns):
                timed.append(RawTable(columns, time))
                continue
        for column, values in columns.items():
            tables.setdefault(len(values.values), {})[column] = values
    return RawRun(name, (*_merged(timed), *(RawTable(c) for c in tables.values())), own)


#: A column of a matrix of samples and channels; more texts than these are no labels of channels.
_CHANNEL: Final = re.compile(r".*\((?::,(\d+)|(\d+),:)\)")
_MOST_CHANNELS: Final = 256


def _texts_beside(arrays: Mapping[str, Leaf]) -> tuple[dict[int, list[str]], dict[int, list[str]]]:
    """Lists of different names, and of units, by how many they are."""
    labels: dict[int, list[str]] = {}
    units: dict[int, list[str]] = {}
    for leaf in arrays.values():
        if leaf.size > _MOST_CHANNELS or leaf.size != max(leaf.shape):
            continue
        values = leaf.read().ravel()
        if values.dtype.kind != "U":
            continue
        texts = [str(text).strip() for text in values]
        if 2 * sum(known_unit(text) is not None for text in texts) > len(texts):
            units.setdefault(len(texts), texts)
        elif len(set(texts)) == len(texts) and all(texts):
            labels.setdefault(len(texts), texts)
    return labels, units


def _of_channels(
    columns: dict[str, RawColumn],
    leaf: Leaf,
    labels: Mapping[int, Sequence[str]],
    units: Mapping[int, Sequence[str]],
) -> dict[str, RawColumn]:
    """Columns of a matrix with the label and the unit that stand for its channels."""
    made = dict(columns)
    for name, column in columns.items() if len(leaf.shape) == 2 else ():
        match = _CHANNEL.fullmatch(name)
        if match is None:
            continue
        first = match.group(1) is None
        count, at = leaf.shape[0 if first else 1], int(match.group(2 if first else 1)) - 1
        label, unit = (given[count][at] if count in given else None for given in (labels, units))
        known = unit if unit is not None and known_unit(unit) is not None else None
        made[name] = replace(column, unit=column.unit or known, label=label)
    return made


def _time_series(arrays: Mapping[str, Leaf]) -> dict[str, str]:
    """Data with a time of their own, as Simulink and `timeseries` save them: data -> time."""
    found: dict[str, str] = {}
    for path in arrays:
        base, _, name = path.rpartition(".")
        if base and name in _TIMES:
            found |= {f"{base}.{d}": path for d in _DATA if f"{base}.{d}" in arrays}
    return found


def _merged(timed: Sequence[RawTable]) -> list[RawTable]:
    """Tables with the same time as one."""
    merged: list[RawTable] = []
    for table in timed:
        for i, other in enumerate(merged):
            if np.array_equal(table.time_s, other.time_s):  # type: ignore[arg-type]
                merged[i] = replace(other, columns={**other.columns, **table.columns})
                break
        else:
            merged.append(table)
    return merged


def _columns(
    path: str, leaf: Leaf, lengths: Counter[int], wanted: Wanted, told: dict[str, list[str]]
) -> dict[str, RawColumn]:
    """The columns of an array that are wanted, by MATLAB's names."""
    if leaf.size == max(leaf.shape):
        if not wanted(path):
            told.setdefault(_UNWANTED, []).append(path)
            return {}
        return {path: _column(leaf.read().ravel())}
    if leaf.size // max(leaf.shape) > _MOST_COLUMNS:
        told.setdefault(f"more than {_MOST_COLUMNS} columns", []).append(path)
        return {}
    chosen = _candidates(path, leaf, lengths, wanted)
    if not chosen:
        told.setdefault(_UNWANTED, []).append(path)
        return {}
    values = leaf.read()
    along = _along_time(values, list(chosen)) if len(chosen) > 1 else next(iter(chosen))
    return {name: _column(values[at]) for name, at in chosen[along]}


def _candidates(
    path: str, leaf: Leaf, lengths: Counter[int], wanted: Wanted
) -> dict[int, list[tuple[str, tuple[int | slice, ...]]]]:
    """The axes that may be that of samples, the likeliest first, with their wanted columns."""
    axes = sorted(range(len(leaf.shape)), key=lambda a: (-lengths[leaf.shape[a]], -leaf.shape[a]))
    able = [a for a in axes if leaf.shape[a] > 1 and leaf.size // leaf.shape[a] <= _MOST_COLUMNS]
    named = {a: [one for one in _names(path, leaf.shape, a) if wanted(one[0])] for a in able}
    return {axis: names for axis, names in named.items() if names}


def _told_by_motion(arrays: Mapping[str, Leaf], lengths: Counter[int], wanted: Wanted) -> None:
    """Count lengths along which some array is far smoother: there lie the others' samples too.

    The noise of a muscle at rest does not tell its axis of samples; the motion beside it does.
    """
    votes = Counter[int]()
    for path, leaf in arrays.items():
        if leaf.size == max(leaf.shape) or leaf.size // max(leaf.shape) > _MOST_COLUMNS:
            continue
        axes = list(_candidates(path, leaf, lengths, wanted))
        if len(axes) > 1 and (along := _along_time(leaf.read(), axes)) != axes[0]:
            votes[leaf.shape[along]] += len(arrays)
    lengths.update(votes)


def _along_time(values: np.ndarray[Any, Any], axes: Sequence[int]) -> int:
    """The axis of samples: the first, unless the signals are far smoother along a longer one.

    From sample to sample a signal changes little; from trial to trial it does not go on.
    """
    first, shape = axes[0], values.shape
    if values.dtype.kind not in "fiu":
        return first
    longer = [a for a in axes if shape[a] >= _SAMPLES and shape[a] > shape[first]]
    rough = {a: _roughness(values, a) for a in (first, *longer)}
    best = min(rough, key=lambda a: rough[a])
    return best if rough[best] < _SMOOTHER * rough[first] else first


def _roughness(values: np.ndarray[Any, Any], axis: int) -> float:
    """How far a signal goes from one value to the next, in parts of how far it is spread."""
    numbers = np.asarray(values, dtype=np.float64)
    with np.errstate(invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # lines without any number
        step = np.nanmean(np.abs(np.diff(numbers, axis=axis)))
        spread = np.nanmean(np.abs(numbers - np.nanmean(numbers, axis=axis, keepdims=True)))
    return float(step / spread) if spread > 0 else np.inf


#: So many values along an axis may be samples; and so much smoother the signals are along time.
_SAMPLES: Final = 20
_SMOOTHER: Final = 0.5
_UNWANTED: Final = "the mapping gives them no meaning"


def _names(
    path: str, shape: tuple[int, ...], axis: int
) -> Iterator[tuple[str, tuple[int | slice, ...]]]:
    """Names of the columns along an axis, and where each lies."""
    others: list[Sequence[int | slice]] = [
        range(n) if a != axis else (slice(None),) for a, n in enumerate(shape)
    ]
    for at in product(*others):
        inside = ",".join(":" if isinstance(i, slice) else str(i + 1) for i in at)
        yield f"{path}({inside})", at


def _column(values: np.ndarray[Any, Any]) -> RawColumn:
    if values.dtype.kind == "U":
        return RawColumn(values)
    return RawColumn(np.array(values, dtype=np.float64))


def _why(what: str) -> str:
    if what.startswith("an object of MATLAB class"):
        return (
            f"{what}; in MATLAB save it as plain data: table2struct(T, 'ToScalar', true), "
            "struct(object), char(string)"
        )
    return what
