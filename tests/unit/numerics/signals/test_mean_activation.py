"""The activation that an estimate carries: the simulated muscles', within its standard error."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.still.estimation import estimate
from armimpedance.numerics.signals.emg.activation import mean_activation, mvc_column
from manipulandum_sim.hand import IDEAL, simulate

CONDITION = "cocontraction_20"


@pytest.fixture(scope="module")
def simulated():
    return simulate(
        "cocontraction", subject="B", seed=4, sets=2, conditions=[CONDITION], servo=IDEAL
    )


def onsets(recording):
    return recording.trials["onset_s"].to_numpy(dtype=float)


def every_row(recording):
    return np.arange(recording.n_trials)


@pytest.mark.study
def test_activation_is_the_simulated_muscles(simulated):
    """Six muscles, 16 trials: t with 15 degrees of freedom stays below 5 but once in 7,000."""
    recording, truth = simulated
    found = mean_activation(recording, every_row(recording), onsets(recording))
    assert (found.sd > 0).all()
    assert (np.abs(found.mean - truth.activation[0]) < 5 * found.sd).all()


@pytest.mark.study
def test_a_relaxed_muscle_is_silent_once_the_electrodes_noise_is_taken_off():
    recording, truth = simulate(
        "cocontraction", subject="B", seed=4, sets=5, conditions=["cocontraction_00"], servo=IDEAL
    )
    rows = every_row(recording)
    found = mean_activation(recording, rows, onsets(recording))
    assert (np.abs(found.mean - truth.activation[0]) < 5 * found.sd).all()
    noise = recording.trials.columns.str.startswith("rest_")
    known = replace(recording, trials=recording.trials.loc[:, ~noise])
    raw = mean_activation(known, rows, onsets(known))
    # amplifier noise alone: some thousandths, many standard errors above nothing
    assert (raw.mean - truth.activation[0] > 5 * raw.sd).sum() >= 4
    assert np.abs(found.mean - truth.activation[0]).max() < 0.5 * raw.mean.max()


def test_an_estimate_carries_it(simulated):
    recording, _ = simulated
    made = estimate(recording)[0]
    found = mean_activation(recording, every_row(recording), onsets(recording))
    assert np.array_equal(made.activation, found.mean)
    assert np.array_equal(made.activation_sd, found.sd)
    assert made.muscles == recording.muscles
    assert any("16 trials" in sentence for sentence in made.provenance)


def test_what_follows_the_onset_does_not_count(simulated):
    recording, _ = simulated
    reflex = np.array(recording.emg)
    for row, onset in enumerate(onsets(recording)):
        part = recording.samples_of(row)
        after = recording.time_s[part] > onset
        # alternating, so that the trial's mean, its offset, stays
        reflex[part][after] += 1e-2 * np.resize([1, -1], (after.sum(), 1))
    louder = replace(recording, emg=reflex)
    rows = every_row(recording)
    before, now = (mean_activation(r, rows, onsets(r)) for r in (recording, louder))
    assert now.mean == pytest.approx(before.mean, rel=1e-2)


def test_normalised_emg_is_taken_as_it_is(simulated):
    recording, _ = simulated
    level = np.linspace(0.1, 0.6, 6)
    flat = np.broadcast_to(level, recording.emg.shape)
    known = replace(recording, emg=flat, emg_unit="normalised")
    found = mean_activation(known, every_row(known), onsets(known))
    assert found.mean == pytest.approx(level)


def test_without_emg_or_mvc_there_is_no_activation(simulated):
    recording, _ = simulated
    no_mvc = replace(
        recording, trials=recording.trials.drop(columns=mvc_column(recording.muscles[2]))
    )
    for lacking in (no_mvc, replace(recording, emg=None, muscles=())):
        assert mean_activation(lacking, every_row(lacking), onsets(lacking)) is None
    assert estimate(no_mvc)[0].activation is None


def test_an_mvc_in_another_unit_costs_the_activation_but_not_the_impedance(simulated):
    recording, _ = simulated
    trials = recording.trials.copy()
    trials[mvc_column(recording.muscles[4])] *= 1e-3
    wrong = replace(recording, trials=trials)
    with pytest.raises(InputError, match="EMG: activation .* of muscle 5"):
        mean_activation(wrong, every_row(wrong), onsets(wrong))
    made = estimate(wrong)[0]
    assert made.activation is None
    assert any("activation left out" in sentence for sentence in made.warnings)


def test_too_short_a_rest_says_nothing(simulated):
    recording, _ = simulated
    early = recording.time_s[recording.offsets[:-1]] + 0.05
    assert mean_activation(recording, every_row(recording), early) is None
    one = onsets(recording).copy()
    one[1:] = early[1:]
    single = mean_activation(recording, every_row(recording), one)
    assert single.sd is None
