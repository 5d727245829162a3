"""The course over a reach: its prior, the truth along the way, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reaching_sessions import two_phases as session

import armimpedance as ai
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.hand.reaching import identify_course, identify_movement
from armimpedance.hand.reaching.over_reach import _Basis
from armimpedance.hand.reaching.solve import CHANGE_SD, CURVE_SD


def test_the_random_courses_slopes_and_bends_are_those_of_one_phase():
    basis = _Basis(0.1, 0.6)
    for time_s in (0.1, 0.35, 0.6):
        _, slope, bend = basis.rows(time_s) ** 2 @ basis.variance
        # the ends of the interval and the last cosine cost one percent
        assert np.sqrt(slope) == pytest.approx(CHANGE_SD, rel=0.02)
        assert np.sqrt(bend) == pytest.approx(CURVE_SD, rel=0.02)


@pytest.mark.study
def test_the_course_holds_the_truth_and_is_sharper_than_the_phases_alone():
    recording, truth = session()
    course = identify_course(recording)
    line = truth.hand[-1] - truth.hand[0]
    off, held = [], []
    for one in course:
        assert one.position is not None
        travelled = float((one.position - truth.hand[0]) @ line / np.hypot(*line))
        true = np.concatenate([truth.at(f"{x}_e", travelled) for x in "MBK"], axis=None)
        off.append(np.abs(one.parameters - true) / one.sd.ravel())
        low, high = one.interval()
        held.append((low.ravel() <= true) & (true <= high.ravel()))
    # twelve elements that go together over the way: none beyond 4.5 sd, most within 2
    assert np.max(off) < 4.5
    assert np.mean(held) > 0.8
    alone = identify_movement(recording)
    middle = course[len(course) // 2]
    assert middle.sd[2].mean() < min(one.sd[2].mean() for one in alone)


def test_a_course_begins_and_ends_with_its_phases():
    recording, _ = session()
    by_phase = recording.trials.groupby(["phase", "push_deg"], dropna=False)
    few = by_phase.head(2).index.union(recording.trials.index[recording.trials["phase"] == ""][:15])
    recording = recording.select(few.to_numpy())
    course, alone = identify_course(recording, level="joint"), identify_movement(recording)
    assert np.allclose(course[0].position, alone[0].position, atol=1e-3)
    assert np.allclose(course[-1].position, alone[-1].position, atol=1e-3)
    times = [float(str(one.keys["phase"]).removesuffix(" s")) for one in course]
    assert np.all(np.diff(times) > 0)


def test_one_phase_is_no_course():
    recording, _ = session()
    with pytest.raises(InputError, match="one phase"):
        identify_course(recording, phases=["30%"])


def test_a_force_of_the_wrong_sign_is_told():
    recording, _ = session()
    with pytest.raises(EstimationError):
        identify_course(replace(recording, force=-recording.force))


def test_other_methods_make_no_course():
    with pytest.raises(InputError, match="mean_difference"):
        ai.movement(session()[0], method="mean_difference", course=True)
