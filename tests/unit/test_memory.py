"""How much memory a recording of N samples takes, and that a long trial is cut without harm.

`tracemalloc` counts what NumPy asks for, to the byte: no other process can disturb it.
"""

from __future__ import annotations

import subprocess
import sys
import tracemalloc
import weakref
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from scipy.signal import cont2discrete, lfilter

from armimpedance.app import inspection
from armimpedance.app.inspection import inspect
from armimpedance.core.arrays import lengths
from armimpedance.core.records import Recording
from armimpedance.hand.still import stochastic
from armimpedance.hand.still.doubts import allowance, departures as told
from armimpedance.hand.still.doubts.model import Model
from armimpedance.hand.still.show import estimate
from armimpedance.numerics.signals import multiple_coherence, spectra
from armimpedance.recordings import write_recording
from armimpedance.recordings.tables import sample_table as sample_clock
from armimpedance.show.verbs import checks as spread
from armimpedance.show.verbs.checks import TopicChecks
from armimpedance.show.verbs.results import read

#: Bytes of time, position and force of one sample.
OWN = 40


def _table(conditions: int, trials: int) -> pd.DataFrame:
    n = conditions * trials
    return pd.DataFrame(
        {
            "trial": np.arange(1, n + 1),
            "condition": [f"c{i // trials:03d}" for i in range(n)],
            "direction_deg": 45.0 * (np.arange(n) % 8),
            "onset_s": 0.25,
            "end_s": 0.55,
        }
    )


def _recording(table: pd.DataFrame, position: np.ndarray, force: np.ndarray, rate: float, **more):
    n = len(table)
    samples = len(position) // n
    return Recording(
        kind="hand",
        sample_rate_hz=rate,
        trials=table,
        offsets=np.arange(n + 1) * samples,
        time_s=np.tile(np.arange(samples) / rate, n),
        position=position,
        force=force,
        **more,
    )


def _returning(conditions: int, trials: int, samples: int = 801, rate: float = 1000.0) -> Recording:
    rng = np.random.default_rng(0)
    n, t = conditions * trials, np.arange(samples) / rate
    s = np.clip((t - 0.25) / 0.3, 0, 1)
    bump = 0.005 * 64 * s**3 * (1 - s) ** 3
    velocity = np.gradient(bump, t)
    angle = np.arange(n) * np.pi / 4
    u = np.column_stack([np.cos(angle), np.sin(angle)])[:, None, :]
    force = -(1.5 * np.gradient(velocity, t) + 10 * velocity + 150 * bump)[None, :, None] * u
    force += rng.normal(0, 0.1, force.shape)
    position = bump[None, :, None] * u + rng.normal(0, 1e-5, force.shape)
    rows = position.reshape(-1, 2), force.reshape(-1, 2)
    return _recording(_table(conditions, trials), *rows, rate)


def _random(samples: int) -> Recording:
    rng = np.random.default_rng(0)
    push = lfilter([0.06], [1, -0.94], 20 * rng.standard_normal((samples, 2)), axis=0)
    numerator, denominator, _ = cont2discrete(([1.0], [1.5, 10.0, 150.0]), 1e-3)
    place = lfilter(numerator.ravel(), denominator, push, axis=0)
    force = rng.normal(0, 0.05, push.shape) - push
    table = pd.DataFrame({"trial": [1], "condition": ["a"]})
    return _recording(table, place, force, 1000.0, perturbation="stochastic")


def _peak(work: Callable[[], object]) -> float:
    """Most bytes held at once beyond those before; what Arrow holds is not counted."""
    work()
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        work()
        return tracemalloc.get_traced_memory()[1] - before
    finally:
        tracemalloc.stop()


@pytest.mark.first_cases(1)
@pytest.mark.parametrize("channels", [6, 0])
def test_reading_takes_two_and_a_half_times_the_recordings_own_arrays(channels, tmp_path):
    recording = _returning(4, 100)
    if channels:
        emg = np.random.default_rng(0).normal(0, 1e-4, (len(recording.time_s), channels))
        muscles = tuple(f"m{i}" for i in range(channels))
        recording = replace(recording, emg=emg, muscles=muscles)
    write_recording(recording, tmp_path / "session")
    own = (OWN + 8 * channels) * len(recording.time_s)
    # what earlier tests of this process still hold is not what reading leaves
    held = pa.total_allocated_bytes()
    assert _peak(lambda: read(tmp_path / "session")) < 2.5 * own
    assert pa.total_allocated_bytes() - held < 0.1 * own


def test_a_recording_that_was_read_holds_its_arrays_once(tmp_path):
    recording = _returning(2, 100)
    write_recording(recording, tmp_path / "session")
    read(tmp_path / "session")
    tracemalloc.start()
    try:
        kept = read(tmp_path / "session")
        held = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert held < 1.1 * OWN * len(kept.time_s)


def test_an_estimate_keeps_the_models_of_some_conditions_not_of_all(monkeypatch):
    """A model is as large as its trials' windows: with one a condition, memory would grow."""
    made, alive, most = Model.of, weakref.WeakSet(), []

    def counted(*arguments):
        model = made(*arguments)
        alive.add(model)
        most.append(len(alive))
        return model

    monkeypatch.setattr(Model, "of", counted)
    for module in (allowance, told):
        monkeypatch.setattr(module, "MOST_CONDITIONS", 2)
    estimate(_returning(6, 8))
    assert len(most) >= 6
    assert max(most) <= 2 + 2


def test_a_long_trial_takes_a_stretch_of_room_not_its_length(monkeypatch):
    monkeypatch.setattr(stochastic, "LONG", 1 << 13)
    monkeypatch.setattr(spectra, "TOGETHER", 8)
    short, long = _random(50_000), _random(100_000)

    def peak(recording):
        group = stochastic.Group.of(recording, {"condition": "a"})
        return _peak(lambda: stochastic.estimate_stochastic(recording, group))

    # one array of one channel more would be a fifth of the recording's own
    assert peak(long) - peak(short) < 0.1 * OWN * 50_000


def test_stretches_of_a_long_trial_are_its_blocks_as_a_whole(monkeypatch):
    recording = _random(100_000)
    for band in ((5.0, 45.0), (8.0, 10.0)):
        whole = stochastic.stochastic_response(recording, band)
        with monkeypatch.context() as patch:
            patch.setattr(stochastic, "LONG", 1 << 14)
            parts = stochastic.stochastic_response(recording, band)
        for name in ("displacement", "velocity", "acceleration", "force"):
            own, other = getattr(whole, name), getattr(parts, name)
            assert np.abs(own - other).max() < 1e-11 * np.abs(own).max()
        assert np.array_equal(whole.trial, parts.trial)


def test_coherence_does_not_depend_on_the_segments_taken_together(monkeypatch):
    recording = _random(40_000)
    rows = recording.position, recording.force, 1000.0
    whole = multiple_coherence(*rows)
    monkeypatch.setattr(spectra, "TOGETHER", 7)
    parts = multiple_coherence(*rows)
    assert parts.segments == whole.segments
    assert np.abs(parts.coherence - whole.coherence).max() < 1e-12


@pytest.mark.study
def test_inspect_takes_a_few_times_the_recordings_own_arrays():
    recording = _returning(4, 100)
    assert _peak(lambda: inspect(recording)) < 6 * OWN * len(recording.time_s)


@pytest.mark.study
def test_the_peak_of_an_estimate_is_that_of_the_reading(tmp_path, monkeypatch):
    """Of a large recording: the checks before the fit take a part of it, the fit one condition."""
    # a part as small as 4000 trials are of 27000
    monkeypatch.setattr(spread, "MOST_CHECKED", 40)
    monkeypatch.setattr(spread, "OF_THE_LARGEST", 8)
    write_recording(_returning(17, 16), tmp_path / "session")
    reading = _peak(lambda: read(tmp_path / "session"))
    assert _peak(lambda: estimate(tmp_path / "session")) < 1.05 * reading


@pytest.mark.study
@pytest.mark.parametrize(("conditions", "trials"), [(1, 4400), (40, 110), (550, 8)])
def test_inspect_of_many_trials_fits_4000_of_them_and_says_so(conditions, trials, monkeypatch):
    fitted, judge = [], inspection.OF_ALL_TOPICS.response

    def judged(part):
        fitted.append(part)
        return judge(part)

    monkeypatch.setattr(inspection, "OF_ALL_TOPICS", TopicChecks(response=judged))
    found = inspect(_returning(conditions, trials, samples=160, rate=200.0)).checks
    (part,) = fitted
    each = part.trials.groupby("condition").size()
    assert 3000 < part.n_trials <= 4000
    assert each.min() >= min(trials, 8)
    # from the first to the last: what changes in the course of a session is among them
    numbers = part.trials["trial"].to_numpy()
    assert numbers[0] < 100
    assert numbers[-1] > conditions * trials - 100
    assert np.diff(numbers).min() > 0
    (told,) = (one.message for one in found if one.name == "part")
    assert told.startswith(f"{part.n_trials} of {conditions * trials} trials, of {len(each)} of")


@pytest.mark.study
def test_inspect_of_4000_trials_fits_all(monkeypatch):
    recording = _returning(4, 1000, samples=160, rate=200.0)
    fitted = []
    judge = TopicChecks(response=lambda part: fitted.append(part) or ())
    monkeypatch.setattr(inspection, "OF_ALL_TOPICS", judge)
    assert "part" not in [one.name for one in inspect(recording).checks]
    assert fitted == [recording]


@pytest.mark.parametrize("d", range(1, 10))
def test_lengths_are_numpys_norms_to_the_last_bit(d):
    rng = np.random.default_rng(d)
    vectors = rng.standard_normal((40, 30, d)) * 10.0 ** rng.integers(-8, 8, (40, 30, d))
    assert np.array_equal(lengths(vectors), np.linalg.norm(vectors, axis=-1))


def test_a_clock_is_judged_alike_in_pieces_of_any_length(tmp_path, monkeypatch):
    """The first sample that is wrong is named, wherever the pieces are cut."""
    from armimpedance.core.errors import InputError

    recording = _returning(1, 8, samples=200, rate=200.0)
    time = np.array(recording.time_s)
    time[777:800] += 0.02
    folder = tmp_path / "session"
    write_recording(recording.with_step("moved", time_s=time), folder)
    said = []
    for together in (1 << 18, 777, 200, 64, 3):
        monkeypatch.setattr(sample_clock, "TOGETHER", together)
        with pytest.raises(InputError) as caught:
            read(folder)
        said.append(str(caught.value))
    assert len(set(said)) == 1
    assert "row 778" in said[0]


@pytest.mark.study
def test_reading_a_folder_takes_none_of_scipy(tmp_path):
    """Its import alone took as long as reading a session of 2400 trials."""
    write_recording(_returning(1, 8), tmp_path / "session")
    code = "import sys, armimpedance as ai; ai.read(sys.argv[1]); print('scipy' in sys.modules)"
    told = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "session")],
        check=True,
        capture_output=True,
        text=True,
    )
    assert told.stdout.strip() == "False"
