"""Raw EMG that cannot be used is refused with trial and muscle; what can, is graded."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.emg.checks import check_band, check_emg, emg_quality, refuse_emg
from armimpedance.numerics.signals.emg.cleaning import clean_emg, without_hum

RATE = 1000.0
TIME = np.arange(5000) / RATE


@pytest.fixture(scope="module")
def sound(emg_recording):
    return emg_recording(np.full((3, 5000, 2), 0.2), seed=11, noise_V=2e-6, rest=True)


def changed(recording, row, muscle, values):
    """The recording with other EMG in one trial of one muscle."""
    emg = np.array(recording.emg)
    emg[recording.samples_of(row), muscle] = values(emg[recording.samples_of(row), muscle])
    return replace(recording, emg=emg)


def verdicts(recording):
    return {check.name: check.verdict for check in check_emg(recording)}


def test_sound_emg_passes_every_check(sound):
    assert set(verdicts(sound).values()) == {"ok"}
    assert refuse_emg(sound)[1] == ()


def test_a_flat_channel_is_named(sound):
    for value in (0.0, 1.3):
        flat = changed(sound, 1, 1, lambda x, v=value: np.full_like(x, v))
        with pytest.raises(InputError, match=r"trial 2, triceps: stays at one value for 5.00 s"):
            refuse_emg(flat)
    gone = changed(sound, 2, 0, lambda x: np.where((TIME > 2) & (TIME < 2.5), 0.0, x))
    with pytest.raises(InputError, match=r"trial 3, biceps: stays at one value for 0\.50 s"):
        refuse_emg(gone)


def test_a_saturated_channel_is_named_and_a_touch_warned_of(sound):
    """Clipped at 1.5 sd of Gaussian noise: 13 % of the samples; at 2.75 sd: 0.6 %."""
    hard = changed(sound, 0, 0, lambda x: np.clip(x, -1.5 * x.std(), 1.5 * x.std()))
    with pytest.raises(InputError, match=r"trial 1, biceps: 1[234]\.\d % at its extreme"):
        refuse_emg(hard)
    touched = changed(sound, 0, 0, lambda x: np.clip(x, -2.75 * x.std(), 2.75 * x.std()))
    assert verdicts(touched)["saturated"] == "warning"


def test_a_coarse_converter_is_not_saturation(sound):
    coarse = changed(sound, 0, 0, lambda x: np.round(x / x.std() * 8) / 8)
    assert verdicts(coarse)["saturated"] == "ok"


@pytest.mark.parametrize("mains", [50.0, 60.0])
def test_hum_is_measured_as_a_share_of_power(sound, mains):
    """Share of a line over the floor: noise of the floor in a band of 3 Hz makes it uncertain by
    some 2 % of the power."""
    own = sound.emg[sound.samples_of(1), 1].var()
    wave = np.sin(2 * np.pi * mains * TIME) + 0.5 * np.sin(2 * np.pi * 3 * mains * TIME)
    size = np.sqrt(2 * own / 1.25)
    humming = changed(sound, 1, 1, lambda x: x + size * wave)
    quality = emg_quality(humming)
    assert quality.mains_hz == mains
    assert quality.hum[1, 1] == pytest.approx(0.5, abs=0.05)
    assert np.delete(quality.hum.ravel(), 3).max() < 0.05
    assert verdicts(humming)["hum"] == "warning"


def test_hum_that_drowns_the_muscle_is_refused(sound):
    loud = changed(sound, 1, 0, lambda x: x + 10 * x.std() * np.sin(2 * np.pi * 50 * TIME))
    with pytest.raises(InputError, match=r"trial 2, biceps: 9\d % of the power is hum at mult.*50"):
        refuse_emg(loud)


def test_hum_of_a_silent_muscle_does_not_matter(emg_recording):
    """1 uV beside 1 uV of noise: a third of the power and some thousandth of the maximum."""
    silent = emg_recording(
        np.full((1, 5000, 2), 1e-4),
        seed=12,
        noise_V=1e-6,
        extra_V=1e-6 * np.sin(2 * np.pi * 50 * TIME)[None, :, None],
    )
    assert emg_quality(silent).hum.min() > 0.2
    assert verdicts(silent)["hum"] == "ok"


def test_subtracting_hum_leaves_only_what_it_cannot_know():
    """Noise of sd 1 and 9 sinusoids: 18 of 5000 degrees of freedom go, the rest stays."""
    rng = np.random.default_rng(13)
    noise = rng.normal(size=5000)
    hum = 30 * np.cos(2 * np.pi * 49.93 * TIME + 0.4) + 5 * np.sin(2 * np.pi * 3 * 49.93 * TIME)
    left = without_hum(noise + hum, 50.0, RATE)
    # hum's own frequency is known to its scan's step: below a hundredth of the hum is left
    assert (left - noise).std() < 0.02 * hum.std()
    assert without_hum(noise, 50.0, RATE).var() == pytest.approx(noise.var(), rel=0.02)


def test_hum_that_drifts_is_told_after_cleaning(sound):
    drifting = np.sin(2 * np.pi * 50 * TIME) * (1 + np.sin(2 * np.pi * 0.9 * TIME))
    dirty = changed(sound, 0, 0, lambda x: x + 1.5 * x.std() * drifting)
    assert any("still 50 Hz hum" in w for w in clean_emg(dirty).warnings)


def test_movement_is_seen_below_20_hz(sound):
    moved = changed(sound, 2, 1, lambda x: x + 2 * x.std() * np.sin(2 * np.pi * 3 * TIME))
    quality = emg_quality(moved)
    assert quality.moving.tolist() == [False, True]
    # 4 / 2 over 1 + 4 / 2
    assert quality.artefact[2, 1] == pytest.approx(2 / 3, abs=0.05)
    assert verdicts(moved)["artefact"] == "warning"


def test_snr_is_power_of_the_muscle_over_power_at_rest(emg_recording):
    """Set to 10 dB; 5 s of EMG know a power to 1/sqrt(2 W T), some 1.5 %: 0.1 dB."""
    sd = 0.2 * np.array([4e-4, 6e-4]) * np.sqrt(np.pi / 2)
    for muscle in (0, 1):
        recording = emg_recording(
            np.full((2, 5000, 2), 0.2), seed=14, noise_V=float(sd[muscle]) / 10**0.5, rest=True
        )
        assert emg_quality(recording).snr_db[:, muscle] == pytest.approx([10, 10], abs=0.5)


def test_a_muscle_that_never_rises_over_rest_is_warned_of(emg_recording):
    noise = 0.02 * 4e-4 * 1.25
    weak = emg_recording(np.full((2, 5000, 2), [0.02, 0.2]), seed=15, noise_V=noise, rest=True)
    snr = next(check for check in check_emg(weak) if check.name == "SNR")
    assert snr.verdict == "warning"
    assert snr.message.startswith("biceps: at most ")


@pytest.mark.parametrize("mvc", [0.0, -1e-4, np.nan])
def test_a_maximum_that_is_none_is_refused_with_its_column(sound, mvc):
    table = sound.trials.copy()
    table.loc[1, "mvc_triceps_V"] = mvc
    with pytest.raises(InputError, match=r"trial 2: maximum contraction of triceps is .*mvc_trice"):
        refuse_emg(replace(sound, trials=table))


def test_a_missing_maximum_is_refused_with_its_column(sound):
    lacking = replace(sound, trials=sound.trials.drop(columns="mvc_biceps_V"))
    with pytest.raises(InputError, match="no maximum contraction of biceps: column mvc_biceps_V"):
        refuse_emg(lacking)


def test_rates_too_slow_for_emg(sound):
    with pytest.raises(InputError, match="200 Hz: too slow"):
        refuse_emg(replace(sound, sample_rate_hz=200.0))
    assert verdicts(replace(sound, sample_rate_hz=600.0))["rate"] == "warning"


def test_no_emg_and_normalised_emg_are_refused(sound):
    with pytest.raises(InputError, match="holds no EMG"):
        emg_quality(replace(sound, emg=None, muscles=()))
    with pytest.raises(InputError, match="normalised"):
        emg_quality(replace(sound, emg_unit="normalised"))


@pytest.mark.parametrize("band", [(20, 500), (20, 600), (0, 450), (450, 20)])
def test_bands_that_are_none(band):
    with pytest.raises(InputError, match="EMG band"):
        check_band(*band, RATE)


def test_short_trials_are_looked_at_too(emg_recording):
    """200 ms: coarse spectrum, no crash, no false alarm that refuses."""
    quality, _ = refuse_emg(emg_recording(np.full((2, 200, 2), 0.2), seed=16))
    assert np.isfinite(quality.hum).all()
    assert np.isfinite(quality.artefact).all()
