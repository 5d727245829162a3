"""What is foretold of departures is what the fit finds: shifts, standard errors, allowances."""

import numpy as np
import pytest

from armimpedance.hand.planning import (
    SHAPES,
    PlannedArm,
    PlannedMotion,
    Profile,
    Servo,
    Setting,
    noise_named,
    precision,
)
from armimpedance.hand.still import Model, allowing, estimate, knowledge_by_trial
from armimpedance.hand.still.doubts.departures import largest_conditions
from armimpedance.hand.still.doubts.foretold import foretold_allowance
from armimpedance.hand.still.doubts.mixture import expected_numbers
from armimpedance.hand.still.doubts.model import ALL_COLUMNS
from armimpedance.numerics.signals import cut_windows
from manipulandum_sim.hand import Servo as SimulatedServo, simulate, simulate_condition
from manipulandum_sim.hand.robot import IDEAL

ROBOT_KG = 2.25


@pytest.fixture(scope="module")
def recording():
    rig = {"emg": False, "servo": IDEAL}
    return simulate("cocontraction", seed=1, sets=3, conditions=["cocontraction_10"], **rig)[0]


@pytest.fixture(scope="module")
def model(recording):
    return largest_conditions(recording)[0][1]


@pytest.mark.parametrize("column", ALL_COLUMNS)
def test_knowledge_holds_the_shift_and_error_that_the_fit_with_a_departure_has(model, column):
    known, at = model.knowledge(), ALL_COLUMNS.index(column)
    # the fit's rows hold noise, which a delay, the sharpest column, sees most
    part = 0.3 if column == "delay" else 0.05
    shift = model.shift(column)
    assert np.abs(known.shifts[at] - shift).max() < part * np.abs(shift).max()
    assert known.expected[at] == pytest.approx(model.departure(column).expected, rel=0.02)


def test_knowledge_adds_up_over_trials():
    arm = np.array([[[1.9, -0.6], [-0.6, 1.2]], [[9, -6], [-6, 14]], [[105, -60], [-60, 210]]])
    motion = PlannedMotion(
        Setting(PlannedArm(arm.astype(float))), Profile(SHAPES.named("biphasic"), 0.005, 0.3)
    )
    units = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    one = knowledge_by_trial(motion.trials(units), motion.weight, arm.ravel())
    both = one[0] + one[1] + one[2]
    assert both.trials == 3
    assert np.allclose(both.information, sum(each.information for each in one))
    twice = both.times(2)
    assert np.allclose(twice.covariance, both.covariance / 2)
    assert np.allclose(twice.expected, both.expected / np.sqrt(2))
    assert np.allclose(twice.shifts, both.shifts)


def test_the_allowance_falls_as_trials_exclude_departures_and_conditions_share_them():
    setting = Setting()
    motion = PlannedMotion(setting, Profile(SHAPES.named("minimum_jerk"), 0.005, 0.3))
    known = precision(motion, conditions=1).knowledge
    theta = setting.arm.parameters.ravel()
    one, more, beside = (
        foretold_allowance([known.times(n)] * c, [theta] * c)[0][8, 8]
        for n, c in ((40, 1), (400, 1), (40, 4))
    )
    assert more < 0.3 * one
    assert beside < one


def test_a_departure_that_is_not_likely_is_not_expected_of_more_trials():
    error = np.full(len(ALL_COLUMNS), 0.1)
    assert not expected_numbers(0.1 * np.ones(len(ALL_COLUMNS)), error).any()
    seen = np.zeros(len(ALL_COLUMNS))
    at = ALL_COLUMNS.index("reflex 0.055")
    seen[at] = 0.8
    found = expected_numbers(seen, error)
    assert 0.5 < found[at] < 0.8
    assert np.count_nonzero(found) == 1


@pytest.mark.parametrize(
    ("shape", "sets"),
    [
        ("designed", 4),
        pytest.param("minimum_jerk", 6, marks=pytest.mark.study),
        pytest.param("biphasic", 4, marks=pytest.mark.study),
    ],
)
def test_a_plan_foretells_the_intervals_that_estimate_prints(shape, sets):
    """Median ratio over 12 sessions: .05, and three standard errors of it."""
    rig = {"disturbance": shape, "servo": SimulatedServo(20_000.0), "emg": False}
    recording, truth = simulate_condition(seed=8, repeats=12, sets=sets, **rig)
    found = []
    for name in recording.trials["condition"].unique():
        rows = np.flatnonzero(recording.trials["condition"] == name)
        session = recording.select(rows)
        made = allowing(estimate(session), session, ("condition",))[0]
        low, high = (m[2].diagonal() for m in made.interval())
        found.append((high - low) / 2)
    handle = recording.handle_mass_kg * np.eye(2)
    arm = np.stack([truth.M_e[0] + handle, truth.B_e[0], truth.K_e[0]])
    setting = Setting(PlannedArm(arm), noise_named("nominal"), Servo(20_000.0, ROBOT_KG))
    motion = PlannedMotion(setting, Profile(SHAPES.named(shape), 0.005, 0.3))
    promised = precision(motion, conditions=1).half_widths(8 * sets)[2].diagonal()
    ratio = np.median(np.array(found) / promised, axis=0)
    # standard errors of n trials scatter by (2 n)^-1/2; the median of 12 by 1.25 / 12^1/2 of that
    chance = 3 * 1.25 / np.sqrt(12 * 2 * 8 * sets)
    assert np.abs(ratio - 1).max() < 0.05 + chance


def test_a_model_is_the_same_from_a_window(recording, model):
    again = Model.of(cut_windows(recording, np.arange(24)), "hand")
    assert np.array_equal(again.parameters, model.parameters)
    assert again.noise is not None
