"""The faces: a page for each name of the top, a page for each room."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rst import code, directive, title, toctree
from uses_of import use_of

import armimpedance

PACKAGE = Path(armimpedance.__file__).parent
#: The names used most, in the order of work.
FIRST = (
    *("read", "inspect", "estimate", "to_joint", "fit_posture", "predict"),
    *("compare", "plot_ellipses", "write_report", "save"),
)
#: Heading -> the modules whose names stand below it: the order of work, then the topics.
SECTIONS = {
    "Read, inspect, write": r"recordings|show|app\.(inspection|report)",
    "Estimate: a hand at rest": r"hand\.(still|ellipses|show\.(estimates|labelled))",
    "To the joints and the muscles": r"hand\.levels|limb\.arm",
    "Fit and predict: models over posture and EMG": r"muscles\.(models|show)",
    "Compare": r"hand\.comparison|app\.study",
    "Plot": r"hand\.show\.\w+_plot",
    "Plan an experiment": r"hand\.(planning|adaptive)",
    "A hand that moves": r"hand\.reaching",
    "Random perturbations of hand, wrist or ankle": r"hand\.random",
    "One joint under a random perturbation": r"joint\.elbow",
    "Relaxed joints": r"joint\.relaxed",
    "Masses and inertias of a body": r"joint\.body",
    "Therapy robots": r"joint\.therapy",
    "Live stiffness": r"muscles\.live",
    "Records": r"",
    "Errors": r"core\.errors",
}
#: The first steps as a session; `docs/check_faces.py` runs it.
EXAMPLE = """\
>>> import armimpedance as ai
>>> from manipulandum_sim.hand import simulate
>>> levels = ["cocontraction_10", "cocontraction_30"]
>>> simulated, truth = simulate("cocontraction", seed=1, sets=2, conditions=levels)
>>> ai.write_recording(simulated, "session")
>>> session = ai.read("session")
>>> ai.inspect(session).usable
True
>>> hand = ai.estimate(session)
>>> hand
2 estimates
cocontraction_10: weighted, 16 trials, K 397.8, 151.9 N/m
cocontraction_30: weighted, 16 trials, K 640.8, 304.5 N/m
>>> ai.to_joint(hand)["cocontraction_10"].stiffness
K (N m/rad)   shoulder              elbow
shoulder      33.2 [23.75, 42.65]   13.82 [7.56, 20.08]
elbow         13.82 [7.56, 20.08]   24.68 [19.96, 29.4]
>>> difference = ai.compare(session, permutations=99)
>>> difference.pairs[0].second
'cocontraction_30'
>>> axes = ai.plot_ellipses(hand)
>>> [path.name for path in ai.save(axes.figure, "ellipses")]
['ellipses.png', 'ellipses.svg']
>>> ai.write_report(session, "report.html").verdict.trust
'The numbers can be used: 2 groups, 32 trials.'
>>> places = [f"posture_{k:02d}" for k in range(1, 11)]
>>> postures, truth = simulate("postures", seed=1, sets=1, conditions=places)
>>> model = ai.fit_posture(ai.to_joint(ai.estimate(postures)), order=1)
>>> predicted = ai.predict(model, postures=[[1.0, 1.5]])
>>> predicted.to_frame()[["K_11", "sd_K_11", "extrapolated"]].round(1)
   K_11  sd_K_11  extrapolated
0  24.9      7.5             1
"""


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
        "The modules below hold the parts of which these functions are made.\n",
    ]
    for heading, names in _sections().items():
        rows = "\n".join(f"* - :doc:`ai.{n} <ai/{n}>`\n  - {_first_line('', n)}" for n in names)
        text += [title(heading, "-"), directive("list-table", "", rows, widths="30 70")]
        text += [toctree([f"ai.{n} <ai/{n}>" for n in names], hidden="", caption=heading)]
        if names == FIRST:
            text += ["One after another, on a simulated person:\n", code(EXAMPLE, "pycon")]
    text += [title("Modules", "-")]
    rows = "\n".join(
        f"* - :doc:`armimpedance.{room} <rooms/{room}>`\n  - {_line_of(_room_doc(room))}"
        for room in rooms()
    )
    text += [directive("list-table", "", rows, widths="30 70")]
    text += [toctree([f"{room} <rooms/{room}>" for room in rooms()], hidden="", caption="Modules")]
    return "\n".join(text)


def _sections() -> dict[str, Sequence[str]]:
    """Heading -> names of the top: what one calls, then pictures, then what one gets."""
    found: dict[str, list[str]] = {heading: [] for heading in SECTIONS}
    for name in sorted(set(names_of("")) - set(FIRST), key=_place):
        found[_section(name)].append(name)
    return {"The ten names used most": FIRST, **found}


def _place(name: str) -> tuple[bool, bool, str]:
    thing = getattr(armimpedance, name)
    return inspect.isclass(thing), "plot" in thing.__module__, name


def _section(name: str) -> str:
    module = getattr(armimpedance, name).__module__.removeprefix("armimpedance.")
    fitting = (heading for heading, where in SECTIONS.items() if where and re.match(where, module))
    return next(fitting, "Records")


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
