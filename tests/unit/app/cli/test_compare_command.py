"""`armimpedance compare`: recordings and results to differences, and refusals in one line."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.app.cli.main import run as main
from armimpedance.core.records import Subject
from armimpedance.recordings.tables.folder import write_folder

STIFFER = 1.3


def two_conditions(limb, seed, stiffness):
    """Three sets relaxed, three sets with another stiffness."""
    parts = [
        limb.record(sets=6, force_noise=0.05, seed=seed, stiffness=k)
        for k in (limb.K, stiffness * limb.K)
    ]
    first = parts[0]
    later = first.trials["set"].to_numpy() > 3
    samples = np.repeat(later, np.diff(first.offsets))[:, None]
    return first.with_step(
        "made of two limbs",
        force=np.where(samples, parts[1].force, first.force),
        trials=first.trials.assign(condition=np.where(later, "tense", "relaxed")),
        shoulder_m=np.zeros(2),
        subject=Subject(f"S{seed}"),
    )


@pytest.fixture(scope="module")
def people(limb, tmp_path_factory):
    """Recordings of four subjects."""
    folder = tmp_path_factory.mktemp("people")
    names = ("ann", "ben", "cem", "dee")
    for seed, name in enumerate(names):
        write_folder(two_conditions(limb, seed, STIFFER + 0.05 * seed), folder / name)
    return [str(folder / name) for name in names]


@pytest.fixture(scope="module")
def estimated(people, tmp_path_factory):
    """Results of two of them, together and of the first alone."""
    folder = tmp_path_factory.mktemp("estimated")
    main(["estimate", *people[:2], "--out", str(folder / "both.csv")])
    main(["estimate", people[0], "--out", str(folder / "one.csv")])
    return folder


def refused(capsys, *arguments):
    code = None
    try:
        code = main([str(a) for a in arguments])
    except SystemExit as end:
        code = end.code
    captured = capsys.readouterr()
    assert code == 2, captured.err
    lines = captured.err.strip().splitlines()
    assert len(lines) == 1, captured.err
    return lines[0]


def test_differences_and_figure(people, tmp_path, capsys):
    out, figure = tmp_path / "d.csv", tmp_path / "f.png"
    call = ["compare", people[0], "--out", str(out), "--figure", str(figure)]
    assert main([*call, "--permutations", "199"]) == 0
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines()[:-2])) <= 110
    table = pd.read_csv(out).set_index(["matrix", "quantity"])
    size = table.loc[("stiffness", "size")]
    assert size["ci_low"] < STIFFER**2 < size["ci_high"]
    assert size["group_1"] == "relaxed"
    assert table.loc[("all", "t2")]["p"] == pytest.approx(1 / 200)
    assert table.loc[("inertia", "t2")]["p"] > 0.01
    assert set(table["basis"]) == {"permutation"}
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_same_seed_same_bits_and_against_turns_the_pair(people, tmp_path, capsys):
    files = [tmp_path / f"{i}.csv" for i in range(3)]
    call = ["compare", people[0], "--permutations", "99", "--seed", "3", "--out"]
    main([*call, str(files[0])])
    main([*call, str(files[1])])
    main([*call, str(files[2]), "--against", "tense"])
    assert files[0].read_bytes() == files[1].read_bytes()
    a, b = (pd.read_csv(f).set_index(["matrix", "quantity"])["change"] for f in files[1:])
    assert a["stiffness", "size"] == pytest.approx(1 / b["stiffness", "size"])


def test_results_without_trials_say_so(estimated, tmp_path, capsys):
    out = tmp_path / "d.csv"
    assert main(["compare", str(estimated / "one.csv"), "--out", str(out)]) == 0
    assert "no trials at hand" in capsys.readouterr().out
    table = pd.read_csv(out).set_index(["matrix", "quantity"])
    assert set(table["basis"]) == {"covariance"}
    assert table.loc[("stiffness", "t2")]["p"] < 0.001


@pytest.mark.first_cases(1)
@pytest.mark.parametrize("column", ["subject", "recording"])
def test_subjects_from_recordings(people, tmp_path, capsys, column):
    out = tmp_path / "d.csv"
    assert main(["compare", *people, "--subjects", column, "--out", str(out)]) == 0
    table = pd.read_csv(out).set_index(["matrix", "quantity"])
    size = table.loc[("stiffness", "size")]
    assert size["n_subjects"] == 4
    truth = np.exp(np.mean([2 * np.log(STIFFER + 0.05 * s) for s in range(4)]))
    assert size["ci_low"] < truth < size["ci_high"]


@pytest.mark.study
def test_subjects_from_results(people, tmp_path, capsys):
    results, out = tmp_path / "all.csv", tmp_path / "d.csv"
    main(["estimate", *people, "--out", str(results)])
    call = ["compare", str(results), "--subjects", "recording", "--out", str(out)]
    assert main(call) == 0
    assert pd.read_csv(out)["n_subjects"].unique().tolist() == [4]


def test_recordings_against_one_another(people, tmp_path, capsys):
    out = tmp_path / "d.csv"
    call = ["compare", *people[:2], "--by", "recording", "--permutations", "19"]
    assert main([*call, "--out", str(out)]) == 0
    table = pd.read_csv(out)
    assert table["group_1"].unique().tolist() == ["ann"]
    assert table["group_2"].unique().tolist() == ["ben"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--by", "experiment"], "trial table"),
        (["--by", "kind"], "no column 'kind'"),
        (["--by", "recording"], "two or more"),
        (["--by", "trial"], "trial 1: one direction only"),
        (["--against", "asleep"], "relaxed; tense"),
        (["--method", "magic"], "one of weighted"),
        (["--permutations", "0"], "at least 1"),
        (["--permutations", "1" + "0" * 400], "at most 1e+06"),
        (["--seed", "-1"], "at least 0"),
        (["--figure", "f.bmp"], ".png"),
        (["--out", "no/such/d.csv"], "existing folder"),
        (["--subjects", "recording"], "1 subject"),
        (["--subjects", "age"], "age"),
    ],
)
def test_refusals_are_one_line_and_write_nothing(
    people, tmp_path, capsys, monkeypatch, arguments, says
):
    monkeypatch.chdir(tmp_path)
    assert says in refused(capsys, "compare", people[0], *arguments)
    assert list(tmp_path.iterdir()) == []


def test_several_recordings_must_be_told_apart(people, estimated, capsys, tmp_path):
    assert "--subjects recording" in refused(capsys, "compare", *people)
    assert "no such file" in refused(capsys, "compare", tmp_path / "nowhere")
    results = estimated / "one.csv"
    assert "only recordings" in refused(capsys, "compare", people[0], results)


def test_results_without_errors_are_refused(estimated, capsys, tmp_path):
    results = tmp_path / "r.csv"
    table = pd.read_csv(estimated / "one.csv", keep_default_na=False)
    bare = [c for c in table if c == "covariance" or c.startswith("sd_")]
    table.drop(columns=bare).to_csv(results, index=False)
    assert "results without covariance" in refused(capsys, "compare", results)


def test_several_rows_of_one_group_are_refused(estimated, capsys):
    assert "several results for relaxed" in refused(capsys, "compare", estimated / "both.csv")


def test_trials_without_directions_are_exchanged_freely(people, limb, tmp_path, capsys):
    recording = two_conditions(limb, 0, STIFFER)
    bare = replace(recording, trials=recording.trials.drop(columns="direction_deg"))
    write_folder(bare, tmp_path / "bare")
    assert main(["compare", str(tmp_path / "bare"), "--permutations", "99"]) == 0
    assert "without regard to direction" in " ".join(capsys.readouterr().out.split())
