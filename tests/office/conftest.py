"""Results that people open in a spreadsheet and in Octave, and what these programs say of them."""

from __future__ import annotations

import csv
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import armimpedance as ai
from manipulandum_sim.hand import simulate

#: Names of conditions that a spreadsheet must not run, or might change.
NAMES = ("=1+1", "-2+3", "@SUM(1;2)", "007", "1e5", "'quoted", 'semi;colon, "comma"', "tab\there")


@pytest.fixture(scope="session")
def hand():
    """Estimates of groups with hostile names."""
    recording, _ = simulate(
        "cocontraction", seed=5, sets=len(NAMES), conditions=["cocontraction_10"]
    )
    blocks = np.arange(recording.n_trials) * len(NAMES) // recording.n_trials
    condition = np.array(NAMES, dtype=object)[blocks]
    return ai.estimate(replace(recording, trials=recording.trials.assign(condition=condition)))


@pytest.fixture(scope="session")
def in_calc(tmp_path_factory):
    """Open a workbook in LibreOffice: every sheet's cells, as the program itself writes them."""
    profile = tmp_path_factory.mktemp("profile").as_uri()

    def opened(path):
        folder = tmp_path_factory.mktemp("calc")
        # comma, quote, UTF-8, from line 1, quoted texts, numbers as stored, every sheet
        options = "csv:Text - txt - csv (StarCalc):44,34,76,1,,0,true,false,false,false,false,-1"
        call = [
            "soffice",
            f"-env:UserInstallation={profile}",
            "--headless",
            "--convert-to",
            options,
        ]
        subprocess.run(
            [*call, "--outdir", folder, path], check=True, capture_output=True, timeout=180
        )
        return {
            file.stem.removeprefix(f"{path.stem}-"): list(
                csv.reader(file.read_text("utf-8").splitlines())
            )
            for file in folder.glob("*.csv")
        }

    return opened


@pytest.fixture(scope="session")
def in_octave():
    """Run lines in Octave; what it prints."""

    def ran(folder, *lines):
        call = ["octave-cli", "--norc", "--quiet", "--eval", "\n".join(lines)]
        done = subprocess.run(call, cwd=folder, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return ran
