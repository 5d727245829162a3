"""Several processes give what one gives, to the bit, and their errors arrive."""

from __future__ import annotations

import operator
import re
from dataclasses import replace

import numpy as np
import pytest

from armimpedance.__main__ import main
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.hand.still.estimation import estimate, in_order
from armimpedance.recordings.tables.folder import write_folder


def test_results_come_in_order():
    pieces = [(n, 2) for n in range(20)]
    assert list(in_order(operator.mul, pieces, 1)) == [2 * n for n in range(20)]


def test_no_workers_are_refused():
    with pytest.raises(InputError, match="0 workers"):
        list(in_order(operator.mul, [(1, 2)], 0))


def in_conditions(recording, names):
    trials = recording.trials.assign(condition=np.resize(names, recording.n_trials))
    return replace(recording, trials=trials.sort_values("trial"))


def test_estimates_do_not_depend_on_workers(limb):
    recording = in_conditions(limb.record(force_noise=0.1, sets=3), ["a", "b", "c"])
    one, two = (estimate(recording, workers=n) for n in (1, 2))
    for a, b in zip(one, two, strict=True):
        assert a.keys == b.keys
        np.testing.assert_array_equal(a.parameters, b.parameters)
        np.testing.assert_array_equal(a.covariance, b.covariance)


def test_errors_of_a_group_name_it_from_any_process(limb):
    recording = limb.record(sets=2)
    along = np.where(recording.trials["direction_deg"] % 180 == 0, "x only", "others")
    recording = replace(recording, trials=recording.trials.assign(condition=along))
    for workers in (1, 2):
        with pytest.raises(
            NotIdentifiableError, match="condition x only: the hand moved along one"
        ):
            estimate(recording, workers=workers)


def test_negative_seeds_are_refused_in_words(limb, tmp_path, capsys):
    write_folder(limb.record(sets=1), tmp_path / "session")
    for call in (
        ["estimate", str(tmp_path / "session"), "--covariance", "bootstrap", "--seed", "-1"],
        ["simulate", "force", "--seed", "-1", "--out", str(tmp_path / "new")],
    ):
        assert main(call) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert "seed -1 (expected " in line
        assert re.search(r"\b0\b", line.partition("expected")[2])
    assert not (tmp_path / "new").exists()
