"""Commands of joints and of a therapy robot refuse a STOP too, and go on when told to."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.__main__ import main
from armimpedance.recordings import write_recording
from manipulandum_sim.elbow import simulate_elbow


@pytest.fixture(scope="module")
def twice(tmp_path_factory):
    """A session of the elbow in which every trial stands under two numbers."""
    folder = tmp_path_factory.mktemp("lab") / "session"
    once = simulate_elbow("posture", seed=2, repetitions=2, duration_s=3.0)[0]
    more = once.trials.assign(trial=once.trials["trial"] + 10)
    both = replace(
        once,
        trials=pd.concat([once.trials, more], ignore_index=True),
        offsets=np.concatenate([once.offsets, once.offsets[-1] + once.offsets[1:]]),
        time_s=np.tile(once.time_s, 2),
        position=np.tile(once.position, (2, 1)),
        force=np.tile(once.force, (2, 1)),
        emg=np.tile(once.emg, (2, 1)),
        extra={name: np.tile(column, 2) for name, column in once.extra.items()},
    )
    write_recording(both, folder)
    return folder


@pytest.mark.parametrize("options", [[], ["--time-varying", "windows"], ["--emg-law"]])
def test_elbow_refuses_copies_in_one_line(refusal, twice, options):
    line = refusal("elbow", twice, *options)
    assert "copies: trials hold the same noise: 1 = 11, 2 = 12" in line
    assert "--despite 'copies'" in line


@pytest.mark.study
def test_elbow_goes_on_and_says_so(twice, tmp_path, capsys):
    out = tmp_path / "fit.json"
    assert main(["elbow", str(twice), "--despite", "copies", "--out", str(out)]) == 0
    capsys.readouterr()
    assert json.loads(out.read_text())["warnings"][0].startswith("despite copies")
