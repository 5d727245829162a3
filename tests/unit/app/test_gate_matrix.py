"""A STOP stops: every check's failing recording, through every command that takes it."""

from __future__ import annotations

from pathlib import Path

import pytest
from gate_matrix import (
    COMMANDS,
    GOES_ON,
    PRINTED,
    REFUSED,
    WARNED,
    failing,
    outcome,
    sound,
    table,
    table_of_others,
)

from armimpedance.recordings import write_recording

PAGE = Path(__file__).resolve().parents[3] / "docs/evidence/gate.md"


@pytest.fixture(scope="module")
def recordings():
    return failing(sound())


@pytest.mark.skipif(not PAGE.exists(), reason="the source is not beside")
def test_the_matrix_is_that_of_the_docs_and_no_cell_goes_on(tmp_path):
    made = table(tmp_path)
    assert made in PAGE.read_text(encoding="utf-8"), "python tests/unit/app/gate_matrix.py"
    cells = {cell for line in made.splitlines()[2:] for cell in line.strip("| ").split(" | ")[2:]}
    assert cells == {REFUSED, PRINTED}


@pytest.mark.skipif(not PAGE.exists(), reason="the source is not beside")
def test_other_experiments_refuse_what_no_limb_is(tmp_path):
    made = table_of_others(tmp_path)
    assert made in PAGE.read_text(encoding="utf-8"), "python tests/unit/app/gate_matrix.py"
    cells = {cell for line in made.splitlines()[2:] for cell in line.strip("| ").split(" | ")[1:]}
    assert cells == {REFUSED, WARNED, "-"}


@pytest.mark.first_cases(2)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_sound_recording_passes(command, tmp_path):
    write_recording(sound(), tmp_path / "session")
    assert outcome(command, "units", tmp_path / "session", tmp_path) == GOES_ON


@pytest.mark.parametrize("check", ["units", "force sign", "axes", "copies"])
def test_despite_overrules_one_check_and_no_other(check, recordings, tmp_path):
    write_recording(recordings[check][1], tmp_path / "session")
    other = "axes" if check == "units" else "units"
    estimate = COMMANDS[1]
    assert outcome(estimate, check, tmp_path / "session", tmp_path, "--despite", other) == REFUSED
    overruled = outcome(estimate, check, tmp_path / "session", tmp_path, "--despite", check)
    assert overruled == GOES_ON
    assert f"despite {check}" in (tmp_path / "estimate.csv").read_text(encoding="utf-8")
