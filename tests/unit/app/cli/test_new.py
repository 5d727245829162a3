"""Example folders run at once, as a newcomer runs them; every door opens on one session."""

from __future__ import annotations

import json
import runpy
from dataclasses import replace

import nbformat
import numpy as np
import pytest

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.core.errors import InputError
from armimpedance.lab.lab_forms import FORMS, form_for
from armimpedance.lab.parts.simulation import Simulated, write_as
from armimpedance.lab.parts.starter import NOTEBOOK, SCRIPT, STARTERS
from manipulandum_sim.hand import simulate

pytestmark = pytest.mark.study


@pytest.mark.parametrize("lab", STARTERS)
def test_commands_script_and_notebook_of_a_starter(lab, tmp_path, monkeypatch, capsys):
    folder = tmp_path / "try it"
    assert main(["new", "--for", lab, str(folder)]) == 0
    starter = STARTERS[lab]
    assert sorted(p.name for p in folder.iterdir()) == sorted(starter.names)
    monkeypatch.chdir(folder)
    readme = (folder / "README.md").read_text()
    for _, command in starter.commands:
        assert command in readme
        assert main(command.split()[1:]) == 0, command
        assert capsys.readouterr().err == ""
    runpy.run_path(SCRIPT)
    book = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(book)
    codes = [cell.source for cell in book.cells if cell.cell_type == "code"]
    assert len(codes) == len(starter.cells)
    assert all(code in (folder / SCRIPT).read_text() for code in codes)
    made = {p.name for p in folder.iterdir()}
    assert len(made) > len(starter.names)


def test_the_notebook_of_a_starter_runs(tmp_path):
    from nbclient import NotebookClient

    assert main(["new", "--for", "kinarm", str(tmp_path / "a")]) == 0
    book = nbformat.read(tmp_path / "a" / NOTEBOOK, as_version=4)
    done = NotebookClient(book, resources={"metadata": {"path": tmp_path / "a"}}).execute()
    printed = "".join(o.get("text", "") for c in done.cells for o in c.get("outputs", []))
    assert "cocontraction_30" in printed
    assert (tmp_path / "a" / "report.html").exists()


def test_a_folder_with_something_else_is_not_touched(tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("mine")
    for more in ([], ["--replace"]):
        assert main(["new", "--for", "kinarm", str(tmp_path), *more]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]


@pytest.fixture(scope="module")
def session():
    """A session whose numbers single precision holds, as a Kinarm's files do."""
    recording, truth = simulate(
        "cocontraction", seed=3, sets=1, conditions=["cocontraction_00", "cocontraction_20"]
    )
    single = {n: np.float32(getattr(recording, n)).astype(float) for n in ("position", "force")}
    return replace(recording, **single, joint_angles=None), truth


@pytest.fixture(scope="module")
def expected(session):
    return ai.estimate(session[0])


DOUBLES = ("csv", "parquet", "matlab", "vbot", "mcap", "bids")


@pytest.mark.parametrize("name", DOUBLES)
def test_a_form_that_keeps_doubles_gives_the_same_estimates_to_the_last_bit(
    name, session, expected, tmp_path
):
    recording, truth = session
    place = write_as(name, Simulated(recording, truth), tmp_path / "lab")
    hand = ai.estimate(ai.read(place))
    assert [e.keys for e in hand] == [e.keys for e in expected]
    for ours, theirs in zip(hand, expected, strict=True):
        np.testing.assert_array_equal(ours.stiffness, theirs.stiffness)
        np.testing.assert_array_equal(ours.viscosity, theirs.viscosity)
        np.testing.assert_array_equal(ours.inertia, theirs.inertia)
        np.testing.assert_array_equal(ours.covariance, theirs.covariance)
        np.testing.assert_array_equal(ours.activation, theirs.activation)


def test_both_forms_of_a_kinarm_exam_give_the_same_and_within_single_precision(
    session, expected, tmp_path
):
    recording, truth = session
    events = {"onset_event": "PERTURB_ON", "end_event": "PERTURB_OFF"}
    both = []
    for name in ("kinarm", "kinarm-c3d"):
        place = write_as(name, Simulated(recording, truth), tmp_path / name)
        both.append(ai.estimate(ai.read(place, **events)))
    for one, other, theirs in zip(*both, expected, strict=True):
        np.testing.assert_array_equal(one.stiffness, other.stiffness)
        np.testing.assert_array_equal(one.covariance, other.covariance)
        assert one.keys == other.keys
        assert one.keys["condition"] == theirs.keys["condition"]
        # The position comes back from link angles in single precision: the encoder's grid cannot
        # be seen any more, which weighs the samples a little differently.
        error = np.sqrt(np.diag(theirs.covariance))[-4:].reshape(2, 2)
        assert np.abs((one.stiffness - theirs.stiffness) / error).max() < 0.25


def test_a_form_that_cannot_hold_a_recording_is_refused(session):
    with pytest.raises(InputError, match="kinarm"):
        form_for("trc", session[0])


def test_every_form_has_a_line_and_names_its_files():
    for name, form in FORMS.items():
        assert form.line, name
        assert form.names, name
        assert set(form.holds) <= {"hand", "joint", "markers", "motion"}


def test_simulate_writes_a_lab_s_files_beside_their_truth(tmp_path, capsys):
    words = ["simulate", "cocontraction", "--sets", "1", "--as", "kinarm", "--out"]
    assert main([*words, str(tmp_path / "lab")]) == 0
    assert sorted(p.name for p in (tmp_path / "lab").iterdir()) == ["exam.kinarm", "truth.json"]
    json.loads((tmp_path / "lab" / "truth.json").read_text())
    assert main([*words, str(tmp_path / "lab")]) == 2
    assert main([*words, str(tmp_path / "lab"), "--replace"]) == 0
    assert "Traceback" not in capsys.readouterr().err
