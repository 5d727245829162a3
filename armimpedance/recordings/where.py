"""Selection of trials by an expression over the columns of the trial table.

`TP == 3 and is_error == 0` is parsed as Python, but only comparisons of columns with numbers and
texts, `and`, `or`, `not` and parentheses are allowed: no code is ever run.
"""

from __future__ import annotations

import ast
import keyword
import operator
import re
import unicodedata
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import reduce
from typing import Any, Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import BoolArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.core.records import Recording
from armimpedance.recordings.reading import AnyRecording

#: The longest and deepest expression; a longer one is a list of trials.
LONGEST: Final = 2000
DEEPEST: Final = 30

#: Experimenters' names for columns of the trial table, used if no column has that name.
OTHER_NAMES: Final = {"TP": "protocol", "block": "set"}

_EXPECTED: Final = "comparisons such as: TP == 3 and is_error == 0"

_COMPARISONS: Final[Mapping[type[ast.cmpop], Callable[[Any, Any], Any]]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


@dataclass(frozen=True)
class Where:
    """A parsed selection of trials.

    `tree`: its syntax tree, of a size that is safe to walk.
    """

    tree: ast.expr

    @property
    def text(self) -> str:
        """The expression, on one line."""
        return ast.unparse(self.tree)

    @property
    def parts(self) -> tuple[ast.expr, ...]:
        """The conditions that must all hold."""
        both = isinstance(self.tree, ast.BoolOp) and isinstance(self.tree.op, ast.And)
        return tuple(self.tree.values) if both else (self.tree,)  # type: ignore[attr-defined]

    def choose(self, trials: pd.DataFrame, file: object = None) -> tuple[BoolArray, str]:
        """Select trials, (T,), and return a sentence with their number.

        `trials` DataFrame (T rows).
        `file`: the origin of the trials, for messages.
        Raises InputError: it names an unknown column, compares texts with numbers, or selects no
        trial; the message then has the number of trials that each part selects.
        """
        table = _Table(trials, file)
        masks = [table.truth(part) for part in self.parts]
        chosen = reduce(np.logical_and, masks)
        counts = [f"{ast.unparse(p)}: {m.sum()}" for p, m in zip(self.parts, masks, strict=True)]
        count_note = f" ({'; '.join(counts)})" if len(masks) > 1 else ""
        if not chosen.any():
            problem = f"where {self.text}: no trial is left of {len(trials)}{count_note}"
            raise InputError(problem, file=file, expected="a choice that some trial meets")
        return chosen, f"Trials where {self.text}: {chosen.sum()} of {len(trials)}{count_note}."


def parse_where(text: str) -> Where:
    """Parse a selection of trials; its columns are looked up when it is applied.

    `text`: such as ``TP in (1, 2) and not is_error``.
    Raises InputError: it is not an expression of comparisons.
    """
    if len(text) > LONGEST:
        problem = f"where: an expression of {len(text)} characters"
        raise InputError(problem, expected=f"at most {LONGEST}")
    try:
        with warnings.catch_warnings():
            # Python's warnings on odd escapes and "1if" are meant for programmers, not for users.
            warnings.simplefilter("ignore")
            tree = ast.parse(text.replace("\n", " ").strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        hint = "; == compares" if re.search(r"(?<![=!<>])=(?!=)", text) else ""
        problem = f"where {_shown(text)}: cannot be read"
        raise InputError(problem, expected=_EXPECTED + hint) from None
    if _depth(tree) > DEEPEST:
        problem = f"where {_shown(text)}: nested more than {DEEPEST} deep"
        raise InputError(problem, expected=_EXPECTED)
    _check_truth(tree)
    return Where(tree)


def with_where(recording: AnyRecording, text: str, file: object = None) -> AnyRecording:
    """Select the trials of a recording by an expression.

    Parameters
    ----------
    recording : Recording, MarkerRecording or MotionRecording
    text : str
        Over the columns of its trial table, such as ``"block == 2 and is_error == 0"``.
    file : path, optional
        The origin of the recording, for messages.

    Returns
    -------
    Recording, MarkerRecording or MotionRecording
        Of the same kind; its provenance states the number of selected trials.

    Raises
    ------
    InputError
        It is not an expression, names an unknown column, or selects no trial.

    Examples
    --------
    >>> from armimpedance.recordings import with_where
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> with_where(recording, "trial in (1, 3)").n_trials
    2
    """
    rows, sentence = parse_where(text).choose(recording.trials, file)
    if isinstance(recording, Recording | MarkerRecording):
        kept: AnyRecording = recording.select(rows)
    else:
        emg = None if recording.emg is None else recording.emg.select(rows)
        kept = replace(recording.select(rows), emg=emg)
    return replace(kept, provenance=(*kept.provenance, sentence))


# ---- the allowed syntax --------------------------------------------------------------------------


def _depth(tree: ast.expr) -> int:
    """The depth of a tree, found without recursion up to the limit."""
    depth, nodes = 0, list[ast.AST]([tree])
    while nodes and depth <= DEEPEST:
        depth += 1
        nodes = [child for node in nodes for child in ast.iter_child_nodes(node)]
    return depth


def _check_truth(node: ast.expr) -> None:
    """Refuse anything that is not a condition, before any recording is read."""
    if isinstance(node, ast.BoolOp):
        for value in node.values:
            _check_truth(value)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        _check_truth(node.operand)
    elif isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        for op, left, right in zip(node.ops, sides[:-1], sides[1:], strict=True):
            _check_comparison(op, left, right)
    elif not isinstance(node, ast.Name):
        raise _refused(node)


def _check_comparison(op: ast.cmpop, left: ast.expr, right: ast.expr) -> None:
    _check_value(left)
    if isinstance(op, ast.In | ast.NotIn) and isinstance(right, ast.Tuple | ast.List | ast.Set):
        for value in right.elts:
            _check_constant(value)
    elif isinstance(op, ast.Is | ast.IsNot):
        raise _refused(ast.Compare(left, [op], [right]), "== and != in place of is")
    else:
        _check_value(right)


def _check_value(node: ast.expr) -> None:
    if not isinstance(node, ast.Name):
        _check_constant(node)


def _check_constant(node: ast.expr) -> None:
    if _constant(node) is None:
        raise _refused(node)


def _constant(node: ast.expr) -> float | str | None:
    """The number or text in a node; None for anything else."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        number = _constant(node.operand)
        sign = -1.0 if isinstance(node.op, ast.USub) else 1.0
        return sign * number if isinstance(number, float) else None
    value = node.value if isinstance(node, ast.Constant) else None
    if isinstance(value, str):
        return value
    if not isinstance(value, int | float):
        return None
    try:
        return float(value)
    except OverflowError:
        raise InputError("where: a number that is too large", expected=_EXPECTED) from None


def _refused(node: ast.expr, expected: str = _EXPECTED) -> InputError:
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitAnd | ast.BitOr):
        expected = "the words and, or, not"
    return InputError(f"where: {_shown(ast.unparse(node))} is no condition", expected=expected)


def _shown(text: str) -> str:
    """A user's text, shortened for a message of one line."""
    return repr(text if len(text) <= 60 else text[:57] + "…")


# ---- evaluation ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Table:
    """The columns of a trial table by their names in an expression."""

    trials: pd.DataFrame
    file: object

    def truth(self, node: ast.expr) -> BoolArray:
        """Evaluate a condition for each trial, (T,)."""
        if isinstance(node, ast.BoolOp):
            join = np.logical_and if isinstance(node.op, ast.And) else np.logical_or
            return reduce(join, [self.truth(value) for value in node.values])
        if isinstance(node, ast.UnaryOp):
            return ~self.truth(node.operand)
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            pairs = zip(node.ops, sides[:-1], sides[1:], strict=True)
            return reduce(np.logical_and, [self._compared(*pair) for pair in pairs])
        return self._flag(node)

    def _flag(self, node: ast.expr) -> BoolArray:
        """A column of yes and no that is a condition by itself."""
        values = self._values(node)
        if values.dtype == object or not np.isin(values, (0.0, 1.0)).all():
            raise self._error(f"{ast.unparse(node)} is not yes or no in every trial", _EXPECTED)
        return values == 1.0

    def _compared(self, op: ast.cmpop, left: ast.expr, right: ast.expr) -> BoolArray:
        is_member: BoolArray
        if isinstance(op, ast.In | ast.NotIn):
            is_member = self._among(left, right)
            return ~is_member if isinstance(op, ast.NotIn) else is_member
        first, second = self._values(left), self._values(right)
        self._check_kinds(left, first, right, second)
        # A missing number is NaN: no comparison is true except "unequal".
        return np.broadcast_to(_COMPARISONS[type(op)](first, second), len(self.trials)).astype(bool)

    def _among(self, left: ast.expr, right: ast.expr) -> BoolArray:
        values = self._values(left)
        if not isinstance(right, ast.Tuple | ast.List | ast.Set):
            return self._within(left, values, right)
        is_member = np.zeros(len(self.trials), dtype=bool)
        for element in right.elts:
            element_value = self._values(element)
            self._check_kinds(left, values, element, element_value)
            is_member |= values == element_value
        return is_member

    def _within(self, left: ast.expr, inner: np.ndarray, right: ast.expr) -> BoolArray:
        """Test if one text contains another, as in ``"slow" in condition``."""
        outer = self._values(right)
        if inner.dtype != object or outer.dtype != object:
            problem = f"{ast.unparse(left)} in {ast.unparse(right)}"
            raise self._error(problem, "texts, or a list such as (1, 2)")
        pairs = np.broadcast_arrays(inner, outer, np.empty(len(self.trials), dtype=object))[:2]
        return np.array([a in b for a, b in zip(*pairs, strict=True)], dtype=bool)

    def _values(self, node: ast.expr) -> np.ndarray:
        """Numbers (T,) or () as float, texts as objects; "" and NaN for missing values."""
        if isinstance(node, ast.Name):
            return _as_values(self.trials[self._column(node.id)])
        constant = _constant(node)
        return np.array(constant, dtype=object if isinstance(constant, str) else np.float64)

    def _check_kinds(
        self, left: ast.expr, first: np.ndarray, right: ast.expr, second: np.ndarray
    ) -> None:
        if (first.dtype == object) == (second.dtype == object):
            return
        text, number = (left, right) if first.dtype == object else (right, left)
        problem = f"{ast.unparse(text)} is text, {ast.unparse(number)} a number"
        raise self._error(problem, "numbers with numbers, texts in quotes with texts")

    def _column(self, name: str) -> Any:
        """Find the column of this name: an exact match, else one ignoring case."""
        if name in self.trials:
            return name
        known = {plain_name(str(c)).casefold(): c for c in self.trials.columns}
        for alias, column in OTHER_NAMES.items():
            if column in self.trials:
                known.setdefault(alias.casefold(), column)
        if name.casefold() in known:
            return known[name.casefold()]
        names = list(self._names())
        # Similar names come first, as the names of a long table exceed a message.
        near = get_close_matches(name, names, n=3, cutoff=0.7)
        names = list(dict.fromkeys([*near, *names]))
        raise self._error(f"no column {_shown(name)}", f"one of {', '.join(names)}")

    def _names(self) -> Iterator[str]:
        yield from (other for other, column in OTHER_NAMES.items() if column in self.trials)
        yield from (plain_name(str(column)) for column in self.trials.columns)

    def _error(self, problem: str, expected: str) -> InputError:
        return InputError(f"where: {problem}", file=self.file, expected=expected)


def plain_name(column: str) -> str:
    """A column's name in an expression: all except letters and digits become underscores."""
    plain = re.sub(r"\W+", "_", unicodedata.normalize("NFKC", column)).strip("_") or "_"
    plain = f"_{plain}" if plain[0].isdigit() else plain
    return f"{plain}_" if keyword.iskeyword(plain) else plain


def _as_values(column: pd.Series) -> np.ndarray:
    if pd.api.types.is_bool_dtype(column) or pd.api.types.is_numeric_dtype(column):
        return column.to_numpy(dtype=np.float64, na_value=np.nan)
    filled = column.astype(object).where(column.notna(), "")
    return np.array([str(value) for value in filled] or [], dtype=object)
