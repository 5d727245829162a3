"""An installation of the core alone does everything that does not need more, and says what does."""

import json
import os
import subprocess
import sys

import pytest
from sessions import swing

from armimpedance.recordings import write_recording

#: What the extras bring, and what those need.
EXTRAS = (
    "altair",
    "cvxpy",
    "pinocchio",
    "numba",
    "h5py",
    "openpyxl",
    "xarray",
    "marimo",
)
BLOCK = f"""
import sys
class Gone:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {EXTRAS!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name.partition(".")[0])
sys.meta_path.insert(0, Gone())
"""
#: Each argument is a command; what each comes to, and what it says on standard error.
COMMANDS = """
import contextlib, io, json, sys
from armimpedance.__main__ import main
found = []
for line in sys.argv[1:]:
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        status = main(line.split())
    found.append([status, said.getvalue()])
print(json.dumps(found))
"""
#: What the core alone makes: recordings and results of joints.
MADE = (
    "simulate postures --grid -0.2 0.1 3 0.3 0.5 2 --sets 1 --noise none --out s",
    "estimate s --out hand.csv",
    "map hand.csv --recording s --to joint --out joint.csv",
    "compare hand.csv --out differences.csv --figure postures.png",
    "fit moment-arms joint.csv --order 1 --model polynomial --out posture.json",
)
#: What it does not, and the extra that does.
MISSING = {
    "report s --out page.html": "report",
    "fit moment-arms joint.csv --order 2 --out p.json": "models",
    "passive swing --out p.json": "bodies",
}


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("core")


@pytest.fixture(scope="module")
def told(place):
    """Status and complaint of every command, all in one process without the extras."""
    (place / "bare").mkdir()
    (place / "bare" / "sitecustomize.py").write_text(BLOCK)
    write_recording(swing(), place / "swing")
    path = os.pathsep.join([str(place / "bare"), os.environ.get("PYTHONPATH", "")])
    lines = [*MADE, *MISSING]
    done = subprocess.run(
        [sys.executable, "-c", COMMANDS, *lines],
        cwd=place,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return dict(zip(lines, json.loads(done.stdout), strict=True))


def test_the_core_estimates_maps_compares_draws_and_fits(told, place):
    assert {line: told[line][0] for line in MADE} == dict.fromkeys(MADE, 0), told
    for name in ("hand.csv", "differences.csv", "postures.png", "posture.json"):
        assert (place / name).stat().st_size > 100


@pytest.mark.parametrize(("line", "extra"), MISSING.items())
def test_what_is_missing_is_one_line_with_what_to_install(told, place, line, extra):
    status, said = told[line]
    assert status not in (0, None)
    assert f"armimpedance[{extra}]" in said
    assert len(said.strip().splitlines()) == 1
    assert not [*place.glob("p.json"), *place.glob("page*")]
