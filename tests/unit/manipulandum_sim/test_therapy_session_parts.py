"""What a session in the therapy robot is made of: arms, references, people, plans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import GRAVITY_M_S2
from manipulandum_sim.therapy.arm import COM, GYRATION, LENGTH, MASS, pipe_arm, winter_arm
from manipulandum_sim.therapy.control import ASSIST, FREE, POSITION, friction_share, identified
from manipulandum_sim.therapy.device import therapy_device
from manipulandum_sim.therapy.effort import slow_torque
from manipulandum_sim.therapy.mockup import simulate_mockup
from manipulandum_sim.therapy.plan import Streams, TherapyOptions, trials_of
from manipulandum_sim.therapy.reference import MOVEMENTS, reference
from manipulandum_sim.therapy.session import simulate_therapy, simulate_therapy_many
from manipulandum_sim.therapy.subject import THERAPY_SUBJECTS, TherapySubject, find_therapy_subject
from manipulandum_sim.therapy.truth import true_contribution

LIMIT = therapy_device().torque_limit_Nm


def people(first):
    return [s for name, s in THERAPY_SUBJECTS.items() if name.startswith(first)]


def plan(subject="S1", seed=0, **options):
    return trials_of(find_therapy_subject(subject), TherapyOptions(**options), seed, LIMIT)


def test_an_arm_has_the_moments_of_its_three_segments():
    mass, height = 70.0, 1.75
    arm = winter_arm(mass, height)
    m, length = mass * np.array(MASS), height * np.array(LENGTH)
    centres = np.array([0.0, length[0], length[0] + length[1]]) + np.array(COM) * length
    assert arm.level_kgm == pytest.approx(m @ centres)
    own = m * (np.array(GYRATION) * length) ** 2
    assert arm.inertia_level_kgm2 == pytest.approx(own.sum() + m @ centres**2)
    assert arm.heavier(1.1).level_kgm == pytest.approx(1.1 * arm.level_kgm)


def test_the_pipes_weigh_what_the_source_says():
    pipes = pipe_arm()
    assert GRAVITY_M_S2 * pipes.level_kgm == pytest.approx(10.66, abs=0.005)
    assert pipes.inertia_level_kgm2 == pytest.approx(0.450, rel=0.01)


@pytest.mark.parametrize("ramp", [0.0, 0.4])
def test_a_reference_moves_as_its_derivatives_say(ramp):
    asked = reference(list(MOVEMENTS.values()))
    asked = replace(asked, ramp_s=np.full(3, ramp))
    time, h = np.linspace(0.0, 6.0, 601), 1e-5
    for t in time:
        place, speed, acceleration = asked.course(t)
        before, after = asked.course(t - h), asked.course(t + h)
        np.testing.assert_allclose((after[0] - before[0]) / (2 * h), speed, atol=1e-8)
        # the jerk of a minimum-jerk movement jumps at its ends
        np.testing.assert_allclose((after[1] - before[1]) / (2 * h), acceleration, atol=1e-4)
        assert (np.abs(place) <= np.abs(asked.size) * (1 + 1e-12)).all()
    np.testing.assert_allclose(asked.course(6.0)[0], asked.size, rtol=1e-12)


def test_references_last_as_long_as_the_source_says():
    asked = reference([MOVEMENTS["elevation"], MOVEMENTS["horizontal"]])
    np.testing.assert_allclose(asked.duration_s, [3.25, 4.5])
    np.testing.assert_allclose(np.rad2deg(asked.start[:, 0]), [45.0, 60.0])


def test_compensated_friction_is_odd_flat_at_rest_and_never_all():
    v = np.linspace(-2, 2, 401)
    share = friction_share(v)
    np.testing.assert_allclose(share, -share[::-1], atol=1e-15)
    assert np.abs(share).max() <= 1
    slope = friction_share(np.array([1e-6])) / 1e-6
    assert slope[0] < 0.01
    assert (np.diff(share) >= 0).all()


def test_the_controllers_model_is_about_one_per_cent_off():
    true = therapy_device()
    rng = np.random.default_rng(0)
    models = [identified(true, rng) for _ in range(200)]
    for ratios in (
        [m.friction.coulomb[0] / true.friction.coulomb[0] for m in models],
        [m.skeleton.mass_kg / true.skeleton.mass_kg for m in models],
        [m.spring.stiffness / true.spring.stiffness for m in models],
    ):
        # sd of a standard deviation of 200 draws: 5 %
        assert np.std(ratios) == pytest.approx(0.01, rel=4 / np.sqrt(400))


@pytest.mark.parametrize(
    ("first", "k", "q"), [("S", (4.79, 1.85), (1.12, 0.22)), ("P", (10.36, 2.40), (0.84, 0.31))]
)
def test_elevation_columns_have_table_4s_means(first, k, q):
    table = np.array([[s.stiffness[0], s.rest_rad[0]] for s in people(first)])
    np.testing.assert_allclose(table.mean(axis=0), [k[0], q[0]], atol=0.006)
    np.testing.assert_allclose(table.std(axis=0, ddof=1), [k[1], q[1]], atol=0.006)


def test_patients_shares_are_the_sources():
    shares = 100 * np.array([s.active_share for s in people("P")])
    assert shares.mean() == pytest.approx(51.7, abs=1)
    assert shares.std(ddof=1) == pytest.approx(44.2, abs=2)
    assert find_therapy_subject("P6").active_share < 0


def test_a_session_is_what_was_asked():
    able, patient = plan("S1"), plan("P2")
    assert [len(able), len(patient)] == [24, 18]
    assert sum(len(plan(name)) for name in THERAPY_SUBJECTS) == 414
    assert "half_active" not in {trial.condition for trial in patient}
    modes = {(t.subject.id, t.condition): t.mode for t in able + patient}
    assert modes["S1", "passive"] == modes["P2", "resistive"] == POSITION
    assert modes["S1", "active"] == FREE
    assert modes["P2", "active"] == modes["S1", "half_active"] == ASSIST
    assert {t.movement.name for t in plan(movements=("lowering",))} == {"lowering"}
    assert all(t.share == 0.3 for t in plan(conditions=("half_active",), share=0.3))


def test_mass_and_repetitions_vary_by_what_is_said():
    stated = find_therapy_subject("S1").stated_arm.level_kgm
    factors = [plan(seed=seed)[0].arm.level_kgm / stated for seed in range(200)]
    assert np.std(factors) == pytest.approx(0.03, rel=4 / np.sqrt(400))
    assert plan(mass_sd=0.0)[0].arm.level_kgm == pytest.approx(stated)
    k = np.array([t.k for t in plan(repetitions=100, conditions=("passive",))])
    spread = k.std(axis=0) / find_therapy_subject("S1").stiffness
    np.testing.assert_allclose(spread, 0.02, rtol=4 / np.sqrt(400))
    steady = plan(noise="none")
    assert all((t.k == steady[0].k).all() for t in steady)


def test_a_trunk_that_moves_changes_horizontal_stiffness_alone():
    for name in ("S4", "P1"):
        trials = plan(name, noise="none", conditions=("passive",))
        k, rest = (np.array([getattr(t, part) for t in trials]) for part in ("k", "rest_rad"))
        assert np.ptp(k[:, 1]) > k[:, 1].mean()
        assert np.ptp(rest[:, 1]) > 1.0
        assert np.ptp(k[:, 0]) == np.ptp(rest[:, 0]) == 0


def test_a_resistance_leaves_the_motor_room():
    for name, subject in THERAPY_SUBJECTS.items():
        for trial in plan(name, conditions=("resistive",)):
            axis = trial.movement.axis
            assert 0 < trial.resistance_Nm < 0.7 * LIMIT[axis]
            ends = np.deg2rad([trial.movement.start_deg[axis], trial.movement.to_deg])
            passive = subject.stiffness[axis] * (ends - subject.rest_rad[axis])
            assert trial.resistance_Nm + np.abs(passive).max() < 0.75 * LIMIT[axis]


def test_a_rest_angle_can_be_put_in_the_middle():
    for trial in plan("S4", noise="none", rest_at_middle=True):
        assert trial.rest_rad[1] == pytest.approx(np.pi / 4)
        assert trial.rest_rad[0] == find_therapy_subject("S4").rest_rad[0]


def test_draws_depend_on_the_trial_alone():
    whole = plan(repetitions=3)
    part = plan(repetitions=2, conditions=("active",), movements=("horizontal",))
    same = [t for t in whole if (t.movement.name, t.condition) == ("horizontal", "active")]
    for a, b in zip(part, same, strict=False):
        assert (a.delay_s, a.pace, a.miss_rad) == (b.delay_s, b.pace, b.miss_rad)
        np.testing.assert_array_equal(a.k, b.k)
    assert plan("S2")[0].stream("unsteady").random() != whole[0].stream("unsteady").random()


def test_the_unsteady_torque_has_its_sd_and_its_time():
    draws = slow_torque(np.random.default_rng(1), 400_000, np.array([0.5, 2.0]), 0.8, 1000.0)
    # 400 s of a time constant of .8 s: 250 independent draws
    np.testing.assert_allclose(draws.std(axis=0), [0.5, 2.0], rtol=4 / np.sqrt(2 * 250))
    later = (draws[800:] * draws[:-800]).mean(axis=0) / draws.var(axis=0)
    np.testing.assert_allclose(later, np.exp(-1), atol=4 / np.sqrt(250))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"subject": "X9"}, "X9"),
        ({"seed": -1}, "seed -1"),
        ({"noise": "loud"}, "loud"),
        ({"conditions": ("asleep",)}, "asleep"),
        ({"conditions": ()}, "conditions"),
        ({"movements": ("walking",)}, "walking"),
        ({"repetitions": 0}, "0 repetitions"),
        ({"repetitions": 2.5}, "2.5 repetitions"),
        ({"speed_deg_s": 0.0}, "0.0 deg/s"),
        ({"speed_deg_s": np.nan}, "nan deg/s"),
        ({"share": -0.1}, "share of -0.1"),
        ({"share": np.nan}, "share of nan"),
        ({"mass_sd": 3.0}, "mass_sd 3.0"),
        ({"inertia_compensation": 1.0}, "inertia_compensation"),
        ({"subject": "P1", "conditions": ("half_active",)}, "nothing to do"),
    ],
)
def test_what_makes_no_session_is_refused(arguments, message):
    with pytest.raises(InputError, match=message) as caught:
        simulate_therapy(**arguments)
    assert "\n" not in str(caught.value)


def test_bad_people_and_mockups_are_refused():
    good = find_therapy_subject("S1")
    with pytest.raises(InputError, match="negative stiffness"):
        replace(good, stiffness=np.array([-1.0, 1.0]))
    with pytest.raises(InputError, match="active share"):
        replace(good, active_share=np.nan)
    with pytest.raises(InputError, match="twice"):
        simulate_therapy_many(["S1", "S1"])
    with pytest.raises(InputError, match="a body of"):
        simulate_therapy(subject=TherapySubject("baby", 4.0, 0.5, np.ones(2), np.ones(2)))
    with pytest.raises(InputError, match="0 repetitions"):
        simulate_mockup(repetitions=0)
    with pytest.raises(InputError, match="loud"):
        simulate_mockup(noise="loud")
    with pytest.raises(InputError, match="seed"):
        Streams(-1, "S1")


def test_a_true_share_is_that_of_the_arm_whatever_else_is_moved():
    user, need, beside = np.random.default_rng(8).standard_normal((3, 200))
    for share, other in ((0.4, 0.0), (1.0, -2.0), (-0.3, 0.7)):
        found = true_contribution(share * need + other * beside, need, beside)
        assert found.share == pytest.approx(100 * share)
    found = true_contribution(user, need, beside)
    # what least squares leave is at right angles to both torques
    left = need - (need @ beside) / (beside @ beside) * beside
    assert (user - found.share / 100 * need) @ left == pytest.approx(0, abs=1e-9)
    alone = true_contribution(user, need, 0 * beside)
    assert alone.share == pytest.approx(alone.projection)
    assert np.isnan(true_contribution(user, need).share)
