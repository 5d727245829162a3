"""The rooms: import order, faces, no circles, and a start that imports nothing heavy."""

from __future__ import annotations

import ast
import re
import runpy
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]

#: From top to bottom; a package may import packages of lower rank only, and itself.
RANKS = [
    {"__main__"},
    {"lab"},
    {"app"},
    {"muscles"},
    {"hand", "joint"},
    {"show"},
    {"recordings", "limb"},
    {"numerics"},
    {"core"},
]
RANK = {room: rank for rank, rooms in enumerate(RANKS) for room in rooms}

#: Module that a test of laziness looks for -> files that may import it, and only inside functions.
HEAVY = {
    "matplotlib": r"plot|/session/|show/ellipses/|show/pages/pictures|page/strips",
    "altair": r"show/pages/|/linked",
    "jinja2": r"show/pages/",
    "cvxpy": r"^(joint/body|joint/relaxed|hand/levels|muscles|numerics/regression)/",
}
#: It subclasses what matplotlib draws with; who imports it does so inside functions.
DRAWS_ITSELF = "show/plots/room.py"


@cache
def _modules(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


class _Facts(NamedTuple):
    """What the tests ask of a file, which is read and walked once."""

    imports: list[tuple[str, bool]]
    """Imported module names, and whether at module level (outside TYPE_CHECKING)."""
    named: list[tuple[str, str]]
    """(module, name) of every absolute import of a name."""
    classes: list[str]
    """Names of the classes at module level."""
    texts: list[str]
    """Every text that is no docstring."""
    lines: int


@cache
def _facts(path: Path) -> _Facts:
    source = path.read_text()
    tree = ast.parse(source)
    top = {id(node) for node in tree.body}
    classes = [node.name for node in tree.body if isinstance(node, ast.ClassDef)]
    facts = _Facts([], [], classes, [], len(source.splitlines()))
    said = set()
    # from the outside to the inside: whose docstring a text is was seen before the text
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            facts.imports.extend((alias.name, id(node) in top) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            facts.imports.append((node.module, id(node) in top))
            facts.named.extend((node.module, alias.name) for alias in node.names)
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            if ast.get_docstring(node, clean=False):
                said.add(id(node.body[0].value))
        elif isinstance(node, ast.Constant) and id(node) not in said:
            facts.texts.extend([node.value] if isinstance(node.value, str) else [])
    return facts


def _room(module: str) -> str | None:
    parts = module.split(".")
    return parts[1] if parts[0] == "armimpedance" and len(parts) > 1 else None


def _breaches(path: Path) -> Iterator[str]:
    """What a module imports against the order of the rooms."""
    relative = path.relative_to(ROOT / "armimpedance")
    room = relative.parts[0].removesuffix(".py")
    if room == "__init__":
        foreign = {
            module.split(".")[0] for module, _ in _facts(path).imports
        } - sys.stdlib_module_names
        yield from (f"{relative} imports {module}" for module in foreign)
        return
    if room not in RANK:
        yield f"{room} has no place in the import order"
        return
    for module, at_top in _facts(path).imports:
        target, heavy = _room(module), module.split(".")[0]
        upward = target is not None and target != room and RANK[target] <= RANK[room]
        eager = at_top and relative.as_posix() != DRAWS_ITSELF
        misplaced = heavy in HEAVY and (eager or not re.search(HEAVY[heavy], relative.as_posix()))
        simulated = heavy in ("manipulandum_sim", "armimpedance_figures") and room != "lab"
        if upward or misplaced or simulated:
            yield f"{relative} imports {module}"


@pytest.mark.skipif(not (ROOT / "armimpedance").exists(), reason="the source is not beside")
def test_the_page_and_the_drawing_of_the_house_are_those_of_its_rooms():
    drawing = runpy.run_path(str(ROOT / "docs/draw_house.py"))
    assert [set(floor) for floor in drawing["floors"]()] == RANKS[1:]
    drawn = (ROOT / "docs/project/house.svg").read_text(encoding="utf-8")
    assert drawn == drawing["picture"](), "python docs/draw_house.py"


def test_rooms_import_downwards_only_and_heavy_packages_where_they_are_used():
    assert [breach for path in _modules("armimpedance") for breach in _breaches(path)] == []


def test_the_simulator_shares_no_dynamics_with_the_analysis():
    allowed = {"arrays", "records", "motion", "skeleton", "conventions", "errors", "outputs"}
    for path in _modules("manipulandum_sim"):
        named = [module for module, _ in _facts(path).imports if module.startswith("armimpedance")]
        rooms = {module.removeprefix("armimpedance.core.") for module in named}
        assert rooms <= allowed, f"{path.name} imports {rooms - allowed}"


#: Calls that show help, or the version.
HELP = [
    ["--help"],
    ["estimate", "--help"],
    ["simulate", "--help"],
    ["simulate", "elbow-varying", "--help"],
    ["convert", "--help"],
    ["inspect", "--help"],
    ["compare", "--help"],
    ["predict", "--help"],
    ["report", "--help"],
    ["exam", "--help"],
    ["therapy", "robot", "--help"],
    ["--version"],
]


def test_help_imports_nothing_heavy():
    # one process for all: what is loaded stays loaded, and the first call that loads is named
    code = (
        "import sys\n"
        "from armimpedance.__main__ import main\n"
        "heavy = {'numpy', 'scipy', 'pandas', 'matplotlib', 'pinocchio', 'cvxpy', 'pyarrow'}\n"
        f"for arguments in {HELP!r}:\n"
        "    try:\n"
        "        main(arguments)\n"
        "    except SystemExit as end:\n"
        "        assert not end.code, arguments\n"
        "    loaded = heavy & set(sys.modules)\n"
        "    assert not loaded, (arguments, loaded)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("usage: ") == len(HELP) - 1


#: What lies outside of the rooms and may name what they show: through faces as well.
OUTSIDE = ("figures", "benchmarks")


def _stubs() -> list[Path]:
    packages = ("armimpedance", "manipulandum_sim", "figures")
    return sorted(p for place in packages for p in ROOT.glob(f"{place}/*/**/__init__.pyi"))


def _faces() -> dict[str, set[str]]:
    """Room (dotted) -> the names that its stub shows."""
    faces = {}
    for stub in _stubs():
        names = [n for n in ast.walk(ast.parse(stub.read_text())) if isinstance(n, ast.ImportFrom)]
        room = ".".join(stub.parent.relative_to(ROOT).parts)
        faces[room] = {alias.name for node in names for alias in node.names}
    return faces


FACES = _faces()


def _dotted(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def _room_of(module: str) -> str | None:
    """The room with a face that a module lies in."""
    parts = module.split(".")
    ways = (".".join(parts[:k]) for k in range(len(parts), 0, -1))
    return next((way for way in ways if way in FACES), None)


def test_a_room_is_entered_by_its_face():
    places = ("armimpedance", "manipulandum_sim", *OUTSIDE)
    for path in (path for place in places for path in _modules(place)):
        for module, name in _facts(path).named:
            room = _room_of(module)
            # the forms of a topic are part of it
            if room and not f"{_dotted(path)}.".startswith(f"{room.removesuffix('.show')}."):
                assert module == room, f"{path.name} looks into {module}"
                assert name in FACES[room], f"{path.name}: {name} is not on the face of {room}"


def test_what_a_topic_knows_does_not_depend_on_how_it_is_shown():
    for path in _modules("armimpedance"):
        here = _dotted(path)
        if here.split(".")[1:2] in (["hand"], ["joint"], ["muscles"]) and ".show" not in here:
            named = [module for module, _ in _facts(path).imports]
            shown = [m for m in named if re.search(r"\.(hand|joint|muscles)\..*show", m)]
            assert not shown, f"{here} imports {shown}"


def test_what_all_topics_share_names_none_of_them():
    # an import upward is a breach of the ranks; a name in a text would be one that no import shows
    topics = re.compile(r"armimpedance\.(hand|joint|muscles|app|lab)\b")
    for package in ("core", "numerics", "recordings", "limb", "show"):
        for path in _modules(f"armimpedance/{package}"):
            for text in _facts(path).texts:
                assert not topics.search(text), f"{path}: {text}"


def test_a_class_has_its_name_alone():
    seen: dict[str, Path] = {}
    for path in _modules("armimpedance"):
        for name in _facts(path).classes:
            if not name.startswith("_"):
                assert name not in seen, f"{name}: {path} and {seen[name]}"
                seen[name] = path


def test_few_modules_are_long():
    lengths = {path: _facts(path).lines for path in _modules("armimpedance")}
    long = [path.name for path, lines in lengths.items() if lines > 400]
    assert len(long) <= 10, long
    assert max(lengths.values()) <= 500


def test_the_estimate_loads_no_plots_or_solvers_and_every_name_on_a_face_is_there():
    # in one fresh process: first what the estimate loads, then all rooms
    code = (
        "import importlib, sys\n"
        "for module in ('checks', 'estimation'):\n"
        "    importlib.import_module(f'armimpedance.hand.still.{module}')\n"
        "    assert not {'matplotlib', 'cvxpy', 'pinocchio'} & set(sys.modules), module\n"
        f"for room, names in {FACES!r}.items():\n"
        "    face = importlib.import_module(room)\n"
        "    assert set(face.__all__) == names, room\n"
        "    for name in sorted(names):\n"
        "        assert type(getattr(face, name)).__name__ != 'module', (room, name)\n"
        "    # once more, now that every module of the room is loaded: none hides a name\n"
        "    for name in sorted(names):\n"
        "        assert type(getattr(face, name)).__name__ != 'module', (room, name)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_faces_stay_small():
    # the whole has a verb a topic and what the verbs give back, `plots` a picture for each; any
    # other room that needs more names than this is two rooms
    most = {"joint.therapy": 40, "numerics.signals": 40, "muscles.models": 40}
    for room, names in FACES.items():
        if room.startswith("armimpedance"):
            assert len(names) <= most.get(room.removeprefix("armimpedance."), 36), room


def _graph() -> dict[str, set[str]]:
    """Module -> modules that it imports anywhere, names on faces followed to where they live."""
    homes = {}
    for stub in _stubs():
        room = ".".join(stub.parent.relative_to(ROOT).parts)
        for node in ast.walk(ast.parse(stub.read_text())):
            if isinstance(node, ast.ImportFrom):
                homes |= {(room, alias.name): f"{room}.{node.module}" for alias in node.names}
    files = {
        ".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): p
        for place in ("armimpedance", "manipulandum_sim")
        for p in _modules(place)
    }
    graph: dict[str, set[str]] = {}
    for module, path in files.items():
        graph[module] = set()
        for target, name in _facts(path).named:
            for found in (homes.get((target, name)), f"{target}.{name}", target):
                if found in files:
                    graph[module].add(found)
                    break
        graph[module] -= {module}
    return graph


def test_no_module_imports_itself_by_way_of_others():
    graph, seen, way = _graph(), set(), []

    def visit(module):
        if module in way:
            raise AssertionError(" -> ".join([*way[way.index(module) :], module]))
        if module in seen:
            return
        way.append(module)
        for target in sorted(graph[module]):
            visit(target)
        way.pop()
        seen.add(module)

    for module in sorted(graph):
        visit(module)


@pytest.mark.parametrize("place", ["armimpedance", "manipulandum_sim", "figures", "benchmarks"])
def test_no_folder_is_a_crowd(place):
    for folder in {path.parent for path in _modules(place)}:
        modules = [p for p in folder.glob("*.py") if p.name != "__init__.py"]
        # a command is a module, and a verb is
        limit = {"benchmarks": 25}.get(folder.name, 20)
        assert len(modules) <= limit, f"{folder.relative_to(ROOT)} has {len(modules)} modules"


def test_every_folder_is_installed():
    listed = set(
        tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    )
    # of a package that is installed without its source the folders are where it is installed
    roots = {
        name: Path(str(find_spec(name).origin)).parent
        for name in ("armimpedance", "manipulandum_sim")
    }
    roots["armimpedance_figures"] = ROOT / "figures"
    folders = {
        ".".join((name, *init.parent.relative_to(root).parts))
        for name, root in roots.items()
        for init in root.glob("**/__init__.py")
    }
    assert listed == folders
