"""Plans in space: what a pilot foretells, and that six directions tell what twenty-six do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.hand.planning import PlannedMotion, Profile, Servo, pilot_of, precision
from armimpedance.hand.planning.pilot import Pilot
from armimpedance.hand.planning.shapes import SHAPES
from armimpedance.hand.still import estimate
from armimpedance.hand.still.bound import bound
from armimpedance.hand.still.modal import ModalEquation
from manipulandum_sim.space import SpaceCondition, simulate_space, sphere_directions


@pytest.fixture(scope="module")
def pilot(held) -> Pilot:
    """Of a noisy sensor (1 N): an axis takes many trials."""
    recording, _ = held
    noise = np.random.default_rng(901).normal(0, 1.0, recording.force.shape)
    return pilot_of(replace(recording, force=recording.force + noise))


def planned(pilot: Pilot, shape: str, **servo: float) -> PlannedMotion:
    setting = replace(pilot.setting, servo=Servo(20_000.0, 2.0, **servo))
    return PlannedMotion(setting, Profile(SHAPES.named(shape), 0.005, 0.3))


@pytest.mark.study
def test_six_directions_tell_what_twenty_six_do(pilot):
    motion = planned(pilot, "biphasic")
    setting, modes = motion.setting, motion.setting.modes(0.3)
    covariance = setting.covariance(motion.displacement, 0.3)
    moved = np.einsum("ta,ais->tis", sphere_directions(26), motion.displacement)
    parts = [moved @ part.T for part in (modes.second, modes.first, modes.smooth)]
    many = ModalEquation(modes, setting.lags(0.3), np.stack(parts, axis=1), 0 * parts[0])
    expected = 26 * bound(many, covariance)
    np.testing.assert_allclose(precision(motion).bound, expected, rtol=1e-6, atol=1e-9)


@pytest.mark.study
def test_a_pilot_foretells_the_intervals_of_another_shape():
    pilot = pilot_of(simulate_space([SpaceCondition()], seed=901, sets=2)[0])
    recording, _ = simulate_space(
        [SpaceCondition()], seed=905, sets=1, disturbance="designed", amplitude_m=0.005
    )
    (found,) = estimate(recording)
    expected = precision(planned(pilot, "designed"))
    sd = np.sqrt(np.diag(expected.covariance) / len(recording.trials)).reshape(3, 3, 3)
    # standard errors of 27 elements from 26 trials, each known to some 14 %, together to some 5 %
    assert 0.8 < np.sqrt(np.mean((found.sd / sd) ** 2)) < 1.2


def test_a_longest_axis_is_known_the_better_the_more_trials(pilot):
    found = precision(planned(pilot, "designed"))
    needed = found.trials_for_orientation(np.radians(2.0))
    assert needed is not None
    assert needed % 6 == 0
    assert found.orientation(needed) <= np.radians(2.0) < found.orientation(needed - 6)


def test_an_elbow_that_is_not_held_is_told(held, soft):
    assert not pilot_of(held[0]).warnings
    free, _ = soft
    assert pilot_of(free).warnings
    assert pilot_of(replace(free, trials=free.trials.drop(columns="elbow"))).warnings
