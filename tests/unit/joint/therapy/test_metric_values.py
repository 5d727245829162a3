"""The contribution of movements in closed form: values, flags, words, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from metric_bench import (
    MOVEMENTS,
    bench_arm,
    bench_elastic,
    bench_robot,
    counted,
    exact_robot,
    helping,
    known_exactly,
    motion,
    no_errors,
    reference,
    torques,
    true_arm,
)

from armimpedance.core.arrays import from_plain, to_plain
from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.share.of_movement import (
    contribution_of,
    running_contribution,
    sample_contribution,
)

SHARES = (-0.8, 0.0, 0.5, 1.0, 1.3)


@pytest.mark.parametrize("name", MOVEMENTS)
@pytest.mark.parametrize("share", SHARES)
def test_a_constant_share_is_what_every_form_gives(name, share):
    arm, robot = bench_arm(), bench_robot()
    seen = helping(motion(name), arm, share)
    whole = contribution_of(seen, robot, arm)
    # horizontal: tau_h sums up to nothing, and what (4) gives is rounding
    assert whole.ratio.valid == (name != "horizontal")
    if whole.ratio.valid:
        assert whole.ratio.percent == pytest.approx(100 * share, abs=1e-9)
    assert whole.projection.percent == pytest.approx(100 * share, abs=1e-9)
    assert whole.share.percent == pytest.approx(100 * share, abs=1e-9)
    assert whole.inertia_percent == pytest.approx(0, abs=1e-9)
    each = sample_contribution(seen, robot, arm)
    assert each.percent[each.valid] == pytest.approx(100 * share, abs=1e-6)
    assert each.valid.any()
    running = running_contribution(seen, robot, arm)
    assert running.percent[running.valid] == pytest.approx(100 * share, abs=1e-6)


@pytest.mark.parametrize("name", MOVEMENTS)
@pytest.mark.parametrize("moved", [0.4, 1.0])
def test_who_moves_the_robot_too_is_given_the_share_of_the_arm(name, moved):
    """A free arm carries itself and accelerates the robot: 100 %, which the projection misses."""
    arm, robot, m = bench_arm(), bench_robot(), motion(name)
    own = true_arm(m, arm, no_errors(len(m.q)))
    found = contribution_of(torques(m, arm, own + moved * m.inertia), robot, arm)
    assert found.share.percent == pytest.approx(100, abs=1e-8)
    assert found.inertia_percent == pytest.approx(100 * moved, abs=1e-8)
    if name == "horizontal":
        assert abs(found.projection.percent - 100) > 10


def test_an_arm_without_stiffness_cannot_be_told_from_the_robots_inertia():
    line = bench_elastic("horizontal", stiffness=1e-3, offset=0.0)
    arm = bench_arm(elastic=(bench_elastic("elevation"), line))
    found = contribution_of(helping(motion("horizontal"), arm, 1.0), bench_robot(), arm)
    assert not found.share.valid


def any_user(m, seed=0):
    rng = np.random.default_rng(seed)
    phase = np.linspace(0, np.pi, len(m.q))
    return sum(rng.normal() * np.sin((k + 1) * phase) for k in range(5)) + rng.normal()


def test_the_sums_are_those_of_the_source():
    arm, m = bench_arm(), motion("elevation")
    seen = torques(m, arm, any_user(m))
    moving = counted(seen)
    user, needs = moving.robot + moving.arm - moving.motor, moving.arm
    found = contribution_of(seen, bench_robot(), arm)
    assert found.ratio.percent == pytest.approx(100 * sum(user) / sum(needs))
    assert found.projection.percent == pytest.approx(100 * (user @ needs) / (needs @ needs))
    assert found.sum_ratio == pytest.approx(abs(sum(needs)) / sum(abs(needs)))
    assert found.mean_support_Nm == pytest.approx(np.mean(moving.motor - moving.robot))
    user, needs = seen.robot + seen.arm - seen.motor, seen.arm
    assert found.ratio_all_percent == pytest.approx(100 * sum(user) / sum(needs))
    each = sample_contribution(seen, bench_robot(), arm)
    assert each.percent == pytest.approx(100 * user / needs)


def test_the_order_of_samples_does_not_matter_and_what_the_robot_needs_neither():
    arm, m = bench_arm(), motion("elevation")
    seen = torques(m, arm, any_user(m))
    found = contribution_of(seen, bench_robot(), arm)
    order = np.random.default_rng(0).permutation(len(m.q))
    names = ("q", "qd", "motor", "robot", "rigid_arm", "elastic", "robot_inertia", "robot_gradient")
    mixed = replace(seen, **{name: getattr(seen, name)[order] for name in names})
    extra = 3 * np.sin(np.arange(len(m.q)) / 100)
    heavier = replace(seen, motor=seen.motor + extra, robot=seen.robot + extra)
    for other in (mixed, heavier):
        again = contribution_of(other, bench_robot(), arm)
        assert again.ratio.percent == pytest.approx(found.ratio.percent)
        assert again.projection.percent == pytest.approx(found.projection.percent)
        assert again.projection.sd == pytest.approx(found.projection.sd)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_at_a_rest_angle_in_the_middle_the_sum_is_flagged_and_the_projection_holds(share):
    arm = bench_arm()
    found = contribution_of(helping(motion("horizontal"), arm, share), bench_robot(), arm)
    assert found.sum_ratio < 0.2
    assert not found.ratio.valid
    assert any("singular" in note for note in found.notes)
    assert found.projection.valid
    assert found.projection.sd < 6
    low, high = found.projection.ci95
    assert low < found.projection.percent < high


def test_a_denominator_that_is_not_known_is_flagged_though_it_is_one_sided():
    weak = bench_elastic(stiffness=0.0, offset=0.05)
    arm = bench_arm(elastic=(weak,), segments=())
    m = motion("horizontal", arm=arm)
    found = contribution_of(helping(m, arm, 0.5), bench_robot(), arm)
    assert found.sum_ratio == pytest.approx(1)
    assert not found.ratio.valid
    assert not found.projection.valid
    assert any("no denominator" in note for note in found.notes)


def test_a_sum_whose_error_is_tens_of_points_is_flagged_though_it_has_a_denominator():
    m, seen = motion("horizontal"), {}
    for offset in (0.4, 4.0):
        arm = bench_arm(elastic=(bench_elastic(offset=offset),))
        seen[offset] = contribution_of(helping(m, arm, 0.0), bench_robot(), arm)
    wide, narrow = seen[0.4], seen[4.0]
    # so much more torque, the same errors of it
    assert narrow.ratio.sd < wide.ratio.sd
    assert narrow.ratio.valid
    spread = bench_elastic(offset=0.4, between=np.diag([0.05, 0.05]))
    arm = bench_arm(elastic=(spread,))
    found = contribution_of(helping(m, arm, 0.0), bench_robot(), arm)
    assert found.sum_ratio > 0.9
    assert found.ratio.sd > 10
    assert not found.ratio.valid
    assert any("an error of" in note and "points" in note for note in found.notes)


def test_samples_are_valid_away_from_zero_and_the_better_known_the_arm_the_more():
    m, valid = motion("horizontal"), []
    for scale in (0.0, 1.0, 4.0):
        elastic = bench_elastic()
        arm = bench_arm(
            elastic=(
                replace(
                    elastic,
                    covariance=scale * elastic.covariance,
                    between=scale * elastic.between,
                ),
            )
        )
        each = sample_contribution(helping(m, arm, 0.5), bench_robot(), arm)
        # between an invalid sample and zero there is no valid one on the same side
        for side in (each.arm > 0, each.arm < 0):
            worst = np.abs(each.arm[side & each.counts & ~each.valid]).max(initial=0)
            assert worst < 0.8 * np.abs(each.arm).max()
        assert not each.valid[np.abs(each.arm).argmin()]
        valid.append(each.valid.mean())
    assert valid[0] > valid[1] > valid[2] > 0


def test_lowering_is_told_and_lifting_is_not():
    arm, robot = bench_arm(), bench_robot()
    up = contribution_of(helping(motion("elevation"), arm, 0.5), robot, arm)
    down = contribution_of(helping(motion("lowering"), arm, 0.5), robot, arm)
    assert up.lowering_share == 0
    assert down.lowering_share > 0.95
    assert any("drives" in note for note in down.notes)
    assert not any("drives" in note for note in up.notes)


def test_who_pushes_down_while_the_arm_is_lowered_contributes_less_than_nothing():
    arm, m = bench_arm(), motion("lowering")
    needs = true_arm(m, arm, no_errors(len(m.q)))
    pushing = contribution_of(torques(m, arm, np.full(len(m.q), -3.0)), bench_robot(), arm)
    assert needs.mean() > 0
    assert pushing.ratio.percent < 0


def test_a_stand_still_does_not_count_whatever_the_gears_bear_in_it():
    arm, seen = bench_arm(), helping(motion("elevation"), bench_arm(), 0.5)
    found = contribution_of(seen, bench_robot(), arm)
    still = np.abs(seen.qd) < 0.05
    assert found.still_share == pytest.approx(still.mean())
    stuck = replace(seen, motor=seen.motor + 8.0 * still)
    again = contribution_of(stuck, bench_robot(), arm)
    assert again.ratio.percent == pytest.approx(found.ratio.percent)
    assert again.projection.sd == pytest.approx(found.projection.sd)
    assert again.ratio_all_percent < found.ratio_all_percent - 5
    assert not sample_contribution(stuck, bench_robot(), arm).valid[still].any()


def test_a_pause_is_told_and_nothing_but_a_pause_is_refused():
    arm, seen = bench_arm(), helping(motion("elevation"), bench_arm(), 0.5)
    n = len(seen.q)
    paused = replace(seen, qd=np.where(np.arange(n) < 0.7 * n, 0.0, seen.qd))
    found = contribution_of(paused, bench_robot(), arm)
    assert any("stands still" in note for note in found.notes)
    with pytest.raises(InputError, match="does not move"):
        contribution_of(replace(seen, qd=0 * seen.qd), bench_robot(), arm)


def test_saturation_is_told():
    arm, seen = bench_arm(), helping(motion("elevation"), bench_arm(), 0.0)
    limit, n = 59.5, len(seen.q)
    motor = np.full(n, 0.9 * limit)
    motor[:300], motor[-150:] = limit, -limit
    found = contribution_of(replace(seen, motor=motor), bench_robot(), arm)
    assert found.saturated_share == pytest.approx(450 / n)
    assert any("limit" in note for note in found.notes)
    assert contribution_of(seen, bench_robot(), arm).saturated_share == 0


def test_movements_beyond_the_calibrated_angles_are_told():
    elastic = replace(bench_elastic("elevation"), range_rad=np.deg2rad([45.0, 90.0]))
    arm = bench_arm(elastic=(elastic,))
    found = contribution_of(helping(motion("elevation"), arm, 0.5), bench_robot(), arm)
    assert any("20 degrees outside" in note for note in found.notes)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"motor": 0.0}, "motor torque is zero"),
        ({"rigid_arm": 0.0, "elastic": 0.0}, "needs no torque"),
    ],
)
def test_nothing_is_no_denominator(change, words):
    arm, seen = bench_arm(), helping(motion("elevation"), bench_arm(), 0.5)
    change = {name: np.full(len(seen.q), value) for name, value in change.items()}
    with pytest.raises(InputError, match=words) as error:
        contribution_of(replace(seen, **change), bench_robot(), arm)
    assert "\n" not in str(error.value)


def test_axes_that_were_not_calibrated_are_refused():
    seen = helping(motion("horizontal"), bench_arm(), 0.5)
    with pytest.raises(InputError, match="no passive calibration"):
        contribution_of(seen, bench_robot(), bench_arm(elastic=()))
    with pytest.raises(InputError, match="not known"):
        contribution_of(seen, bench_robot(loads=None), bench_arm())
    other = bench_arm(elastic=(bench_elastic(robot_gradient=np.zeros((2, 3))),))
    with pytest.raises(InputError, match="3 parameters"):
        contribution_of(seen, bench_robot(), other)


def test_an_axis_that_does_not_repeat_is_refused_unless_one_insists():
    worst = bench_elastic(repeatable=False, verdict="refused: repetitions too different")
    arm = bench_arm(elastic=(worst,))
    seen = helping(motion("horizontal"), arm, 0.5)
    with pytest.raises(InputError, match="too different"):
        contribution_of(seen, bench_robot(), arm)
    found = contribution_of(seen, bench_robot(), arm, unrepeatable=True)
    assert found.projection.percent == pytest.approx(50)


def test_a_zero_of_the_arm_is_no_number_and_no_warning():
    arm, m = known_exactly(bench_arm()), motion("horizontal")
    seen = helping(m, arm, 0.5)
    middle = int(np.abs(seen.arm).argmin())
    elastic = seen.elastic.copy()
    elastic[middle] = -seen.rigid_arm[middle]
    each = sample_contribution(replace(seen, elastic=elastic), exact_robot(), arm)
    assert np.isnan(each.percent[middle])
    assert not each.valid[middle]
    assert np.isfinite(np.delete(each.percent, middle)).all()


def test_a_result_is_plain_and_back():
    arm = bench_arm(references=(reference("elevation", [9.0, 9.2, 9.1]),))
    found = contribution_of(helping(motion("elevation"), arm, 0.5), bench_robot(), arm)
    again = from_plain(type(found), to_plain(found))
    assert to_plain(again) == to_plain(found)


# --- (18)-(19)


def mean_needs(name):
    return float(counted(helping(motion(name), bench_arm(), 0.0)).arm.mean())


@pytest.mark.parametrize("share", SHARES)
def test_the_reference_method_agrees_where_the_reference_is_the_arm(share):
    needs = mean_needs("elevation")
    arm = bench_arm(references=(reference("elevation", needs + np.array([-0.1, 0.0, 0.1])),))
    found = contribution_of(helping(motion("elevation"), arm, share), bench_robot(), arm)
    assert found.reference_valid
    assert found.reference.percent == pytest.approx(found.ratio.percent)
    assert found.reference.mean_reference_Nm == pytest.approx(needs)


def test_the_reference_errs_by_the_scatter_of_its_repetitions():
    needs, sds = mean_needs("elevation"), []
    for scatter in (0.1, 0.2):
        support = needs + scatter * np.array([-1.0, 0.0, 1.0])
        elastic = replace(bench_elastic("elevation"), noise_density=0.0)
        arm = bench_arm(elastic=(elastic,), references=(reference("elevation", support),))
        found = contribution_of(helping(motion("elevation"), arm, 0.25), exact_robot(), arm)
        sds.append(found.reference.sd)
        # mean support .75 of the reference, which stands for this one repetition
        assert found.reference.sd == pytest.approx(75 * scatter * np.sqrt(4 / 3) / needs)
    assert sds[1] == pytest.approx(2 * sds[0])


def test_the_robots_errors_leave_the_reference_method_as_far_as_one_is_passive():
    needs = mean_needs("elevation")
    elastic = replace(bench_elastic("elevation"), noise_density=0.0)
    arm = bench_arm(elastic=(elastic,), references=(reference("elevation", [needs] * 3),))
    sds = []
    for share in (0.0, 0.5, 1.0):
        found = contribution_of(helping(motion("elevation"), arm, share), bench_robot(), arm)
        sds.append(found.reference.sd)
    mean = counted(helping(motion("elevation"), arm, 0.0)).robot_gradient.mean(axis=0)
    variance = mean @ bench_robot().identified.covariance @ mean
    assert sds == pytest.approx(np.array([0, 0.5, 1]) * 100 * np.sqrt(variance) / needs, abs=1e-6)


def test_references_that_cannot_serve_are_flagged():
    def found(name, *references):
        arm = bench_arm(references=references)
        return contribution_of(helping(motion(name), arm, 0.5), bench_robot(), arm)

    none = found("elevation")
    assert none.reference is None
    assert not none.reference_valid
    small = mean_needs("horizontal")
    for name, reference_, words in (
        ("elevation", reference("elevation", [0.2, -0.3, 0.4]), "times its error"),
        ("elevation", reference("elevation", [9.0]), "one repetition"),
        ("horizontal", reference("horizontal", [small] * 3), "small against"),
        (
            "elevation",
            replace(reference("elevation", [9.0, 9.1, 9.2]), to_rad=1.2),
            "degrees from where",
        ),
        ("elevation", reference("elevation", [13.0, 13.1, 12.9]), "over the reference"),
    ):
        result = found(name, reference_)
        assert not result.reference_valid
        assert any(words in note for note in result.notes), (words, result.notes)
