"""`armimpedance estimate --method all` and the names of methods on the command line."""

import re

import numpy as np
import pandas as pd
import pytest

from armimpedance.__main__ import main
from armimpedance.core.records import Subject
from armimpedance.hand.show import read_results
from armimpedance.hand.still.methods import METHODS
from armimpedance.recordings.tables.folder import read_folder, write_folder


@pytest.fixture(scope="module")
def session(limb, tmp_path_factory):
    folder = tmp_path_factory.mktemp("methods") / "session"
    person = Subject("S", 65.0, 1.70, 0.30, 0.34)
    recording = limb.record(sets=2, force_noise=0.02, shoulder_m=np.zeros(2), subject=person)
    moved = recording.with_step("moved into reach", position=recording.position - [0.4, -0.1])
    write_folder(moved, folder)
    return folder


def test_all_methods_are_printed_written_and_mapped(session, tmp_path, capsys):
    out, joint = tmp_path / "all.csv", tmp_path / "joint.csv"
    assert main(["estimate", str(session), "--method", "all", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "Stiffness K (N/m)" in printed
    for name in METHODS:
        assert re.search(rf"^{name} +\d", printed, flags=re.M), name
    assert pd.read_csv(out)["method"].tolist() == list(METHODS)
    assert [e.method for e in read_results(out)] == list(METHODS)
    call = ["map", str(out), "--recording", str(session), "--to", "joint", "--out", str(joint)]
    assert main(call) == 0
    assert len(read_results(joint)) == len(METHODS)


def test_the_default_of_the_command_is_that_of_the_library(session, tmp_path, capsys):
    out = tmp_path / "one.csv"
    assert main(["estimate", str(session), "--out", str(out)]) == 0
    assert pd.read_csv(out)["method"].tolist() == [METHODS.default]


def test_help_names_every_method(capsys):
    with pytest.raises(SystemExit):
        main(["estimate", "--help"])
    printed = capsys.readouterr().out
    assert all(name in printed for name in METHODS)
    assert f"{METHODS.default} (default)" in " ".join(printed.split())


def test_commanded_motion_survives_the_disk_and_serves_as_instrument(limb, tmp_path, capsys):
    recording = limb.record(sets=1, force_noise=0.02)
    told = {"x_command_m": recording.position[:, 0], "y_command_m": recording.position[:, 1]}
    folder = tmp_path / "told"
    write_folder(recording.with_step("commands", extra=told), folder)
    assert set(read_folder(folder).extra) == set(told)
    out = tmp_path / "told.csv"
    call = ["estimate", str(folder), "--method", "instruments", "--out", str(out)]
    assert main(call) == 0
    assert "the commanded motion" in pd.read_csv(out)["provenance"][0]
