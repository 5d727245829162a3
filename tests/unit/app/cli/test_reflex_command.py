"""`armimpedance reflex` as a user calls it: its words, its table, its figure, its refusals."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from armimpedance.__main__ import main
from armimpedance.recordings.tables.folder import write_folder


def answering(recording, gain, delay=0.06):
    """The recording with a reflex of `gain` times stiffness in one condition's trials."""
    force, lag = recording.force.copy(), round(delay * recording.sample_rate_hz)
    answer = gain * np.array([[104.8, -74.4], [-74.4, 179.3]])
    trials = recording.trials.copy()
    trials["condition"] = np.where(np.arange(len(trials)) % 16 < 8, "answers", "silent")
    for row in np.flatnonzero(trials["condition"] == "answers"):
        at = recording.samples_of(int(row))
        moved = recording.position[at] - recording.position[at][0]
        force[at][lag:] -= moved[:-lag] @ answer.T
    return recording.with_step("a reflex", force=force, trials=trials)


@pytest.fixture(scope="module")
def session(limb, tmp_path_factory):
    folder = tmp_path_factory.mktemp("reflex") / "session"
    recording = limb.record(sets=4, duration=0.15, force_noise=0.14, drift=0.002)
    write_folder(answering(recording, 0.25), folder, table="parquet")
    return folder


def test_verdicts_in_words_table_and_figure(session, tmp_path, capsys):
    out, figure = tmp_path / "reflex.csv", tmp_path / "reflex.png"
    assert main(["reflex", str(session), "--out", str(out), "--figure", str(figure)]) == 0
    printed = capsys.readouterr().out
    assert "Contaminated by a reflex from about" in printed
    assert "No sign of a reflex" in printed
    assert "would have been seen" in printed
    assert "K intrinsic" in printed
    assert all(len(line) <= 100 for line in printed.splitlines()[:-2])
    assert figure.stat().st_size > 10_000
    table = pd.read_csv(out).set_index("condition")
    assert table["outcome"].to_dict() == {"answers": "contaminated", "silent": "none"}
    row = table.loc["answers"]
    assert row["ci_low_delay_ms"] < 60 < row["ci_high_delay_ms"]
    assert row["ci_low_reflex_percent"] < 25 < row["ci_high_reflex_percent"]
    assert abs(row["K_22"] - 179.3) < 4.5 * row["sd_K_22"]
    assert np.isnan(row["visible_percent"])
    assert 0 < table.loc["silent", "visible_percent"] <= 25


def test_a_given_delay_is_taken(session, tmp_path, capsys):
    out = tmp_path / "given.csv"
    assert main(["reflex", str(session), "--delay-ms", "60", "--out", str(out)]) == 0
    assert "60 ms (as given)" in capsys.readouterr().out
    table = pd.read_csv(out)
    assert (table["delay_ms"] == 60).all()
    assert not table["delay_scanned"].any()


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--delay-ms", "-5"], "ms late"),
        (["--delay-ms", "nan"], "--delay-ms"),
        (["--delay-ms", "abc"], "--delay-ms"),
        (["--by", "posture"], "posture"),
        (["--figure", "x.tiff"], "x.tiff"),
        (["--out", "no/such/folder/x.csv"], "no such folder"),
        (["--seed", "-1"], "seed"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else value,
)
def test_wrong_calls_are_one_line(arguments, word, session, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    try:
        code = main(["reflex", str(session), *arguments])
    except SystemExit as end:
        code = end.code
    assert code == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert word in lines[0]
    assert list(tmp_path.iterdir()) == []
