"""An installation of the core alone does everything that does not need more, and says what does."""

import os
import subprocess
import sys

import pytest

from armimpedance.recordings import write_recording
from manipulandum_sim.passive import simulate_passive

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
COMMANDS = """
import sys
from armimpedance.__main__ import main
for line in sys.argv[1:]:
    if status := main(line.split()):
        sys.exit(status)
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("core")


@pytest.fixture(scope="module")
def call(place):
    (place / "bare").mkdir()
    (place / "bare" / "sitecustomize.py").write_text(BLOCK)
    path = os.pathsep.join([str(place / "bare"), os.environ.get("PYTHONPATH", "")])

    def run(*lines):
        """Each line is a command; they share a process, which a failure ends."""
        command = [sys.executable, "-c", COMMANDS, *lines]
        env = {**os.environ, "PYTHONPATH": path}
        return subprocess.run(command, cwd=place, env=env, capture_output=True, text=True)

    return run


@pytest.fixture(scope="module")
def session(call, place):
    """Recordings and results of joints, which the core alone makes."""
    done = call(
        "simulate postures --grid -0.2 0.1 4 0.3 0.5 3 --sets 1 --noise none --out s",
        "estimate s --out hand.csv --figure hand.png",
        "map hand.csv --recording s --to joint --out joint.csv",
        "compare hand.csv --out differences.csv --figure postures.png",
        "fit moment-arms joint.csv --order 1 --model polynomial --out posture.json",
    )
    assert done.returncode == 0, done.stderr
    write_recording(simulate_passive("p5", duration_s=1.0)[0], place / "swing")


@pytest.mark.usefixtures("session")
def test_the_core_estimates_maps_compares_draws_and_fits(place):
    for name in ("hand.csv", "hand.png", "differences.csv", "postures.png", "posture.json"):
        assert (place / name).stat().st_size > 100


@pytest.mark.usefixtures("session")
@pytest.mark.parametrize(
    ("line", "extra"),
    [
        ("report s --out page.html", "report"),
        ("fit moment-arms joint.csv --order 2 --out p.json", "models"),
        ("passive swing --out p.json", "bodies"),
    ],
)
def test_what_is_missing_is_one_line_with_what_to_install(call, place, line, extra):
    done = call(line)
    assert done.returncode != 0
    assert f"armimpedance[{extra}]" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not [*place.glob("p.json"), *place.glob("page*")]
