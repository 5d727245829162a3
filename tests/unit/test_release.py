"""What stands in several places of the build says the same in all of them."""

import re
import tomllib
from importlib.metadata import version
from pathlib import Path

import armimpedance

ROOT = Path(__file__).resolve().parents[2]
#: Names in the recipe that are not those of the wheel's metadata.
ELSEWHERE = {"pin": "pinocchio", "matplotlib": "matplotlib-base", "cvxpy": "cvxpy-base"}


def test_the_version_is_one():
    assert version("armimpedance") == armimpedance.__version__
    cited = re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert cited is not None
    assert cited[1] == armimpedance.__version__
    assert f"## {armimpedance.__version__} " in (ROOT / "CHANGELOG.md").read_text()


def test_the_recipe_wants_what_the_wheel_wants():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    # conda has no extras: its package brings the usual ones
    extras = project["optional-dependencies"]
    (usual,) = extras["usual"]
    brought = [one for name in usual[len("armimpedance[") : -1].split(",") for one in extras[name]]
    wanted = [*project["dependencies"], *brought]
    wheel = {tuple(re.split(r"(?=>=)", one.split(";")[0])) for one in wanted}
    recipe = (ROOT / "release" / "conda" / "meta.yaml").read_text()
    run = recipe.split("  run:\n")[1].split("\n\n")[0]
    found = set(re.findall(r"- (\S+) (>=\S+)", run))
    asked = {(ELSEWHERE.get(name, name), bound) for name, bound in wheel}
    assert found == asked | {("python", project["requires-python"])}
