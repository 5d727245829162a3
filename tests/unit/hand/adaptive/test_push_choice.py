"""Where pushes go: against theory, against trying everything, and where a reflex hides."""

import numpy as np
import pytest

from armimpedance.hand.adaptive import Aim, PushingRobot
from armimpedance.hand.adaptive.choice import ExperimentSoFar, needed
from armimpedance.hand.adaptive.menu import menu_of, spread_evenly
from armimpedance.hand.adaptive.next_trials import best_session
from armimpedance.hand.adaptive.so_far import SoFar
from armimpedance.hand.adaptive.target import targets_of
from armimpedance.hand.planning import (
    SHAPES,
    Limits,
    PlannedArm,
    PlannedMotion,
    Profile,
    Servo,
    Setting,
    noise_named,
)
from armimpedance.hand.still import knowledge_by_trial

LIMB = np.array(
    [[[1.9, -0.6], [-0.6, 1.2]], [[9.0, -6.0], [-6.0, 14.0]], [[105.0, -60.0], [-60.0, 210.0]]]
)
DESIGNED = Profile(SHAPES.named("designed"), 0.005, 0.3)
BUMP = Profile(SHAPES.named("minimum_jerk"), 0.005, 0.3)


def measured(limb=LIMB, name="relaxed", trials=16, profile=DESIGNED):
    """A condition of which so many pushes along eight directions were done, without chance."""
    noise = noise_named()
    motion = PlannedMotion(Setting(PlannedArm(limb), noise), profile)
    angle = np.arange(trials) * np.pi / 4
    units = np.column_stack([np.cos(angle), np.sin(angle)])
    window = motion.trials(units)
    known = sum(
        knowledge_by_trial(window, motion.weight, limb.ravel())[1:],
        knowledge_by_trial(window, motion.weight, limb.ravel())[0],
    )
    none = np.zeros(len(known.names))
    return SoFar(
        name=name,
        parameters=limb.ravel(),
        knowledge=known,
        noise=noise,
        seen=none,
        seen_error=known.expected,
        trials=trials,
        sample_rate_hz=1000.0,
    )


def session(aim, *known, profile=DESIGNED):
    """Conditions with pushes of one course to choose from."""
    menus = tuple(menu_of(one, profile, Servo()) for one in known)
    return ExperimentSoFar(tuple(known), menus, tuple(targets_of(aim, known)))


def test_pushes_go_along_the_soft_axis_in_the_share_that_theory_gives():
    # sd of K_ii falls with the root of its share w_i: K_xx w_x^.5 = K_yy w_y^.5
    one = session(Aim(k_part=0.01), measured())
    counts = needed(one, 5000).counts[0] + 2.0
    lines = one.menus[0].lines
    share = (counts @ lines**2)[0] / counts.sum()
    expected = (1 / 105**2) / (1 / 105**2 + 1 / 210**2)
    assert share == pytest.approx(expected, abs=0.06)


def test_no_two_lines_do_better_than_the_choice():
    one = session(Aim(k_part=0.03), measured())
    need = needed(one, 5000)
    menu, start = one.menus[0], one.known[0]
    p, wish = 12, 0.03 * np.array([105.0, 210.0])

    def enough(counts):
        total = start.knowledge.information + np.tensordot(counts, menu.information, axes=1)
        variance = np.diag(np.linalg.inv(total[:p, :p]))[[8, 11]] * 1.03**2
        return (1.98 * np.sqrt(variance) <= wish).all()

    best = min(
        x + y
        for x in range(0, 200, 2)
        for y in range(0, 100, 2)
        if enough(x * np.eye(8)[0] + y * np.eye(8)[4])
    )
    assert need.enough
    assert need.trials <= 1.1 * best + 2


def test_chosen_pushes_are_two_thirds_of_those_spread_evenly():
    chosen = session(Aim(k_part=0.02), measured())
    even = ExperimentSoFar(chosen.known, tuple(map(spread_evenly, chosen.menus)), chosen.targets)
    ratio = needed(chosen, 5000).trials / needed(even, 5000).trials
    # .5 / .8 in the limit
    assert 0.55 < ratio < 0.75


def test_half_the_interval_needs_four_times_the_pushes():
    rough, fine = (needed(session(Aim(k_part=p), measured()), 9000).trials for p in (0.04, 0.02))
    assert (fine + 16) / (rough + 16) == pytest.approx(4, rel=0.15)


def test_of_two_conditions_the_softer_one_gets_the_pushes():
    soft, stiff = measured(), measured(LIMB * np.array([1, 2, 4])[:, None, None], "tense")
    need = needed(session(Aim(k_part=0.05), soft, stiff), 1000)
    assert need.counts[0].sum() > 3 * need.counts[1].sum()


def test_a_smaller_difference_needs_more_pushes_of_both():
    known = (measured(), measured(LIMB * np.array([1, 1, 1.2])[:, None, None], "tense"))
    small, large = (
        needed(session(Aim(difference_part=p, between=("relaxed", "tense")), *known), 9000)
        for p in (0.1, 0.2)
    )
    assert small.enough
    assert large.enough
    assert small.trials > 3 * large.trials
    assert min(count.sum() for count in small.counts) > 0


def test_a_wish_that_cannot_be_met_says_so():
    need = needed(session(Aim(k_part=0.001), measured()), 40)
    assert not need.enough
    assert need.trials == 40
    assert need.parts.max() > 1


def test_where_a_reflex_hides_in_bumps_the_next_pushes_exclude_it():
    bumps = measured(profile=BUMP, trials=40)
    robot = PushingRobot(Limits(), shapes=("minimum_jerk", "designed"))
    start = ExperimentSoFar((bumps,), (), tuple(targets_of(Aim(k_part=0.08), (bumps,))))
    chosen, need = best_session(start, robot, 1000, {})
    assert chosen.menus[0].profile.shape.name == "designed"
    again, more = best_session(start, PushingRobot(course=BUMP), 1000, {})
    assert more.trials > 3 * need.trials
