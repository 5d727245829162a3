"""What a simulated recording must hold, and that its trials do not depend on each other."""

import sys

import numpy as np
import pytest

from armimpedance.core.conventions import MUSCLES
from armimpedance.core.errors import InputError
from manipulandum_sim.hand.disturbances import find_disturbance
from manipulandum_sim.hand.experiments import EXPERIMENTS
from manipulandum_sim.hand.noise import NOMINAL, draw, quantised, voluntary_force
from manipulandum_sim.hand.rig import Reflex
from manipulandum_sim.hand.robot import IDEAL, Servo
from manipulandum_sim.hand.simulate import simulate, simulate_condition
from manipulandum_sim.hand.subjects import SUBJECTS
from manipulandum_sim.hand.truth import Truth

QUIET = {"noise": "none", "emg": False}


def trial(recording, row):
    """Samples of a trial: lag since the onset, position, force, unit vector."""
    s, table = recording.samples_of(row), recording.trials.iloc[row]
    angle = np.deg2rad(table["direction_deg"])
    lag = recording.time_s[s] - table["onset_s"]
    return lag, recording.position[s], recording.force[s], np.array([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("servo", [IDEAL, Servo()])
def test_a_posture_and_its_force_are_held_before_the_onset(servo):
    names = [c.name for c in EXPERIMENTS["force"].conditions(SUBJECTS["A"])][::5]
    recording, truth = simulate("force", seed=1, sets=1, servo=servo, conditions=names, **QUIET)
    for row in range(0, recording.n_trials, 3):
        n = truth.index(recording.trials["condition"][row])
        lag, x, f, _ = trial(recording, row)
        np.testing.assert_allclose(x[lag <= 0], truth.hand[[n] * (lag <= 0).sum()], atol=1e-9)
        np.testing.assert_allclose(f[lag <= 0] - truth.force[n], 0, atol=1e-6)


@pytest.mark.study
def test_without_force_feedforward_the_hand_stands_off():
    servo = Servo(5_000.0, force_feedforward=False)
    name = "force_2.0_x9.8N_000deg"
    recording, truth = simulate("force", seed=1, sets=1, servo=servo, conditions=[name], **QUIET)
    lag, x, _, _ = trial(recording, 0)
    # 19.6 N by the hand on a spring of 5 kN/m; the arm itself softens it a little
    off = x[np.searchsorted(lag, -0.01)] - truth.hand[0]
    assert 0.9 * 19.6 / 5_000 < off[0] < 19.6 / 5_000


@pytest.mark.study
@pytest.mark.parametrize("reflex", [None, Reflex(0.5, 0.04)])
def test_the_ideal_servo_is_the_limit_of_stiff_ones(reflex):
    settings = {"seed": 2, "sets": 1, "reflex": reflex, **QUIET}
    ideal, _ = simulate_condition(servo=IDEAL, **settings)
    errors = []
    for stiffness in (5e3, 2e4, 8e4):
        driven, _ = simulate_condition(servo=Servo(stiffness), **settings)
        assert np.abs(driven.position - ideal.position).max() < 5 / stiffness
        errors.append(np.abs(driven.force - ideal.force).max() / np.abs(ideal.force).max())
    # what the servo lags behind makes a force error that goes with 1/sqrt(stiffness)
    assert errors[0] > 1.8 * errors[1] > 1.8**2 * errors[2]
    assert errors[2] < 0.1


def test_small_exact_motions_return_the_truth():
    """Force on exact kinematics, by hand: M with the cast, B and K as the truth says."""
    recording, truth = simulate_condition(seed=3, sets=1, servo=IDEAL, amplitude_m=2e-5, **QUIET)
    shape, rows, y = find_disturbance("minimum_jerk"), [], []
    for row in range(recording.n_trials):
        lag, _, f, u = trial(recording, row)
        x, v, a = shape.profile(lag, 0.3, 2e-5)
        rows.append(np.stack([a * u[0], a * u[1], v * u[0], v * u[1], x * u[0], x * u[1]], axis=1))
        y.append(-f)
    solved = np.linalg.lstsq(np.concatenate(rows), np.concatenate(y), rcond=None)[0].T
    expected = [truth.M_e_with_handle[0], truth.B_e[0], truth.K_e[0]]
    np.testing.assert_allclose(solved, np.concatenate(expected, axis=1), rtol=1e-4)


def test_the_cast_is_felt_by_the_sensor_and_nowhere_else():
    with_cast, truth = simulate_condition(seed=1, sets=1, servo=IDEAL, **QUIET)
    without, _ = simulate_condition(seed=1, sets=1, servo=IDEAL, handle_mass_kg=0.0, **QUIET)
    lag, _, f, u = trial(with_cast, 0)
    a = find_disturbance("minimum_jerk").profile(lag, 0.3, 0.005)[2]
    np.testing.assert_allclose(f - trial(without, 0)[2], -0.164 * np.outer(a, u), atol=1e-12)
    assert (with_cast.handle_mass_kg, without.handle_mass_kg) == (0.164, 0.0)
    np.testing.assert_allclose(truth.M_e_with_handle - truth.M_e, [0.164 * np.eye(2)], atol=1e-12)


@pytest.mark.study
@pytest.mark.parametrize("servo", [IDEAL, Servo()])
def test_a_reflex_is_silent_until_its_delay(servo):
    settings = {"seed": 4, "sets": 1, "servo": servo, **QUIET}
    plain, _ = simulate_condition(**settings)
    reflex, truth = simulate_condition(reflex=Reflex(0.25, 0.055), **settings)
    for row in range(8):
        lag, _, f, _ = trial(plain, row)
        change = np.abs(trial(reflex, row)[2] - f).max(axis=1)
        assert change[lag < 0.055].max() < 1e-9
        assert change[(lag > 0.1) & (lag < 0.3)].max() > 0.05
    # a quarter of the muscles' stiffness: less than a quarter of all, as joints are passive too
    share = np.linalg.eigvals(np.linalg.solve(truth.K_e[0], truth.K_e_reflex[0]))
    assert ((share > 0.2) & (share < 0.25)).all()


def test_resolution_of_the_sensors():
    recording, _ = simulate_condition(seed=5, sets=1, servo=IDEAL, noise="sensor", emg=False)
    steps = recording.force / 0.05
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    for row in range(8):
        _, x, _, u = trial(recording, row)
        x = x / 20e-6
        np.testing.assert_allclose(x - x[0], np.round(x - x[0]), atol=1e-6)
        assert len(np.unique(np.round(x[:, 0] - x[0, 0]))) > 1 or abs(u[0]) < 0.1
    held = recording.joint_angles[recording.samples_of(0)]
    changes = np.flatnonzero(np.diff(held[:, 0]))
    assert (changes % 10 == 9).all()
    assert len(changes) > 50


def test_quantised_rounds_to_the_nearest_step():
    values = np.linspace(-1, 1, 101)
    assert np.abs(quantised(values, 0.05, 0.3) - values).max() <= 0.025 + 1e-12
    assert quantised(values, 0.0) is values


def test_voluntary_force_has_its_sd_and_its_time_constant():
    keys = [(7, t) for t in range(400)]
    draws = draw(0, keys, 1000)
    force = voluntary_force(NOMINAL, draws, 1000.0)
    assert force is not None
    tremor = NOMINAL.tremor**2 / 2
    # 800 independent series: the sd of a variance is sqrt(2/800) of it; 4 standard errors
    margin = 4 * np.sqrt(2 / 800)
    assert force[500].var() == pytest.approx(0.25**2 + tremor, rel=margin)
    # after .4 s (3.6 cycles of tremor) the slow part is correlated by 1/e
    lagged = np.mean(force[100] * force[500])
    expected = 0.25**2 / np.e + tremor * np.cos(2 * np.pi * 9 * 0.4)
    assert lagged == pytest.approx(expected, abs=4 * (0.25**2 + tremor) / np.sqrt(800))


def test_drift_changes_the_force_at_a_constant_rate():
    drifting = type(NOMINAL)("drift", drift_sd=0.003)
    recording, truth = simulate_condition(seed=6, sets=5, servo=IDEAL, noise=drifting, emg=False)
    rates = []
    for row in range(recording.n_trials):
        lag, _, f, _ = trial(recording, row)
        rest = lag < 0
        slope, offset = np.polyfit(lag[rest], f[rest], 1)
        np.testing.assert_allclose(f[rest], np.outer(lag[rest], slope) + offset, atol=1e-9)
        rates.append(slope)
    # force follows K (muscles' part, some 93 %) times a velocity of sd 3 mm/s; 4 standard errors
    velocity = np.linalg.solve(truth.K_e[0], np.transpose(rates))
    assert velocity.std() == pytest.approx(0.0028, rel=4 / np.sqrt(160))


def test_emg_is_activation_times_mvc():
    names = ["cocontraction_00", "cocontraction_30"]
    recording, truth = simulate(
        "cocontraction", seed=7, sets=1, conditions=names, servo=IDEAL, noise="none"
    )
    assert recording.muscles == MUSCLES
    assert recording.emg_unit == "V"
    rows = recording.trials["condition"] == "cocontraction_30"
    emg = recording.select(rows).emg
    mvc = recording.trials.loc[0, [f"mvc_{m}_V" for m in MUSCLES]].to_numpy(dtype=float)
    # 8 s of noise some 430 Hz wide: about 7,000 independent samples, relative sd of |N| .76
    measured = np.abs(emg).mean(axis=0) / mvc
    np.testing.assert_allclose(measured, truth.activation[1], rtol=4 * 0.76 / np.sqrt(7000))
    assert np.abs(recording.select(~rows).emg[:, 4:]).max() < 2e-5
    spectrum = np.abs(np.fft.rfft(emg[:1000, 4])) ** 2
    assert spectrum[:10].sum() < 0.02 * spectrum.sum()


def test_trial_table_says_what_was_done():
    names = [c.name for c in EXPERIMENTS["force"].conditions(SUBJECTS["A"])]
    assert len(names) == 26
    recording, truth = simulate(
        "force", seed=8, sets=6, servo=IDEAL, conditions=names[::4], **QUIET
    )
    table = recording.trials
    assert recording.n_trials == 7 * 6 * 8
    assert table["trial"].is_unique
    for _, group in table.groupby(["condition", "set"]):
        assert sorted(group["direction_deg"]) == list(np.arange(0, 360, 45))
    orders = {tuple(g["direction_deg"]) for _, g in table.groupby(["condition", "set"])}
    # 42 of 40,320 orders: hardly ever two alike
    assert len(orders) > 40
    assert table["onset_s"].between(0.3, 0.5).all()
    np.testing.assert_allclose(table["end_s"] - table["onset_s"], 0.3)
    assert (table["day"] == np.where(table["set"] <= 5, 1, 2)).all()
    index = [truth.index(c) for c in table["condition"]]
    np.testing.assert_allclose(
        table[["target_force_x_N", "target_force_y_N"]], truth.force[index], atol=1e-12
    )
    np.testing.assert_allclose(
        table[["q_shoulder_rad", "q_elbow_rad"]], truth.posture[index], atol=1e-9
    )
    ends = recording.time_s[recording.offsets[1:] - 1]
    np.testing.assert_allclose(ends - table["end_s"], 0.3, atol=1e-9)
    for row in range(0, recording.n_trials, 31):
        lag, x, _, u = trial(recording, row)
        peak = x[np.searchsorted(lag, 0.15 - 1e-9)] - x[0]
        np.testing.assert_allclose(peak, 0.005 * u, atol=1e-9)


@pytest.mark.study
@pytest.mark.parametrize("servo", [IDEAL, Servo()])
def test_a_trial_does_not_depend_on_its_batch(servo, monkeypatch):
    settings = {"seed": 9, "servo": servo}
    both = ["force_0.5_x9.8N_045deg", "force_2.0_x9.8N_270deg"]
    whole, _ = simulate("force", sets=2, conditions=both, **settings)
    alone, _ = simulate("force", sets=1, conditions=both[1:], **settings)
    rows = (whole.trials["condition"] == both[1]) & (whole.trials["set"] == 1)
    same = whole.select(rows)
    monkeypatch.setattr(sys.modules["manipulandum_sim.hand.simulate"], "BLOCK", 27)
    blocks, _ = simulate("force", sets=2, conditions=both, **settings)
    for name in ("position", "force", "joint_angles", "emg", "time_s"):
        assert np.array_equal(getattr(same, name), getattr(alone, name)), name
        assert np.array_equal(getattr(whole, name), getattr(blocks, name)), name
    other, _ = simulate("force", sets=1, conditions=both[1:], seed=10, servo=servo)
    assert not np.array_equal(other.force[:500], alone.force[:500])


def test_repeats_are_their_own_draws_and_more_change_nothing():
    few, truth = simulate_condition(seed=1, sets=1, repeats=2, servo=IDEAL, emg=False)
    more, _ = simulate_condition(seed=1, sets=1, repeats=3, servo=IDEAL, emg=False)
    assert list(more.trials["condition"].unique()) == ["repeat_000", "repeat_001", "repeat_002"]
    assert truth.conditions == ("nominal",)
    assert np.array_equal(few.force, more.force[: len(few.force)])
    noise = [trial(few, row)[2][:300] for row in (0, 8)]
    assert abs(np.corrcoef(np.ravel(noise[0]), np.ravel(noise[1]))[0, 1]) < 0.9


def test_subjects_visit_their_numbers_of_postures():
    for subject, count in (("A", 20), ("B", 11), ("C", 11), ("D", 11)):
        recording, truth = simulate(
            "postures", subject=subject, seed=0, sets=1, servo=IDEAL, **QUIET
        )
        assert len(truth.conditions) == count
        assert recording.n_trials == 8 * count
        assert recording.subject.id == subject


def test_truth_survives_its_file(tmp_path):
    _, truth = simulate_condition(seed=1, sets=1, servo=IDEAL, reflex=Reflex(), **QUIET)
    truth.write(tmp_path / "truth.json")
    back = Truth.read(tmp_path / "truth.json")
    assert [p.name for p in tmp_path.iterdir()] == ["truth.json"]
    assert back.conditions == truth.conditions
    assert back.reflex_delay_s == 0.055
    for name in ("K_e", "M_j", "activation", "curvature"):
        assert np.array_equal(getattr(back, name), getattr(truth, name))
    with pytest.raises(ValueError, match="read-only"):
        truth.K_e[0, 0, 0] = 0
    with pytest.raises(InputError, match="no truth for condition"):
        truth.index("elsewhere")
    for text in ("{", "[]", '{"conditions": ["a"]}'):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(InputError, match=r"bad\.json"):
            Truth.read(tmp_path / "bad.json")


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"experiment": "juggling"}, "no experiment 'juggling'"),
        ({"subject": "Z"}, "no simulated subject 'Z'"),
        ({"conditions": ["posture_99"]}, "posture_99"),
        ({"conditions": []}, "no condition"),
        ({"sets": 0}, "0 sets"),
    ],
)
def test_unknown_names_are_refused(settings, said):
    with pytest.raises(InputError, match=said):
        simulate(**{"experiment": "postures", "seed": 0, **settings})
    with pytest.raises(InputError, match="servo"):
        Servo(-1.0)
    with pytest.raises(InputError, match="reflex"):
        Reflex(delay_s=0.0)


@pytest.mark.study
def test_the_command_is_what_an_ideal_servo_does_and_changes_nothing_else():
    plain, _ = simulate_condition(seed=3, sets=1, servo=IDEAL, **QUIET)
    told, _ = simulate_condition(seed=3, sets=1, servo=IDEAL, command=True, **QUIET)
    assert plain.extra == {}
    command = np.column_stack([told.extra["x_command_m"], told.extra["y_command_m"]])
    np.testing.assert_allclose(command, told.position, atol=1e-12)
    assert np.array_equal(plain.position, told.position)
    assert np.array_equal(plain.force, told.force)
    soft, _ = simulate_condition(seed=3, sets=1, servo=Servo(5_000.0), command=True, **QUIET)
    np.testing.assert_array_equal(soft.extra["x_command_m"], told.extra["x_command_m"])
    assert np.abs(soft.position - command).max() > 1e-4
