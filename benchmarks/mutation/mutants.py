"""Small faults of the product code, one for every place: what `mutation_score.py` draws from.

Not mutated: texts (also those of errors and warnings), annotations, decorators, seeds, blocks for
type checkers, and `__repr__` and `_repr_html_`.
"""

from __future__ import annotations

import ast
import hashlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

BINARY: dict[type[ast.operator], ast.operator] = {
    ast.Add: ast.Sub(), ast.Sub: ast.Add(), ast.Mult: ast.Div(), ast.Div: ast.Mult(),
    ast.FloorDiv: ast.Mult(), ast.Mod: ast.Mult(), ast.Pow: ast.Mult(), ast.MatMult: ast.Mult(),
    ast.BitAnd: ast.BitOr(), ast.BitOr: ast.BitAnd(),
}  # fmt: skip
COMPARE: dict[type[ast.cmpop], tuple[ast.cmpop, ...]] = {
    ast.Lt: (ast.LtE(), ast.Gt()), ast.LtE: (ast.Lt(), ast.GtE()), ast.Gt: (ast.GtE(), ast.Lt()),
    ast.GtE: (ast.Gt(), ast.LtE()), ast.Eq: (ast.NotEq(),), ast.NotEq: (ast.Eq(),),
    ast.Is: (ast.IsNot(),), ast.IsNot: (ast.Is(),), ast.In: (ast.NotIn(),),
    ast.NotIn: (ast.In(),),
}  # fmt: skip
NAMES = "min max, minimum maximum, any all, argmin argmax, floor ceil, sin cos, nanmin nanmax"
SWAPPED = {a: b for pair in NAMES.split(", ") for a, b in (pair.split(), pair.split()[::-1])}
Path_ = tuple[tuple[str, int | None], ...]

#: What the ranks call a room -> its folder: the names stay, so that a sample stays the same.
ROOMS = {
    "regression": "numerics/regression",
    "signals": "numerics/signals",
    "impedance": "hand/still",
    "levels": "hand/levels",
    "ellipses": "hand/ellipses",
    "elbow": "joint/elbow",
}


def room_of(file: str | Path) -> str:
    """The name of the room that a file of the tree lies in."""
    return next(name for name, folder in ROOMS.items() if f"armimpedance/{folder}/" in str(file))


def replacements(node: ast.AST) -> Iterator[ast.AST]:
    """Every small fault that may stand in the place of a node of the syntax tree."""
    match node:
        case ast.BinOp(left, op, right) if type(op) in BINARY:
            yield ast.BinOp(left, BINARY[type(op)], right)
        case ast.AugAssign(target, op, value) if type(op) in BINARY:
            yield ast.AugAssign(target, BINARY[type(op)], value)
        case ast.Compare(left, [op], right):
            yield from (ast.Compare(left, [other], right) for other in COMPARE[type(op)])
        case ast.Constant(bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(int(value) | float(value)):
            yield ast.Constant(value + 1)
            if value:
                yield from (ast.Constant(2 * value), ast.UnaryOp(ast.USub(), node))
        case ast.UnaryOp(ast.USub() | ast.Not() | ast.Invert(), operand):
            yield operand
        case ast.BoolOp(op, values):
            yield ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
        case ast.Attribute(value, "T", ctx=ast.Load()):
            yield value
        case ast.Slice(lower, upper, step) if lower or upper:
            one = ast.Constant(1)
            yield ast.Slice(ast.BinOp(lower, ast.Add(), one) if lower else one, upper, step)
            if upper:
                yield ast.Slice(lower, ast.BinOp(upper, ast.Sub(), one), step)
        case ast.Call(function, arguments, keywords):
            if isinstance(function, ast.Name) and function.id in SWAPPED:
                yield ast.Call(ast.Name(SWAPPED[function.id], ast.Load()), arguments, keywords)
            if isinstance(function, ast.Attribute) and function.attr in SWAPPED:
                other = ast.Attribute(function.value, SWAPPED[function.attr], ast.Load())
                yield ast.Call(other, arguments, keywords)
            for k in range(len(keywords)):
                yield ast.Call(function, arguments, keywords[:k] + keywords[k + 1 :])
        case ast.If(test, body, orelse) if isinstance(test, ast.Name | ast.Call | ast.Attribute):
            yield ast.If(ast.UnaryOp(ast.Not(), test), body, orelse)
        case ast.Return(value) if value and not isinstance(value, ast.Constant):
            yield ast.Return(ast.Constant(None))


def is_left_alone(node: ast.AST, step: str) -> bool:
    """Whether a node, reached by the field `step`, and all that lies below is never mutated."""
    match node:
        case ast.JoinedStr() | ast.Raise() | ast.Import() | ast.ImportFrom():
            return True
        case ast.FunctionDef(name) if name in ("__repr__", "_repr_html_"):
            return True
        case ast.If(ast.Name("TYPE_CHECKING")):
            return True
        case ast.Call(ast.Attribute(attr="warn" | "default_rng" | "SeedSequence")):
            return True
        case (
            ast.BinOp(ast.Constant(str()) | ast.JoinedStr())
            | ast.BinOp(right=ast.Constant(str()) | ast.JoinedStr())
        ):
            return True
    return step in ("annotation", "returns", "decorator_list")


@dataclass
class Mutant:
    """One change of one place; `lines` are those on which a test must be to meet it."""

    file: str
    line: int
    function: str
    text: str
    before: str
    after: str
    lines: list[int] = field(repr=False)
    change: tuple[Path_, ast.AST] = field(repr=False)
    rank: str = field(repr=False)
    outcome: str = ""
    seconds: float = 0.0

    def mutated(self, source: str) -> str:
        """The source text of the file with the mutant in it."""
        path, new = self.change
        tree: Any = ast.parse(source)
        parent = tree
        for name, k in path[:-1]:
            parent = getattr(parent, name) if k is None else getattr(parent, name)[k]
        name, k = path[-1]
        if k is None:
            setattr(parent, name, new)
        else:
            getattr(parent, name)[k] = new
        return ast.unparse(ast.fix_missing_locations(tree))


def places(
    node: ast.AST, path: Path_ = (), scopes: tuple[ast.AST, ...] = ()
) -> Iterator[tuple[Path_, ast.AST, tuple[ast.AST, ...]]]:
    """Every node that may be mutated: its path from the root, itself and what it lies in."""
    yield path, node, scopes
    for name, value in ast.iter_fields(node):
        for k, child in enumerate(value if isinstance(value, list) else [value]):
            if isinstance(child, ast.AST) and not is_left_alone(child, name):
                step = (name, k if isinstance(value, list) else None)
                yield from places(child, (*path, step), (*scopes, node))


def lines_of(node: ast.AST, scopes: tuple[ast.AST, ...], tree: ast.Module) -> list[int]:
    """Lines that tell whether a test meets a node: its statement, or what its header is of."""
    statement = [s for s in (*scopes, node) if isinstance(s, ast.stmt)][-1]
    within = [s for s in scopes if isinstance(s, ast.FunctionDef) and s is not statement]
    first, last = statement.lineno, statement.end_lineno or statement.lineno
    if not within and not isinstance(statement, ast.FunctionDef):
        return list(range(1, (tree.body[-1].end_lineno or 0) + 1))  # Runs at import.
    body = getattr(statement, "body", None)
    if isinstance(body, list) and not isinstance(statement, ast.FunctionDef):
        last = max(first, body[0].lineno - 1)
    return list(range(first, last + 1))


def mutants_of(root: Path, file: Path, seed: int) -> Iterator[Mutant]:
    """One mutant for every place of a file, chosen among the place's by a hash."""
    source = file.read_text(encoding="utf-8")
    rows, tree, room = source.splitlines(), ast.parse(source), room_of(file)
    seen: Counter[str] = Counter()
    for path, node, scopes in places(tree):
        function = ".".join(s.name for s in scopes if isinstance(s, ast.FunctionDef | ast.ClassDef))
        text = rows[getattr(node, "lineno", 1) - 1].strip()
        choice = []
        for new in replacements(node):
            short = [ast.unparse(n).split("\n")[0] for n in (node, new)]
            key = "|".join([str(seed), room, function, text, *short])
            seen[key] += 1
            rank = hashlib.sha256(f"{key}|{seen[key]}".encode()).hexdigest()
            choice.append((rank, short, new))
        if choice:
            rank, (before, after), new = min(choice, key=lambda c: c[0])
            rank = hashlib.sha256(rank.encode()).hexdigest()  # Places count alike.
            where = str(file.relative_to(root)), getattr(node, "lineno", 1), function, text
            yield Mutant(*where, before, after, lines_of(node, scopes, tree), (path, new), rank)
