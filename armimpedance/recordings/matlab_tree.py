"""MATLAB variables as runs of columns: structs by their fields, cells and struct arrays as runs.

A column has the name of its MATLAB expression: ``data.hand(:,1)``, ``trial.pos(2,:)``.
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

#: Most columns of an array of signals.
_MOST_COLUMNS: Final = 5_000
_TIMES: Final = ("time", "Time")
_DATA: Final = ("data", "Data", "values", "signals.values", "Values")


@dataclass(frozen=True)
class Leaf:
    """An array that is read when it is needed."""

    shape: tuple[int, ...]
    read: Callable[[], np.ndarray[Any, Any]]

    @property
    def size(self) -> int:
        """Number of values."""
        return math.prod(self.shape)


@dataclass(frozen=True)
class Refused:
    """A node that cannot be a column, with its description."""

    what: str


Node = dict[str, "Node"] | list["Node"] | Leaf | Refused | str


@dataclass(frozen=True)
class _Found:
    """Contents of a struct by path: arrays, texts, lists of parts, and what cannot be read."""

    leaves: dict[str, Leaf]
    texts: dict[str, str]
    lists: dict[str, list[Node]]
    refused: dict[str, str]


def runs_of_tree(tree: dict[str, Node], wanted: Wanted) -> RawFile:
    """Build the runs of a file's variables.

    `tree`: name of a variable -> its content.
    """
    left_out: dict[str, list[str]] = {}
    runs = tuple(_runs(tree, "", {}, wanted, left_out, 0))
    sentences = [
        s for reason, names in left_out.items() for s in not_taken([*dict.fromkeys(names)], reason)
    ]
    return RawFile(runs, tuple(sentences))


def _runs(
    tree: dict[str, Node],
    name: str,
    facts: Mapping[str, float | str],
    wanted: Wanted,
    left_out: dict[str, list[str]],
    depth: int,
) -> Iterator[RawRun]:
    content = _flat(tree)
    for path, refusal in content.refused.items():
        left_out.setdefault(_why(refusal), []).append(path)
    lists = {path: parts for path, parts in content.lists.items() if parts}
    if not lists or depth > 10:
        yield _run(content, name, facts, wanted, left_out)
        return
    length = _number_of_runs(lists)
    for path in [p for p, parts in lists.items() if len(parts) != length]:
        reason = f"their number of parts is not that of the {length} runs"
        left_out.setdefault(reason, []).append(path)
    together = {p: parts for p, parts in lists.items() if len(parts) == length}
    common, per_run = _shared(content, length)
    own_facts = {**facts, **content.texts, **_scalars(content)}
    first = next(iter(together))
    for i in range(length):
        part: dict[str, Node] = {**common, **{path: parts[i] for path, parts in together.items()}}
        values = {path: leaf[i] for path, leaf in per_run.items()}
        yield from _runs(
            part, f"{first}({i + 1})", {**own_facts, **values}, wanted, left_out, depth + 1
        )


def _number_of_runs(lists: Mapping[str, Sequence[Node]]) -> int:
    """Most frequent length of the lists; of equally frequent lengths, the longest."""
    counts = Counter(len(parts) for parts in lists.values())
    return max(counts, key=lambda n: (counts[n], n))


def _shared(content: _Found, length: int) -> tuple[dict[str, Leaf], dict[str, list[float | str]]]:
    """Arrays that are common to all runs, and arrays with one value per run."""
    common: dict[str, Leaf] = {}
    per_run: dict[str, list[float | str]] = {}
    for path, leaf in content.leaves.items():
        if leaf.size == length and max(leaf.shape, default=0) == length and length > 1:
            per_run[path] = [_fact(v) for v in leaf.read().ravel()]
        elif leaf.size > 1:
            common[path] = leaf
    return common, per_run


def _fact(value: Any) -> float | str:
    return str(value) if isinstance(value, str) else float(value)


def _scalars(content: _Found) -> dict[str, float | str]:
    return {
        p: _fact(leaf.read().ravel()[0]) for p, leaf in content.leaves.items() if leaf.size == 1
    }


def _joined(node: Sequence[Node]) -> Leaf | None:
    """Join a list of texts or of single numbers to one array; None for other lists."""
    if node and all(isinstance(p, str) for p in node):
        joined = np.array([str(p)[:1000] for p in node], dtype=np.str_)
    elif node and all(isinstance(p, Leaf) and p.size == 1 for p in node):
        joined = np.array([p.read().ravel()[0] for p in node if isinstance(p, Leaf)])
    else:
        return None
    return Leaf(joined.shape, lambda: joined)


def _flat(tree: dict[str, Node], path: str = "", into: _Found | None = None) -> _Found:
    """Collect the contents of nested structs, by path."""
    content = into if into is not None else _Found({}, {}, {}, {})
    for name, node in _numbered(tree).items():
        full_path = f"{path}.{name}" if path else name
        if isinstance(node, dict):
            _flat(node, full_path, content)
        elif isinstance(node, Leaf):
            content.leaves[full_path] = node
        elif isinstance(node, str):
            content.texts[full_path] = node
        elif isinstance(node, Refused):
            content.refused[full_path] = node.what
        elif (leaf := _joined(node)) is not None:
            content.leaves[full_path] = leaf
        elif any(not (isinstance(p, Leaf) and p.size == 0) for p in node):
            content.lists[full_path] = node
    return content


def _numbered(tree: dict[str, Node]) -> dict[str, Node]:
    """Convert structs called trial_1, trial_2, ... to one list of structs."""
    groups: dict[str, list[tuple[int, str]]] = {}
    for name, node in tree.items():
        match = re.fullmatch(r"(.*?[^\d])0*(\d{1,6})", name)
        if match and isinstance(node, dict):
            groups.setdefault(match.group(1).rstrip("_"), []).append((int(match.group(2)), name))
    lists = {base: sorted(names) for base, names in groups.items() if len(names) > 1}
    inside = {name for names in lists.values() for _, name in names}
    rest: dict[str, Node] = {name: node for name, node in tree.items() if name not in inside}
    joined: dict[str, Node] = {base: [tree[n] for _, n in names] for base, names in lists.items()}
    return rest | {base: parts for base, parts in joined.items() if base not in rest}


def _run(
    content: _Found,
    name: str,
    facts: Mapping[str, float | str],
    wanted: Wanted,
    left_out: dict[str, list[str]],
) -> RawRun:
    """Build a run from contents without lists."""
    arrays = {path: leaf for path, leaf in content.leaves.items() if leaf.size > 1}
    own_facts: dict[str, float | str] = {**facts, **content.texts, **_scalars(content)}
    lengths = Counter(leaf.size for leaf in arrays.values() if leaf.size == max(leaf.shape))
    _count_smooth_axes(arrays, lengths, wanted)
    tables: dict[int, dict[str, RawColumn]] = {}
    timed: list[RawTable] = []
    series = _time_series(arrays)
    labels, units = _texts_beside(arrays)
    for path, leaf in arrays.items():
        columns = _of_channels(_columns(path, leaf, lengths, wanted, left_out), leaf, labels, units)
        if path in series:
            time = np.asarray(arrays[series[path]].read(), dtype=np.float64).ravel()
            fits = [c for c in columns.values() if len(c.values) == len(time)]
            if len(fits) == len(columns):
                timed.append(RawTable(columns, time))
                continue
        for column, values in columns.items():
            tables.setdefault(len(values.values), {})[column] = values
    return RawRun(name, (*_merged(timed), *(RawTable(c) for c in tables.values())), own_facts)


#: Name of a column in a matrix of samples and channels; and the most labels of channels.
_CHANNEL: Final = re.compile(r".*\((?::,(\d+)|(\d+),:)\)")
_MOST_CHANNELS: Final = 256


def _texts_beside(arrays: Mapping[str, Leaf]) -> tuple[dict[int, list[str]], dict[int, list[str]]]:
    """Lists of unique names, and of units, by their lengths."""
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
    """Add the labels and units of channels to the columns of a matrix."""
    labelled = dict(columns)
    for name, column in columns.items() if len(leaf.shape) == 2 else ():
        match = _CHANNEL.fullmatch(name)
        if match is None:
            continue
        first = match.group(1) is None
        count, at = leaf.shape[0 if first else 1], int(match.group(2 if first else 1)) - 1
        label, unit = (texts[count][at] if count in texts else None for texts in (labels, units))
        known = unit if unit is not None and known_unit(unit) is not None else None
        labelled[name] = replace(column, unit=column.unit or known, label=label)
    return labelled


def _time_series(arrays: Mapping[str, Leaf]) -> dict[str, str]:
    """Map of data to their own time, as saved by Simulink and `timeseries`."""
    time_of: dict[str, str] = {}
    for path in arrays:
        base, _, name = path.rpartition(".")
        if base and name in _TIMES:
            time_of |= {f"{base}.{d}": path for d in _DATA if f"{base}.{d}" in arrays}
    return time_of


def _merged(timed: Sequence[RawTable]) -> list[RawTable]:
    """Merge tables with the same time."""
    merged: list[RawTable] = []
    for table in timed:
        for i, earlier in enumerate(merged):
            if np.array_equal(table.time_s, earlier.time_s):  # type: ignore[arg-type]
                merged[i] = replace(earlier, columns={**earlier.columns, **table.columns})
                break
        else:
            merged.append(table)
    return merged


def _columns(
    path: str, leaf: Leaf, lengths: Counter[int], wanted: Wanted, left_out: dict[str, list[str]]
) -> dict[str, RawColumn]:
    """Wanted columns of an array, by MATLAB's names."""
    if leaf.size == max(leaf.shape):
        if not wanted(path):
            left_out.setdefault(_UNWANTED, []).append(path)
            return {}
        return {path: _column(leaf.read().ravel())}
    if leaf.size // max(leaf.shape) > _MOST_COLUMNS:
        left_out.setdefault(f"more than {_MOST_COLUMNS} columns", []).append(path)
        return {}
    chosen = _candidates(path, leaf, lengths, wanted)
    if not chosen:
        left_out.setdefault(_UNWANTED, []).append(path)
        return {}
    values = leaf.read()
    along = _along_time(values, list(chosen)) if len(chosen) > 1 else next(iter(chosen))
    return {name: _column(values[index]) for name, index in chosen[along]}


def _candidates(
    path: str, leaf: Leaf, lengths: Counter[int], wanted: Wanted
) -> dict[int, list[tuple[str, tuple[int | slice, ...]]]]:
    """Possible axes of samples, the most likely first, with their wanted columns."""
    axes = sorted(range(len(leaf.shape)), key=lambda a: (-lengths[leaf.shape[a]], -leaf.shape[a]))
    possible = [
        a for a in axes if leaf.shape[a] > 1 and leaf.size // leaf.shape[a] <= _MOST_COLUMNS
    ]
    named = {
        a: [column for column in _names(path, leaf.shape, a) if wanted(column[0])] for a in possible
    }
    return {axis: names for axis, names in named.items() if names}


def _count_smooth_axes(arrays: Mapping[str, Leaf], lengths: Counter[int], wanted: Wanted) -> None:
    """Favour lengths along which some array is far smoother, as the axis of samples of all arrays.

    The noise of a muscle at rest does not show its axis of samples, but the motion does.
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
    """Axis of samples: the first, unless the signals are far smoother along a longer axis.

    A signal changes little from sample to sample, but is not continuous from trial to trial.
    """
    first, shape = axes[0], values.shape
    if values.dtype.kind not in "fiu":
        return first
    longer = [a for a in axes if shape[a] >= _SAMPLES and shape[a] > shape[first]]
    rough = {a: _roughness(values, a) for a in (first, *longer)}
    best = min(rough, key=lambda a: rough[a])
    return best if rough[best] < _SMOOTHER * rough[first] else first


def _roughness(values: np.ndarray[Any, Any], axis: int) -> float:
    """Mean step of a signal relative to its mean deviation."""
    numbers = np.asarray(values, dtype=np.float64)
    with np.errstate(invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # lines without any number
        step = np.nanmean(np.abs(np.diff(numbers, axis=axis)))
        spread = np.nanmean(np.abs(numbers - np.nanmean(numbers, axis=axis, keepdims=True)))
    return float(step / spread) if spread > 0 else np.inf


#: Fewest values along an axis of samples, and largest ratio of roughness for a smoother axis.
_SAMPLES: Final = 20
_SMOOTHER: Final = 0.5
_UNWANTED: Final = "the mapping gives them no meaning"


def _names(
    path: str, shape: tuple[int, ...], axis: int
) -> Iterator[tuple[str, tuple[int | slice, ...]]]:
    """Yield the names of the columns along an axis, with their indices."""
    others: list[Sequence[int | slice]] = [
        range(n) if a != axis else (slice(None),) for a, n in enumerate(shape)
    ]
    for index in product(*others):
        inside = ",".join(":" if isinstance(i, slice) else str(i + 1) for i in index)
        yield f"{path}({inside})", index


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
