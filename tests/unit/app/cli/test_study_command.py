"""`study` as a person calls it: her own commands, folders of any names, one that fails."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest
from sessions import pushes

from armimpedance.__main__ import main
from armimpedance.recordings import write_recording

DESIGN = """
steps = ["estimate {recording} --method exact --out hand.csv",
         "map hand.csv --recording {recording} --to joint --out joint.csv"]
group_steps = ["compare hand.csv --by condition --subjects participant --out conditions.csv"]
"""


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    """Three people with a recording each, and one who has none."""
    folder = tmp_path_factory.mktemp("study") / "data"
    for seed in (1, 2, 3):
        place = folder / f"sub-{seed}"
        place.mkdir(parents=True)
        # no two people are the same
        one = replace(pushes(1), force=(1 + seed / 100) * pushes(1).force)
        write_recording(one, place / "hand")
    (folder / "sub-4").mkdir()
    (folder / "sub-4/notes.txt").write_text("did not come")
    (folder / "study.toml").write_text(DESIGN)
    (folder / "participants.tsv").write_text("participant_id\tage\nsub-1\t30\nsub-3\t41\n")
    return folder


def table(file: Path) -> list[dict[str, str]]:
    with open(file, newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.study
def test_a_study_from_folders_to_one_table(data, tmp_path, capsys):
    out = tmp_path / "out"
    call = ["study", str(data), str(out)]
    assert main([*call, "participant", "--workers", "2"]) == 3
    assert "no recording" in capsys.readouterr().out
    # What a person would have typed for one of them gives the same bytes.
    by_hand = tmp_path / "hand.csv"
    words = ["estimate", str(data / "sub-2/hand"), "--method", "exact", "--out", str(by_hand)]
    assert main(words) == 0
    assert (out / "sub-2/ses-hand/hand.csv").read_bytes() == by_hand.read_bytes()
    capsys.readouterr()
    assert main([*call, "participant", "--resume"]) == 3
    assert " 0 run," in capsys.readouterr().out
    assert main([*call, "group"]) == 3
    rows = table(out / "group/hand.csv")
    assert [row["participant"] for row in rows] == ["1"] * 2 + ["2"] * 2 + ["3"] * 2
    assert {row["participant"]: row["age"] for row in rows} == {"1": "30", "2": "", "3": "41"}
    assert table(out / "group/conditions.csv")
    assert (out / "group/index.html").is_file()
    states = {row["participant"]: row["state"] for row in table(out / "group/sessions.csv")}
    assert states == {"1": "done", "2": "done", "3": "done", "4": "failed"}


@pytest.mark.parametrize(
    "wrong",
    [
        ["participant", "--participant-label", "9"],
        ["participant", "--resume"],
        ["participant", "--workers", "0"],
        ["participant", "--task-index", "0"],
        ["participant", "--scheduler", "nowhere"],
        ["group"],
        ["group", "--workers", "2"],
        ["slurm-script"],
    ],
)
def test_a_wrong_call_is_one_line_and_makes_nothing(data, tmp_path, capsys, wrong):
    out = tmp_path / "out"
    assert main(["study", str(data), str(out), *wrong]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not (out / "group").exists()


def test_results_never_lie_among_the_data_but_in_derivatives(data, tmp_path, capsys):
    for place in (data, data / "out", data.parent):
        assert main(["study", str(data), str(place), "participant", "--dry-run"]) == 2
    inside = data / "derivatives/armimpedance"
    assert main(["study", str(data), str(inside), "participant", "--dry-run"]) == 0
    assert not inside.exists()
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.txt").write_text("mine")
    assert main(["study", str(data), str(other), "participant"]) == 2
    assert [path.name for path in other.iterdir()] == ["thesis.txt"]
