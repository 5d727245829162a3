"""A STOP stops: every check's failing recording, through every command that takes it."""

from __future__ import annotations

from pathlib import Path

import pytest
from gate_matrix import (
    COMMANDS,
    GOES_ON,
    OTHERS,
    PRINTED,
    REFUSED,
    WARNED,
    WRONG,
    ends,
    failing,
    name_of,
    outcome,
    table,
    table_of_others,
)
from sessions import pushes

from armimpedance.recordings import write_recording
from manipulandum_sim.random_hand import simulate_random

RANDOM, _, ELBOW = OTHERS
PAGE = Path(__file__).resolve().parents[3] / "docs/evidence/gate.md"


@pytest.fixture(scope="module")
def sound():
    return pushes(sets=1)


@pytest.fixture(scope="module")
def recordings(sound):
    return failing(sound)


#: (row, column) of tables of the page -> what stands there.
CELLS: dict[tuple[str, str], str] = {}
if PAGE.exists():
    heads: list[str] = []
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        row = [cell.strip(" `") for cell in line.strip("|").split("|")]
        if not line.startswith("|"):
            heads = []
        elif not heads:
            heads = row
        else:
            CELLS |= {(row[0], head): cell for head, cell in zip(heads, row, strict=True)}


@pytest.mark.study
@pytest.mark.skipif(not PAGE.exists(), reason="the source is not beside")
def test_the_matrix_is_that_of_the_docs_and_no_cell_goes_on(sound, tmp_path):
    made = table(tmp_path, sound)
    assert made in PAGE.read_text(encoding="utf-8"), "python tests/unit/app/gate_matrix.py"
    cells = {cell for line in made.splitlines()[2:] for cell in line.strip("| ").split(" | ")[2:]}
    assert cells == {REFUSED, PRINTED}


# A diagonal of the matrix: every check stops a command, and every command is stopped by a check.
@pytest.mark.skipif(not PAGE.exists(), reason="the source is not beside")
@pytest.mark.parametrize(
    ("check", "command"),
    list(
        zip(
            ["units", "reach", "force sign", "axes", "disturbance", "directions", "copies"],
            COMMANDS,
            strict=True,
        )
    ),
)
def test_a_recording_that_fails_a_check_is_stopped_as_the_docs_say(
    check, command, recordings, tmp_path
):
    write_recording(recordings[check][1], tmp_path / "session")
    found = outcome(command, check, tmp_path / "session", tmp_path)
    assert found in (REFUSED, PRINTED)
    assert found == CELLS[check, name_of(command)]


@pytest.mark.study
@pytest.mark.skipif(not PAGE.exists(), reason="the source is not beside")
def test_the_matrix_of_other_experiments_is_that_of_the_docs(tmp_path):
    made = table_of_others(tmp_path)
    assert made in PAGE.read_text(encoding="utf-8"), "python tests/unit/app/gate_matrix.py"
    cells = {cell for line in made.splitlines()[2:] for cell in line.strip("| ").split(" | ")[1:]}
    assert cells == {REFUSED, WARNED, "-"}


# Each damage that shows in a few seconds. Exchanged axes take more of them.
@pytest.mark.parametrize(
    ("command", "make", "wrongs"),
    [
        (ELBOW, OTHERS[ELBOW], ["force of the device", "position in mm, or degrees"]),
        (
            RANDOM,
            lambda: simulate_random(seed=1, trials=4, duration_s=2.0)[0],
            ["force in mN", "position in mm, or degrees"],
        ),
    ],
    ids=["elbow", "random"],
)
def test_another_experiment_refuses_what_no_limb_is(command, make, wrongs, tmp_path):
    recording = make()
    for wrong in wrongs:
        assert ends(tmp_path / wrong, command, WRONG[wrong](recording)) in (REFUSED, WARNED)


@pytest.mark.first_cases(2)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_sound_recording_passes(command, sound, tmp_path):
    write_recording(sound, tmp_path / "session")
    assert outcome(command, "units", tmp_path / "session", tmp_path) == GOES_ON


@pytest.mark.first_cases(2)
@pytest.mark.parametrize("check", ["units", "copies", "force sign", "axes"])
def test_despite_overrules_one_check_and_no_other(check, recordings, tmp_path):
    write_recording(recordings[check][1], tmp_path / "session")
    other = "axes" if check == "units" else "units"
    estimate = COMMANDS[1]
    assert outcome(estimate, check, tmp_path / "session", tmp_path, "--despite", other) == REFUSED
    overruled = outcome(estimate, check, tmp_path / "session", tmp_path, "--despite", check)
    assert overruled == GOES_ON
    assert f"despite {check}" in (tmp_path / "estimate.csv").read_text(encoding="utf-8")
