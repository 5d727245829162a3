"""The import order of the rooms, and a start that imports nothing heavy."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

#: From top to bottom; a room may import rooms of lower rank only, and itself.
RANKS = [
    {"__main__"},
    {"cli"},
    {"plots", "report"},
    {"files"},
    {"therapy"},
    {"body"},
    {"muscles", "passive", "elbow"},
    {"comparison", "planning"},
    {"levels", "ellipses"},
    {"impedance"},
    {"regression", "recordings", "mocap"},
    {"signals", "arm"},
    {"plain"},
    {"motion"},
    {"skeleton"},
    {"records"},
    {"arrays"},
    {"outputs"},
    {"conventions", "errors"},
]
RANK = {room: rank for rank, rooms in enumerate(RANKS) for room in rooms}

#: Module that a test of laziness looks for -> where it may be imported, and only inside functions.
HEAVY = {
    "matplotlib": {"plots", "report"},
    "cvxpy": {"body", "levels", "muscles", "passive", "regression"},
}


def _modules(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def _imports(path: Path) -> list[tuple[str, bool]]:
    """Imported module names of a file, and whether at module level (outside TYPE_CHECKING)."""
    tree = ast.parse(path.read_text())
    top = {id(node) for node in tree.body}
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(alias.name, id(node) in top) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            found.append((node.module, id(node) in top))
    return found


def _room(module: str) -> str | None:
    parts = module.split(".")
    return parts[1] if parts[0] == "armimpedance" and len(parts) > 1 else None


@pytest.mark.parametrize(
    "path", _modules("armimpedance"), ids=lambda p: str(p.relative_to(ROOT / "armimpedance"))
)
def test_rooms_import_downwards_only(path):
    relative = path.relative_to(ROOT / "armimpedance")
    room = relative.parts[0].removesuffix(".py")
    if room == "__init__":
        assert _imports(path) == []
        return
    assert room in RANK, f"{room} has no place in the import order"
    for module, at_top in _imports(path):
        target = _room(module)
        if target is not None and target != room:
            assert RANK[target] > RANK[room], f"{relative} imports {module}"
        heavy = module.split(".")[0]
        if heavy in HEAVY:
            assert room in HEAVY[heavy], f"{relative} imports {module}"
            assert not at_top, f"{relative} imports {module} at module level"
        if heavy in ("manipulandum_sim", "armimpedance_figures"):
            assert room == "cli", f"{relative} imports {module}"


@pytest.mark.parametrize(
    "path", _modules("manipulandum_sim"), ids=lambda p: str(p.relative_to(ROOT))
)
def test_the_simulator_shares_no_dynamics_with_the_analysis(path):
    allowed = {"arrays", "records", "motion", "skeleton", "conventions", "errors", "outputs"}
    rooms = {_room(module) for module, _ in _imports(path)} - {None}
    assert rooms <= allowed, f"{path.name} imports {rooms - allowed}"


@pytest.mark.parametrize(
    "arguments", [["--help"], ["estimate", "--help"], ["therapy", "robot", "--help"], ["--version"]]
)
def test_help_imports_nothing_heavy(arguments):
    code = (
        "import sys\n"
        "from armimpedance.__main__ import main\n"
        "try:\n"
        f"    main({arguments!r})\n"
        "except SystemExit as end:\n"
        "    assert not end.code\n"
        "heavy = {'numpy', 'scipy', 'pandas', 'matplotlib', 'pinocchio', 'cvxpy', 'pyarrow'}\n"
        "loaded = heavy & set(sys.modules)\n"
        "assert not loaded, loaded\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("module", ["estimation", "reflex.delay"])
def test_importing_the_estimate_does_not_import_plotting_or_solvers(module):
    code = (
        f"import sys, armimpedance.impedance.{module}\n"
        "assert not {'matplotlib', 'cvxpy', 'pinocchio'} & set(sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
