"""The live form: the same numbers as a recording gives, and what it refuses."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, strategies as st
from metric_bench import (
    AXES,
    RATE,
    bench_arm,
    bench_elastic,
    bench_robot,
    counted,
    helping,
    motion,
    recording,
    reference,
)

from armimpedance.core.arrays import to_plain
from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.arm.movements import movement_torques
from armimpedance.joint.therapy.live_contribution import LiveContribution
from armimpedance.joint.therapy.live_replay import replay
from armimpedance.joint.therapy.robot.steady import kernels_for
from armimpedance.joint.therapy.share.of_movement import contribution_of
from armimpedance.numerics.signals import LastRows

HALF = kernels_for(RATE).half


def with_references():
    needs = counted(helping(motion("elevation"), bench_arm(), 0.0)).arm.mean()
    return bench_arm(references=(reference("elevation", needs + [-0.1, 0.0, 0.1]),))


@pytest.mark.study
def test_a_replayed_recording_gives_what_the_recording_gives():
    robot, arm = bench_robot(), with_references()
    played = recording(robot, arm, (0.5, 0.0, 0.8))
    report = replay(played, robot, arm)
    assert report.largest_difference < 1e-9
    assert report.flags_differ == 0
    assert report.n_updates == len(played.time_s)
    assert 0 < report.median_s <= report.p99_s <= report.longest_s
    whole = [contribution_of(m, robot, arm) for m in movement_torques(played, robot, arm)]
    assert [m.ratio.valid for m in report.movements] == [True, False, True]
    assert [m.reference_valid for m in report.movements] == [True, False, False]
    for live, batch in zip(report.movements, whole, strict=True):
        assert live.notes == batch.notes
        assert (live.trial, live.n_samples) == (batch.trial, batch.n_samples)
        assert live.projection.ci95 == pytest.approx(batch.projection.ci95, rel=1e-9)
        assert to_plain(live.share_variance) == pytest.approx(to_plain(batch.share_variance))


def feed(live, q, motor, start=0, count=None, time=True):
    found = []
    for i in range(start, start + (count or len(q) - start)):
        result = live.update(q[i], motor[i], i / RATE if time else None)
        if result is not None:
            found.append(result)
    return found


def stream(seconds=0.6, seed=0):
    rng = np.random.default_rng(seed)
    n = int(seconds * RATE)
    q = np.zeros((n, 5))
    q[:, 0] = 1.0 + 0.3 * np.sin(2 * np.pi * np.arange(n) / n)
    q[:, 1] = 0.5 + 0.2 * np.arange(n) / n
    return q, 5 + rng.normal(0, 0.1, (n, 5))


def live_form(axis=0, arm=None, **options):
    return LiveContribution(bench_robot(), arm or bench_arm(), axis, RATE, **options)


def test_a_result_comes_half_a_kernel_after_its_sample():
    q, motor = stream()
    live = live_form()
    results = [live.update(q[i], motor[i], i / RATE) for i in range(len(q))]
    first = next(i for i, r in enumerate(results) if r is not None)
    assert first == 2 * HALF
    assert results[first].time_s == pytest.approx(first / RATE - live.delay_s)
    assert all(r is not None for r in results[first:])
    assert live.delay_s == pytest.approx(0.05, abs=0.002)
    unstamped = feed(live_form(), q, motor, time=False)
    assert unstamped[0].time_s == pytest.approx(HALF / RATE)


def test_before_a_movement_there_is_nothing_but_samples_and_the_running_view():
    q, motor = stream()
    result = feed(live_form(), q, motor)[-1]
    assert not result.in_movement
    assert np.isnan([result.ratio.percent, result.projection.percent]).all()
    assert not result.ratio.valid
    assert not result.projection.valid
    assert np.isfinite(
        [result.of_sample.percent, result.of_sample.sd, result.running.percent]
    ).all()


def test_a_movement_counts_from_its_first_to_its_last_sample():
    q, motor = stream()
    live = live_form()
    feed(live, q, motor, 0, 200)
    live.start("elevation", trial="7")
    feed(live, q, motor, 200, 100)
    live.stop()
    assert not live.complete
    feed(live, q, motor, 300, HALF)
    assert live.complete
    found = live.movement()
    assert (found.n_samples, found.trial, found.movement) == (100, "7", "elevation")
    feed(live, q, motor, 300 + HALF, 50)
    assert to_plain(live.movement()) == to_plain(found)


def test_the_result_so_far_is_that_of_the_samples_so_far():
    q, motor = stream()
    longer, shorter = live_form(), live_form()
    for live, last in ((longer, 400), (shorter, 250)):
        feed(live, q, motor, 0, 100)
        live.start()
        feed(live, q, motor, 100, last - 100)
    shorter.stop()
    feed(shorter, q, motor, 250, HALF)
    again = live_form()
    feed(again, q, motor, 0, 100)
    again.start()
    so_far = feed(again, q, motor, 100, 150 + HALF)[-1]
    assert so_far.projection.percent == pytest.approx(shorter.movement().projection.percent)
    assert so_far.ratio.sd == pytest.approx(shorter.movement().ratio.sd)
    assert so_far.share.percent == pytest.approx(shorter.movement().share.percent)
    assert so_far.share.sd == pytest.approx(shorter.movement().share.sd)
    assert longer.movement().n_samples > shorter.movement().n_samples


def test_nothing_of_a_movement_is_left_in_the_next():
    q, motor = stream()
    other_q, other_motor = stream(seed=1)
    twice, fresh = live_form(), live_form()
    feed(twice, other_q, other_motor)
    twice.reset()
    for live in (twice, fresh):
        feed(live, q, motor, 0, 150)
        live.start()
        feed(live, q, motor, 150, 200)
    assert to_plain(twice.movement()) == to_plain(fresh.movement())
    # and in one stream, without a reset: the first movement's sums are gone
    one = live_form()
    one.start()
    feed(one, q, motor, 0, 90)
    one.stop()
    feed(one, q, motor, 90, 60)
    one.start()
    feed(one, q, motor, 150, 200)
    assert to_plain(one.movement()) == to_plain(fresh.movement())


#: After 300 samples at 1 kHz.
NOT_FOLLOWING = (
    (0.299, "comes after"),
    (0.2, "comes after"),
    (0.302, "gap"),
    (1.0, "gap"),
    (np.nan, "stamp"),
)


def bad_samples():
    q, motor = np.zeros(5), np.ones(5)
    nan = q.copy()
    nan[3] = np.nan
    infinite = motor.copy()
    infinite[0] = np.inf
    return [(q[:4], motor), (q, motor[:3]), (nan, motor), (q, infinite), (q[None], motor)]


def test_no_sample_and_time_stamps_that_do_not_follow_are_refused_and_change_nothing():
    q, motor = stream()
    live, whole = live_form(), live_form()
    feed(live, q, motor, 0, 300)
    for time, words in NOT_FOLLOWING:
        with pytest.raises(InputError, match=words):
            live.update(q[300], motor[300], time)
    for bad in bad_samples():
        with pytest.raises(InputError, match="not a sample"):
            live.update(*bad, 0.3)
    # texts, in which NaN is NaN
    assert repr(feed(live, q, motor, 300)[-1]) == repr(feed(whole, q, motor)[-1])


def test_marks_that_make_no_movement_are_refused():
    q, motor = stream()
    live = live_form()
    with pytest.raises(InputError, match="no movement to stop"):
        live.stop()
    with pytest.raises(InputError, match="no sample of a movement"):
        live.movement()
    live.start()
    with pytest.raises(InputError, match="no movement to stop"):
        live.stop()
    with pytest.raises(InputError, match="before the last one"):
        live.start()
    feed(live, q, motor, 0, 200)
    live.stop()
    with pytest.raises(InputError, match="before the last one"):
        live.start()
    with pytest.raises(InputError, match="no movement to stop"):
        live.stop()
    feed(live, q, motor, 200, HALF)
    live.start()


def test_robots_arms_and_axes_that_do_not_fit_are_refused():
    robot = bench_robot()
    for arguments, words in (
        ((robot, bench_arm(), 5), "axis 5"),
        ((robot, bench_arm(), 2), "no passive calibration"),
        ((robot, bench_arm(robot="another"), 0), "another"),
        ((bench_robot(loads=None), bench_arm(), 0), "not known"),
        ((robot, bench_arm(elastic=(bench_elastic(repeatable=False),)), 1), "no passive model"),
    ):
        with pytest.raises(InputError, match=words):
            LiveContribution(*arguments, RATE)
    with pytest.raises(InputError, match="Hz"):
        LiveContribution(robot, bench_arm(), 0, 50.0)
    with pytest.raises(InputError, match="window"):
        live_form(window_s=0.0)


def test_no_motor_torque_is_no_movement():
    q, motor = stream()
    live = live_form()
    live.start()
    feed(live, q, 0 * motor)
    with pytest.raises(InputError, match="motor torque is zero"):
        live.movement()


@pytest.mark.study
def test_memory_does_not_grow_with_a_movement():
    q, motor = stream(0.2)
    live = live_form()
    live.start()

    def run(count):
        for i in range(count):
            live.update(q[i % len(q)], motor[i % len(q)])

    run(700)
    tracemalloc.start()
    run(100)
    before = tracemalloc.get_traced_memory()[0]
    run(1000)
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    # one number kept of each sample would be 8 kB
    assert grown < 4000


@given(st.integers(1, 6), st.lists(st.integers(-9, 9), min_size=1, max_size=30), st.data())
def test_the_last_rows_are_the_last_rows(length, values, data):
    rows = LastRows(length, 2)
    for value in values:
        rows.push(np.array([value, -value]))
    count = data.draw(st.integers(1, min(length, len(values))))
    expected = np.array([[v, -v] for v in values[-count:]])
    assert (rows.last(count) == expected).all()


def test_axes_are_those_of_the_recording():
    q, motor = stream()
    for axis in (0, 1):
        live = live_form(axis)
        live.start()
        result = feed(live, q, motor)[-1]
        assert live.movement().axis_name == AXES[axis]
        # the kernel cuts a curve of 33 rad/s^2 by 2.4 mrad, a line by nothing
        assert result.q_rad == pytest.approx(q[len(q) - 1 - HALF, axis], abs=(3e-3, 1e-9)[axis])
