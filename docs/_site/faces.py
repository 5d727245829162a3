"""The faces: a page for each name of the top, a page for each room."""

from __future__ import annotations

import ast
import importlib
import inspect
from pathlib import Path
from typing import Any

from rst import code, directive, title, toctree
from uses_of import use_of

import armimpedance

PACKAGE = Path(armimpedance.__file__).parent
#: Kinds of names at the top, in the order in which a reader meets them.
KINDS = {
    "first": "First steps",
    "verbs": "Verbs: from a recording to a result",
    "files": "Reading and writing",
    "plots": "Pictures",
    "types": "Records and results",
    "errors": "Errors",
}
#: The first steps, in their order.
FIRST = ("read", "recording", "inspect", "estimate", "plot_ellipses", "compare", "to_joint", "save")


def names_of(room: str) -> list[str]:
    """The names on the face of a room; "" is the face of the whole."""
    tree = ast.parse(PACKAGE.joinpath(*room.split("."), "__init__.pyi").read_text())
    imports = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    return sorted(alias.name for node in imports for alias in node.names)


def rooms() -> list[str]:
    """The rooms that have a face."""
    stubs = PACKAGE.glob("*/**/__init__.pyi")
    return sorted(".".join(stub.parent.relative_to(PACKAGE).parts) for stub in stubs)


def api_pages() -> dict[str, str]:
    """Name of a page -> its text."""
    pages = {"reference/api/index": _index()}
    for name in names_of(""):
        pages[f"reference/api/ai/{name}"] = title(f"ai.{name}") + "\n" + _entry("", name)
    for room in rooms():
        pages[f"reference/api/rooms/{room}"] = _room(room)
    return pages


def _index() -> str:
    text = [
        title("API"),
        "Everything that a script needs stands at the top: ``import armimpedance as ai``. "
        "The rooms below hold the parts of which the verbs are made.\n",
    ]
    by_kind: dict[str, list[str]] = {kind: [] for kind in KINDS}
    for name in names_of(""):
        by_kind[_kind(name)].append(name)
    by_kind["first"] = list(FIRST)
    for kind, names in by_kind.items():
        rows = "\n".join(f"* - :doc:`ai.{n} <ai/{n}>`\n  - {_first_line('', n)}" for n in names)
        text += [title(KINDS[kind], "-"), directive("list-table", "", rows, widths="30 70")]
        text += [toctree([f"ai.{n} <ai/{n}>" for n in names], hidden="", caption=KINDS[kind])]
    text += [title("Rooms", "-")]
    rows = "\n".join(
        f"* - :doc:`armimpedance.{room} <rooms/{room}>`\n  - {_line_of(_room_doc(room))}"
        for room in rooms()
    )
    text += [directive("list-table", "", rows, widths="30 70")]
    text += [toctree([f"{room} <rooms/{room}>" for room in rooms()], hidden="", caption="Rooms")]
    return "\n".join(text)


def _kind(name: str) -> str:
    thing = getattr(armimpedance, name)
    if name in FIRST:
        return "first"
    if inspect.isclass(thing):
        return "errors" if issubclass(thing, Exception) else "types"
    last = thing.__module__.split(".")[-1]
    return "verbs" if "verb" in last else "plots" if "plot" in thing.__name__ else "files"


def _room(room: str) -> str:
    text = [title(f"armimpedance.{room}"), _room_doc(room), ""]
    text += [_entry(room, name) for name in names_of(room)]
    return "\n".join(text)


def _room_doc(room: str) -> str:
    return inspect.getdoc(importlib.import_module(f"armimpedance.{room}")) or ""


def _entry(room: str, name: str) -> str:
    module = f"armimpedance.{room}" if room else "armimpedance"
    thing = getattr(importlib.import_module(module), name)
    where = f"{module}::{name}"
    if room and getattr(armimpedance, name, None) is thing:
        return f":doc:`ai.{name} <../ai/{name}>`: {_first_line(room, name)}\n"
    return f"{_described(where, thing)}\n{_use_of(room, name, thing)}"


def _described(where: str, thing: Any) -> str:
    if inspect.isclass(thing):
        return directive("autoclass", where, members="", **_inherited(thing))
    if callable(thing) and not hasattr(thing, "__origin__"):
        return directive("autofunction", where)
    return directive("py:data", where.replace("::", "."), f"``{_shown(thing)}``\n")


def _use_of(room: str, name: str, thing: Any) -> str:
    """A use of the name, where its docstring has no example."""
    use = None if has_example(thing) else use_of(room, name)
    if use is None:
        return ""
    return directive("dropdown", f"{use.what}: {use.where}", code(use.source, "python"))


def names_without_an_example() -> list[str]:
    """Names of which neither the docstring nor a use shows anything."""
    missing = []
    for room in ["", *rooms()]:
        module = importlib.import_module(f"armimpedance.{room}" if room else "armimpedance")
        for name in names_of(room):
            thing = getattr(module, name)
            shown = has_example(thing) or (room and use_of(room, name))
            if not shown and not (room and getattr(armimpedance, name, None) is thing):
                missing.append(f"{module.__name__}.{name}")
    return missing


def has_example(thing: Any) -> bool:
    """Whether the docstring has an example that runs."""
    return ">>>" in (inspect.getdoc(thing) or "")


def _inherited(thing: type[Any]) -> dict[str, str]:
    foreign = [c.__name__ for c in thing.__mro__ if not c.__module__.startswith("armimpedance")]
    return {"inherited_members": ", ".join(foreign)}


def _shown(thing: Any) -> str:
    if hasattr(thing, "listed"):
        return thing.listed()
    text = repr(thing)
    return text if len(text) < 200 and " at 0x" not in text else type(thing).__name__


def _first_line(room: str, name: str) -> str:
    module = f"armimpedance.{room}" if room else "armimpedance"
    return _line_of(inspect.getdoc(getattr(importlib.import_module(module), name)) or "")


def _line_of(doc: str) -> str:
    """The first paragraph of a docstring, which may go over several lines."""
    return " ".join(doc.split("\n\n")[0].split())
