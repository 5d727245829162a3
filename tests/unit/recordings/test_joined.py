"""A log and its trial table in a second file: one recording, whatever the trials are called."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io
from mapped_files import BY_TRIAL, FXY, ONSETS, XY, hand_mapping, long_table

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.recordings import open_recording, propose_mapping


def log_and_trials(recording: Recording) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The samples, and one row a trial, in another order than in the log."""
    whole = long_table(recording)
    of_trial = ["trial", "cond", "onset", "end"]
    trials = whole[of_trial].drop_duplicates().iloc[::-1]
    return whole.drop(columns=of_trial[1:]), trials


def saved(folder: Path, log: pd.DataFrame, trials: pd.DataFrame, key: str, **more: str) -> Path:
    log.to_csv(folder / "log.csv", index=False)
    trials.to_csv(folder / "trials.csv", index=False)
    text = hand_mapping(XY, FXY, time="t", trials=more.get("by", BY_TRIAL), values=ONSETS)
    (folder / "columns.toml").write_text(f'{text}\n[[tables]]\nfile = "trials.csv"\nkey = {key}\n')
    return folder / "log.csv"


def same(made: Recording, truth: Recording) -> None:
    np.testing.assert_allclose(made.position, truth.position, atol=1e-12)
    for name in ("condition", "onset_s", "end_s"):
        assert made.trials[name].tolist() == truth.trials[name].tolist()


def test_a_trial_table_beside_the_log(truth, tmp_path):
    same(open_recording(saved(tmp_path, *log_and_trials(truth), '"trial"')), truth)


@pytest.mark.parametrize("form", ["{:.1f}", "{:03d}", " {}"])
def test_numbers_of_trials_as_people_write_them(truth, tmp_path, form):
    log, trials = log_and_trials(truth)
    number = trials.pop("trial")
    trials["No"] = [form.format(float(n) if ".1f" in form else int(n)) for n in number]
    key = '{ log = "trial", table = "No" }'
    same(open_recording(saved(tmp_path, log, trials, key)), truth)


def test_a_file_for_each_trial_named_by_its_number(truth, tmp_path):
    log, trials = log_and_trials(truth)
    for number, rows in log.groupby("trial"):
        rows.drop(columns="trial").to_csv(tmp_path / f"run_{number:03d}.csv", index=False)
    trials.to_csv(tmp_path / "table.tsv", sep="\t", index=False)
    text = hand_mapping(
        *(XY, FXY), time="t", trials='by = "run"\npattern = "run_{trial}"', values=ONSETS,
        more='files = "run_*.csv"',
    )  # fmt: skip
    text += '\n[[tables]]\nfile = "table.tsv"\nkey = "trial"\n'
    (tmp_path / "columns.toml").write_text(text)
    same(open_recording(tmp_path), truth)


def test_the_trial_table_is_a_variable_of_the_log(truth, tmp_path):
    log, trials = log_and_trials(truth)
    content = {name: log[name].to_numpy() for name in log}
    content["info"] = {
        "id": trials["trial"].to_numpy(),
        "cond": np.array(trials["cond"].tolist(), dtype=object),
        "on": trials["onset"].to_numpy(),
        "off": trials["end"].to_numpy(),
    }
    scipy.io.savemat(tmp_path / "log.mat", content)
    values = 'onset_s = "info.on"\nend_s = "info.off"\ncondition = "info.cond"'
    text = hand_mapping(XY, FXY, time="t", trials=BY_TRIAL, values=values)
    text += '\n[[tables]]\nkey = { log = "trial", table = "info.id" }\n'
    (tmp_path / "columns.toml").write_text(text)
    same(open_recording(tmp_path / "log.mat"), truth)


def test_what_cannot_be_joined_is_refused_where_it_is_wrong(truth, tmp_path):
    log, trials = log_and_trials(truth)
    path = saved(tmp_path, log, trials.iloc[1:], '"trial"')
    with pytest.raises(InputError, match=r"log.csv.*trial 8 has no row in trials.csv") as found:
        open_recording(path)
    # the line of the log where the trial begins, below its header
    assert found.value.row == 2 + int((log["trial"] == 8).to_numpy().argmax())
    twice = pd.concat([trials, trials.iloc[:1]])
    with pytest.raises(InputError, match="trials.csv.*trial 8 occurs twice"):
        open_recording(saved(tmp_path, log, twice, '"trial"'))
    with pytest.raises(InputError, match="trials.csv.*no such column.*cond"):
        open_recording(saved(tmp_path, log, trials, '{ log = "trial", table = "Nr" }'))
    with pytest.raises(InputError, match="log.csv.*no such column.*fx"):
        open_recording(saved(tmp_path, log, trials, '{ log = "Nr", table = "trial" }'))
    for wrong in ('""', "3", '{ log = "trial" }'):
        with pytest.raises(InputError, match="columns.toml.*tables"):
            open_recording(saved(tmp_path, log, trials, wrong))
    (tmp_path / "trials.csv").unlink()
    with pytest.raises(InputError):
        open_recording(path)


def test_what_stands_between_trials_needs_no_row(truth, tmp_path):
    log, trials = log_and_trials(truth)
    between = log.assign(trial=np.where(log["t"] < 0.01, 0, log["trial"]))
    path = saved(tmp_path, between, trials, '"trial"', by=f"{BY_TRIAL}\nbetween = [0]")
    assert open_recording(path).n_trials == truth.n_trials


def test_the_trial_table_beside_a_log_is_proposed(truth, tmp_path):
    log, trials = log_and_trials(truth)
    trials = trials.rename(columns={"trial": "No", "onset": "onset_s", "end": "end_s"})
    path = saved(tmp_path, log, trials, '"unused"')
    (tmp_path / "columns.toml").unlink()
    (tmp_path / "notes.csv").write_text("day,who\n1,A\n2,B\n")
    text = propose_mapping(path).text
    text = text.replace('# by = "limb"', 'by = "limb"').replace('unit = "?"', 'unit = "N"')
    (tmp_path / "columns.toml").write_text(text)
    same(open_recording(path), truth)


def test_names_of_files_are_proposed_as_conditions_and_trials(truth, tmp_path):
    log, trials = log_and_trials(truth)
    for number, rows in log.groupby("trial"):
        name = f"{'soft' if number % 2 else 'stiff'}_{number:02d}.csv"
        rows.drop(columns="trial").to_csv(tmp_path / name, index=False)
    trials.drop(columns="cond").to_csv(tmp_path / "session.tsv", sep="\t", index=False)
    proposed = propose_mapping(tmp_path, files="*.csv")
    assert 'pattern = "{condition}_{trial}"' in proposed.text
    assert 'file = "session.tsv"' in proposed.text
    text = proposed.text.replace('# by = "limb"', 'by = "limb"')
    text = text.replace('unit = "?"', 'unit = "N"', 1).replace('unit = "?"', 'unit = "s"')
    (tmp_path / "columns.toml").write_text(text)
    made = open_recording(tmp_path)
    assert sorted(set(made.trials["condition"])) == ["soft", "stiff"]
    assert sorted(made.trials["trial"]) == list(range(1, 9))
    onset = dict(zip(truth.trials["trial"], truth.trials["onset_s"], strict=True))
    assert [onset[n] for n in made.trials["trial"]] == made.trials["onset_s"].tolist()
