"""What happens before a fit: SNR of the channels, filter and decimation, what is refused."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.checks import channel_spectrum, spectra_of
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.stationary import preparation
from armimpedance.joint.elbow.stationary.identify import identify_elbow
from armimpedance.joint.elbow.stationary.methods import METHODS
from armimpedance.joint.elbow.stationary.preparation import without_ramp
from manipulandum_sim.elbow.bench import simulate_bench

JOINT = (0.07, 0.6, 20.0)


def prepare(samples, *options):
    return preparation.prepare(samples, spectra_of(samples), *options)


@lru_cache(maxsize=1)
def truth():
    return simulate_bench(*JOINT, seed=5)[1]


def bench(snr_db=None, seed=0):
    """The same motion with other noise; dB of both channels, or of torque and angle."""
    torque, angle = truth().torque[0], truth().angle[0]
    if snr_db is not None:
        levels = np.broadcast_to(snr_db, 2)
        white = np.random.default_rng(seed).standard_normal((2, len(torque)))
        torque = torque + white[0] * torque.std() * 10 ** (-levels[0] / 20)
        angle = angle + white[1] * angle.std() * 10 ** (-levels[1] / 20)
    return JointSamples(
        1000.0, ("1",), np.array([0, len(torque)]), torque, angle, perturbation=truth().torque[0]
    )


@pytest.fixture(scope="module")
def noisy():
    return bench(snr_db=(20.0, 30.0), seed=5)


@pytest.mark.parametrize("levels", [(5.0, 15.0), (20.0, 30.0), (40.0, 10.0)])
def test_the_snr_is_read_off_the_raw_channels(levels):
    found = spectra_of(bench(snr_db=levels, seed=2)).snr
    # The floor's mean over 40 % of 500 bins of 19 segments is known to 1.5 %; the noise drawn
    # and the signal's own variance to 2 % more: 0.3 dB holds four standard errors.
    assert found.torque_db == pytest.approx(levels[0], abs=0.4)
    assert found.angle_db == pytest.approx(levels[1], abs=0.4)


def test_without_noise_there_is_no_floor():
    found = spectra_of(bench(seed=1)).snr
    assert (found.torque_db, found.angle_db) == (None, None)


def test_mains_hum_high_up_is_no_floor(noisy):
    time = np.arange(len(noisy.angle)) / 1000.0
    hum = 0.3 * noisy.torque.std() * np.sin(2 * np.pi * 350.0 * time)
    quiet = channel_spectrum(noisy, noisy.torque).floor
    with_hum = channel_spectrum(noisy, noisy.torque + hum).floor
    assert with_hum == pytest.approx(quiet, rel=0.1)


def test_all_channels_go_through_one_filter(noisy):
    """What relates them before still does: a torque that is twice the angle stays twice it."""
    same = replace(noisy, torque=2 * noisy.angle, perturbation=-noisy.angle)
    done = prepare(same, 10.0, 4)
    np.testing.assert_allclose(done.torque, 2 * done.angle, atol=1e-14)
    np.testing.assert_allclose(done.perturbation, -done.angle, atol=1e-14)
    assert done.sample_rate_hz == 250.0
    assert len(done.angle) == 2500


def test_offset_and_drift_do_not_matter(noisy):
    time = np.arange(len(noisy.angle)) / 1000.0
    moved = replace(noisy, angle=noisy.angle + 1.2 + 0.05 * time, torque=noisy.torque - 3.0)
    plain, done = prepare(noisy, 10.0, 4), prepare(moved, 10.0, 4)
    np.testing.assert_allclose(done.angle, plain.angle, atol=1e-11)
    np.testing.assert_allclose(done.torque, plain.torque, atol=1e-11)


def test_a_ramp_is_removed_exactly():
    line = 3.0 - 0.2 * np.arange(50.0)
    np.testing.assert_allclose(without_ramp(line), 0, atol=1e-12)


def test_what_was_chosen_is_told(noisy):
    auto = prepare(noisy)
    assert any("low-pass" in note and "Hz" in note for note in auto.notes)
    assert 5 < auto.cutoff_hz < 20
    asked = prepare(noisy, 8.0, 10)
    assert (asked.cutoff_hz, asked.decimation, asked.sample_rate_hz) == (8.0, 10, 100.0)
    assert any("8 Hz" in note for note in asked.notes)
    raw = prepare(noisy, None, 1)
    assert (raw.cutoff_hz, raw.decimation, raw.edge) == (None, 1, 0)


def test_decimation_is_always_guarded_against_aliases(noisy):
    done = prepare(noisy, None, 20)
    assert done.cutoff_hz == 20.0
    assert any("aliases" in note for note in done.notes)


def test_less_noise_widens_the_band():
    bands = [prepare(bench(snr_db=db, seed=4)).band_hz for db in (5.0, 15.0, None)]
    assert bands[0] < bands[1] <= bands[2]


@pytest.mark.parametrize(
    ("cutoff", "decimation", "says"),
    [
        (500.0, 1, "half of the rate"),
        (600.0, 1, "half of the rate"),
        (-1.0, 1, "half of the rate"),
        ("low", 1, "cut-off"),
        (np.nan, 1, "cut-off"),
        (10.0, 0, "whole number"),
        (10.0, 2.5, "whole number"),
        (10.0, "some", "whole number"),
    ],
)
def test_cutoffs_and_decimations_that_cannot_be(noisy, cutoff, decimation, says):
    with pytest.raises(InputError, match=says):
        prepare(noisy, cutoff, decimation)


def _clipped(samples):
    limit = 1.0 * samples.torque.std()
    return replace(samples, torque=np.clip(samples.torque, -limit, limit))


def _stuck(samples):
    angle = samples.angle.copy()
    angle[4000:4800] = angle[4000]
    return replace(samples, angle=angle)


def _first(samples, count):
    return JointSamples(
        1000.0, ("1",), np.array([0, count]), samples.torque[:count], samples.angle[:count]
    )


@pytest.mark.parametrize(
    ("broken", "says"),
    [
        (_clipped, "torque of trial 1 stays at its extreme.*clipped"),
        (_stuck, "angle of trial 1 does not change for 0.80 s.*stuck"),
        (lambda s: replace(s, angle=np.full_like(s.angle, 0.3)), "does not move"),
        (lambda s: replace(s, torque=np.zeros_like(s.torque)), "no perturbation"),
        (lambda s: _first(s, 1500), "lasts 1.50 s"),
    ],
    ids=["clipped", "stuck", "still", "no torque", "short"],
)
def test_a_record_that_cannot_be_used_is_refused_in_one_line(noisy, broken, says):
    for method in METHODS:
        with pytest.raises(InputError, match=says) as told:
            identify_elbow(broken(noisy), method=method)
        assert "\n" not in str(told.value)


def test_a_coarse_converter_is_not_a_clipped_sensor(noisy):
    """12 bits over a swing of 20 degrees: its peaks stay at one level, as they should."""
    step = 0.35 / 2**12
    coarse = replace(noisy, angle=step * np.round(noisy.angle / step))
    assert identify_elbow(coarse).summary.rank == 3


@pytest.mark.parametrize(("levels", "channel"), [((2.0, 30.0), "torque"), ((30.0, 2.0), "angle")])
def test_too_low_an_snr_is_refused_before_the_fit(levels, channel):
    samples = bench(snr_db=levels, seed=6)
    for name, method in METHODS.items():
        says = rf"of the {channel} is \d\.\d dB.*expected {method.lowest_snr_db:g} dB"
        with pytest.raises(InputError, match=says):
            identify_elbow(samples, method=name)


def test_between_the_limits_arx_names_who_can(noisy):
    with pytest.raises(InputError, match="method iv or output-error"):
        identify_elbow(bench(snr_db=10.0, seed=6), method="arx")


def test_an_unknown_method_lists_those_there_are():
    with pytest.raises(InputError, match=r"'magic'.*iv, arx, derivative, output-error"):
        METHODS.named("magic")
