"""What one file adds is everywhere: a number of a result in every form, an option at every door.

That labelled arrays hold all of a table is shown in `test_results.py`.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from sessions import swing

from armimpedance.recordings import write_recording

ROOT = Path(__file__).resolve().parents[2]

#: File of the package -> (what stands there, what a person adds before it).
ADDED = {
    # a number: one line among the topic's equations
    "joint/relaxed/equations.py": (
        (
            "}\nUNITS: Final",
            """"lag": Derived(Meaning("time constant", "s"), lambda p: p["h"] / p["k"])""",
        ),
    ),
    # an option: all in the file of its verb
    "joint/relaxed/show/verb.py": (
        (
            "        LONGEST_GAP,\n",
            '        Option("least_k", Number(unit="N m/rad", low=0), "new"),\n',
        ),
        ("    longest_gap_s: float | None = None,\n", "    least_k: float | None = None,\n"),
        ("    reading = PassiveReading(", "    SEEN.append(least_k)\n"),
        ("PASSIVE: Final = Verb(\n", "SEEN: list[object] = []\n"),
    ),
}

EVERYWHERE = """
import contextlib, io, json, sys
from pathlib import Path
import openpyxl, pandas as pd, scipy.io
sys.path.insert(0, sys.argv[1])
from armimpedance.app.cli.main import run
from armimpedance.core.errors import InputError
from armimpedance.core.shown import html_table
from armimpedance.joint.relaxed.show import verb
from armimpedance.joint.relaxed.show.text import passive_text
from armimpedance.show.pages import parameter_table
from column_pages import column_pages
from help_pages import command_pages

# the option: help, docstring and page, a refusal at both doors, and what the analysis is told
help = io.StringIO()
with contextlib.redirect_stdout(help), contextlib.suppress(SystemExit):
    run(["passive", "--help"])
assert "--least-k N M/RAD" in help.getvalue(), help.getvalue()
assert "least_k : float (N m/rad), optional" in verb.passive.__doc__
assert "``--least-k``" in command_pages()["reference/commands/passive"]
assert run(["passive", "swing", "--least-k", "-1"]) == 2
try:
    verb.passive("swing", least_k=-1)
except InputError as error:
    assert "least_k -1" in str(error)
else:
    raise AssertionError
assert verb.PASSIVE.differing({"least_k": 2.5}) == ("Options of `passive`: least_k 2.5",)
asked = ["--least-k", "2.5", "--rest-angle", "1.5", "--method", "ls", "--out", "fit.xlsx"]
assert run(["passive", "swing", *asked]) == 0
assert verb.SEEN == [2.5], verb.SEEN
cells = [cell for row in openpyxl.load_workbook("fit.xlsx")["methods"].values for cell in row]
assert "least k" in cells, cells

# the number: every file, every text and the page of columns
fits = verb.passive("swing", rest_angle=1.5, method="ls")
by_name = {one.name: one for one in fits.summary.parameters}
assert list(by_name) == ["k", "h", "f", "lag"]
lag = by_name["lag"]
assert abs(lag.value - by_name["h"].value / by_name["k"].value) < 1e-12 and 0 < lag.sd < 1
for ending in ("csv", "json", "xlsx", "mat"):
    fits.write(f"r.{ending}")
fits.write("long.csv", long=True)
[row] = pd.read_csv("long.csv").query("quantity == 'lag'").to_dict("records")
assert (row["name"], row["unit"]) == ("time constant", "s") and row["lower"] < row["upper"]
assert "lag" in list(pd.read_csv("r.csv")["parameter"])
assert json.loads(Path("r.json").read_text())["parameters"][-1]["name"] == "lag"
assert any("lag" in map(str, row) for row in openpyxl.load_workbook("r.xlsx")["results"].values)
assert "lag" in repr(scipy.io.loadmat("r.mat", simplify_cells=True)["results"]["parameters"])
for text in (passive_text(fits), repr(fits), fits._repr_html_(), repr(fits.to_frame())):
    assert "lag" in text
page = parameter_table(fits.summary.parameters)
assert any("lag" in row[0] for row in page.rows)
assert html_table([page.columns, *page.rows]) in fits._repr_html_()
assert "time constant" in column_pages()["reference/columns"]
"""


@pytest.mark.skipif(not (ROOT / "docs/_site").exists(), reason="the source is not beside")
def test_a_number_and_an_option_that_one_file_adds_are_everywhere(tmp_path):
    shutil.copytree(ROOT / "armimpedance", tmp_path / "armimpedance")
    for file, changes in ADDED.items():
        path = tmp_path / "armimpedance" / file
        text = path.read_text()
        for before, line in changes:
            assert text.count(before) == 1, before
            text = text.replace(before, line + before)
        path.write_text(text)
    write_recording(swing(), tmp_path / "swing")
    done = subprocess.run(
        [sys.executable, "-c", EVERYWHERE, str(ROOT / "docs/_site")],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{ROOT}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
