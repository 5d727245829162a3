"""Crosstalk between electrodes, and a law that is not straight: found, taken out, named."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.records import Recording
from armimpedance.joint.elbow.emg.crosstalk import Crosstalk
from armimpedance.joint.elbow.emg.law import fit_emg_law, fit_law
from armimpedance.joint.elbow.emg.roles import check_names
from armimpedance.joint.elbow.show import emg_law, law_text
from manipulandum_sim.elbow import Electrodes, raw_emg, simulate_elbow

TRUE = np.array([1.0, 42.0, 40.0])
LEVELS = np.array(
    [
        *((0.06, 0.03), (0.11, 0.09), (0.16, 0.16)),
        *((0.10, 0.02), (0.17, 0.02), (0.02, 0.10), (0.02, 0.17)),
    ]
)
MVC_V = np.array([4e-4, 6e-4])
SAMPLES = 4000
RECORDS = 15


def bent(a: np.ndarray) -> np.ndarray:
    """The same as `a` at 8 % of the maximum, half of it saturated at 4 %."""
    return 0.08 * (1 - np.exp(-a / 0.05)) / (1 - np.exp(-1.6))


def electrodes(seed: int, gain=(0.0, 0.0), together: float = 0.0) -> Recording:
    """Raw EMG of 14 trials; `together` is the correlation of the muscles' own carriers."""
    rng = np.random.default_rng([82, seed])
    silent = Electrodes(noise_V=3e-6, hum_V=2e-6, artefact=0.0)
    parts = []
    for levels in np.tile(LEVELS, (2, 1)):
        course = np.broadcast_to(levels, (SAMPLES, 2))
        own = raw_emg(rng, course, MVC_V, np.zeros(SAMPLES), silent, converted=False)
        # motor units that fire in step: a carrier that both muscles have
        both = raw_emg(
            rng, np.ones((SAMPLES, 1)), np.ones(1), np.zeros(SAMPLES), silent, converted=False
        )
        own = np.sqrt(1 - together) * own + np.sqrt(together) * both * levels * MVC_V
        parts.append(own @ np.array([[1.0, gain[1]], [gain[0], 1.0]]))
    table = pd.DataFrame({"trial": range(1, len(parts) + 1), "condition": "held"})
    for muscle, mvc in zip(("biceps", "triceps"), MVC_V, strict=True):
        table[f"mvc_{muscle}_V"] = mvc
    total = SAMPLES * len(parts)
    return Recording(
        kind="joint",
        sample_rate_hz=1000.0,
        trials=table,
        offsets=SAMPLES * np.arange(len(parts) + 1),
        time_s=np.tile(np.arange(SAMPLES) / 1000, len(parts)),
        position=np.zeros((total, 1)),
        force=np.zeros((total, 1)),
        emg=np.vstack(parts),
        muscles=("biceps", "triceps"),
        perturbation="stochastic",
        torque="interaction",
    )


@pytest.mark.parametrize("gain", [(0.1, 0.2), (-0.15, 0.05)])
def test_gains_are_found_within_their_errors_and_taken_out(gain):
    scores = []
    for seed in range(3):
        recording = electrodes(seed, gain)
        heard = Crosstalk.of(recording)
        assert heard.seen
        scores.append((heard.gain - gain) / np.sqrt(np.diag(heard.covariance)))
    # mean square of six normal scores: 1 +- .6
    assert np.mean(np.square(scores)) < 3
    clean = electrodes(2)
    error = heard.own(recording).emg - clean.emg
    assert np.sqrt((error**2).mean()) < 0.02 * clean.emg.std()


@pytest.mark.parametrize("together", [0.0, 0.1])
def test_muscles_that_are_driven_together_are_no_crosstalk(together):
    found = [Crosstalk.of(electrodes(seed, together=together)) for seed in (10, 11)]
    assert not any(one.seen for one in found)
    finding = found[0].finding(("biceps", "triceps"))
    assert finding.verdict == "ok"
    assert float(finding.smallest.removesuffix(" %")) < 5


def test_amplitudes_alone_cannot_tell():
    recording = electrodes(1)
    heard = Crosstalk.of(replace(recording, emg=np.abs(recording.emg), emg_unit="normalised"))
    assert heard.covariance is None
    assert heard.finding(("biceps", "triceps")).verdict == "cannot tell"
    vague = Crosstalk(np.array([0.2, 0.1]), np.diag([0.04, 0.01]), 1e-6)
    assert not vague.seen
    assert vague.own(recording) is recording
    assert vague.finding(("biceps", "triceps")).verdict == "cannot tell"


def test_neighbouring_gains_scatter_as_the_gain_does():
    recording, C = electrodes(1), np.array([[4e-4, 2e-4], [2e-4, 2e-4]])
    crosstalk = Crosstalk(np.array([0.2, 0.1]), C, 1e-6)
    assert crosstalk.seen
    errors = []
    for own in crosstalk.neighbours(recording):
        # x = A s: what the electrodes saw over what is taken for the muscles' own
        A = np.linalg.lstsq(own.emg, recording.emg)[0].T
        errors.append(np.array([A[0, 1], A[1, 0]]) - crosstalk.gain)
    # sum_i e_i e_i^T = C (2, 2)
    assert np.einsum("ik,il->kl", errors, errors) == pytest.approx(C, rel=1e-6)


def points(seed: int, law=lambda a: a) -> dict[str, np.ndarray]:
    """Stiffness and amplitudes with errors at 21 points."""
    rng = np.random.default_rng([83, seed])
    a = np.tile(LEVELS, (3, 1)) * np.exp(0.05 * rng.standard_normal((21, 2)))
    K = TRUE[0] + law(a) @ TRUE[1:]
    return {
        "value": K * (1 + 0.03 * rng.standard_normal(21)),
        "value_sd": 0.03 * K,
        "amplitude": a * (1 + 0.02 * rng.standard_normal(a.shape)),
        "amplitude_sd": 0.02 * a,
    }


def test_a_straight_law_is_left_as_it_is():
    laws = [fit_law("K", **points(s), muscles=("F", "E")) for s in range(RECORDS)]
    limits = np.array([one.parameters.interval() for one in laws])
    # .95 of 45, less 3 standard errors
    assert ((limits[..., 0] < TRUE) & (limits[..., 1] > TRUE)).mean() > 0.85
    assert not any(one.checks[0].verdict == "warning" for one in laws)


def test_a_bent_law_is_named_and_its_intervals_hold_both_slopes():
    for seed in range(RECORDS):
        law = fit_law("K", **points(seed, bent), muscles=("F", "E"))
        assert law.checks[0].verdict == "warning"
        low, high = law.parameters.interval().T
        assert (low < TRUE).all()
        assert (high > TRUE).all()


def test_few_points_say_what_could_hide():
    given = {name: part[:6] for name, part in points(0).items()}
    few = fit_law("K", **given, muscles=("F", "E"))
    assert few.checks[0].verdict == "cannot tell"
    exact = fit_emg_law(TRUE[0] + LEVELS @ TRUE[1:], 0.0, LEVELS, 0.0)
    assert exact.stiffness.checks[0].verdict == "ok"


def from_amplitudes(seed: int, law=lambda a: a, heard: float = 0.0, points: int = 14):
    """The law of amplitudes that somebody else made, each with a part of the other muscle."""
    rng = np.random.default_rng([84, seed])
    a = np.tile(LEVELS, (points // 7, 1))
    K = TRUE[0] + law(a) @ TRUE[1:]
    seen = a + heard * a[:, ::-1] + 0.003 * rng.standard_normal(a.shape)
    value = K * (1 + 0.03 * rng.standard_normal(len(a)))
    return fit_emg_law(value, 0.03 * K, seen, 0.003)


@pytest.mark.parametrize("heard", [0.0, 0.1, 0.2])
def test_single_muscles_are_held_where_amplitudes_hide_crosstalk(heard):
    laws = [from_amplitudes(seed, heard=heard) for seed in range(40)]
    limits = np.array([one.stiffness.parameters.interval() for one in laws])
    assert ((limits[..., 0] < TRUE) & (limits[..., 1] > TRUE)).mean() > 0.95
    assert all("crosstalk" in one.warnings[0] for one in laws)


@pytest.mark.parametrize("heard", [0.0, 0.2])
def test_what_the_same_electrodes_predict_does_not_depend_on_crosstalk(heard):
    inside, half = [], []
    for seed in range(40):
        at = np.array([[0.12, 0.08], [0.05, 0.15]])
        law = from_amplitudes(seed, heard=heard).stiffness
        low, high = law.predict(at + heard * at[:, ::-1]).interval().T
        true = TRUE[0] + at @ TRUE[1:]
        inside.append((low < true) & (true < high))
        half.append((high - low) / 2 / true)
    assert np.mean(inside) > 0.9
    # seven levels twice, of 3 % each
    assert np.mean(half) < 0.05


def test_a_bend_that_few_points_cannot_show_is_held_by_the_interval():
    def saturating(a):
        return a / (1 + 3.3 * a)

    off = []
    for seed in range(40):
        law = from_amplitudes(seed, saturating).stiffness
        half = np.ptp(law.parameters.interval(), axis=1) / 2
        named = law.checks[0].verdict == "warning"
        off.append(not named and (np.abs(law.parameters.values - TRUE) > 1.5 * half).any())
    # three in four before it was allowed for, one in twenty with it
    assert np.mean(off) < 0.2


@pytest.mark.study
def test_a_session_with_crosstalk_gives_the_law_without():
    sessions = [
        simulate_elbow("cocontraction", seed=4, repetitions=1, duration_s=5.0, crosstalk=part)[0]
        for part in (0.0, 0.2)
    ]
    without, law = map(emg_law, sessions)
    assert law.checks[0].name == "crosstalk"
    assert law.checks[0].sentence in law.warnings
    assert law.stiffness.slopes == pytest.approx(without.stiffness.slopes, rel=0.02)
    assert "WARN  crosstalk" in law_text(law)
    # What is not known of the gains is in the intervals: of the same EMG without they are narrower.
    taken_out = emg_law(Crosstalk.of(sessions[1]).own(sessions[1]))
    assert taken_out.checks[0].verdict == "ok"
    assert (law.stiffness.parameters.sd > taken_out.stiffness.parameters.sd).all()


def held_torque(seed: int, pulls: tuple[float, float], swapped: bool = False) -> np.ndarray:
    """Mean torque and amplitudes (14, 3) at `LEVELS`, twice; .1 N m and 2 % of noise."""
    rng = np.random.default_rng([85, seed])
    levels = np.tile(LEVELS, (2, 1))
    torque = 2.0 + levels @ np.array(pulls) + 0.1 * rng.standard_normal(len(levels))
    seen = levels * (1 + 0.02 * rng.standard_normal(levels.shape))
    return np.column_stack([torque, seen[:, ::-1] if swapped else seen])


def test_exchanged_names_are_seen_by_the_torque_that_is_held():
    muscles = ("biceps", "triceps")
    for swapped, right, wrong in ((False, "ok", "warning"), (True, "warning", "ok")):
        verdicts = []
        for seed in range(RECORDS):
            torque, *seen = held_torque(seed, (50.0, -40.0), swapped).T
            law = fit_law("torque", torque, 0.0, np.transpose(seen), 0.002, muscles=muscles)
            verdicts.append(check_names(law).verdict)
        # a law that looks bent by chance, once in a hundred, has slopes of wide intervals
        assert verdicts.count(right) >= RECORDS - 2
        assert wrong not in verdicts
    # one electrode on a muscle of the other side; nothing held; names that say nothing
    for pulls, verdict in (((50.0, 40.0), "warning"), ((1.0, -1.0), "cannot tell")):
        torque, *seen = held_torque(0, pulls).T
        law = fit_law("torque", torque, 0.0, np.transpose(seen), 0.002, muscles=muscles)
        assert check_names(law).verdict == verdict
    unknown = replace(law, muscles=("m1", "m2"))
    assert check_names(unknown).verdict == "cannot tell"
    assert "m1" in check_names(unknown).message
