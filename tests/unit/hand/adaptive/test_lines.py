"""A robot over lines: hostile ones, and the same pushes however slow the machine is."""

import json
import time

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from armimpedance.core.errors import InputError
from armimpedance.hand.adaptive import (
    Aim,
    Comfort,
    NextTrials,
    OneCourse,
    Push,
    PushingRobot,
    PushSession,
    Setup,
    answers,
    next_trials,
    recording_of,
    trials_of,
)
from armimpedance.hand.planning import SHAPES, Profile
from manipulandum_sim.hand import simulate, simulate_condition
from manipulandum_sim.hand.robot import IDEAL

PROFILE = Profile(SHAPES.named("designed"), 0.005, 0.3)
SAMPLES = {"position_m": [[0.0, 0.1]] * 50, "force_N": [[1.0, 0.0]] * 50, "onset_s": 0.01}


def groups_of_four(wait_s=0.0):
    """A chooser that says so many pushes, and from how many trials it was computed."""

    def choose(recording):
        time.sleep(wait_s)
        done = 0 if recording is None else recording.n_trials
        turned = [(float(np.cos(done + i)), float(np.sin(done + i))) for i in range(4)]
        pushes = tuple(Push("c", way, PROFILE, 1.0) for way in turned)
        left = max(0, 12 - done)
        none = np.zeros(0)
        return NextTrials(pushes if left else (), {"c": left}, (), none, none, met=not left)

    return choose


def said(session, *told):
    return [json.loads(one) for one in answers(session, [json.dumps(one) for one in told])]


def whole_session(wait_s):
    session = PushSession(groups_of_four(wait_s), Setup())
    found = said(session, {"ready": True}, *[{"trial": SAMPLES}] * 16)
    session.close()
    return found


def test_pushes_are_the_same_however_long_they_are_computed():
    slow, fast = whole_session(0.02), whole_session(0.0)
    assert slow == fast
    assert fast[-1]["push"] is None
    assert fast[-1]["met"]


def test_a_group_is_computed_while_the_two_pushes_before_it_are_done():
    begun = []

    def choose(recording):
        begun.append(0 if recording is None else recording.n_trials)
        return groups_of_four()(recording)

    session = PushSession(choose, Setup())
    said(session, {"ready": True}, *[{"trial": SAMPLES}] * 16)
    session.close()
    # of each group of four the first two pushes are known, the other two are still to come
    assert begun[:4] == [0, 2, 6, 10]


@pytest.mark.parametrize(
    "line",
    [
        "no json",
        "[]",
        "{}",
        '{"trial": 3}',
        '{"trial": {"onset_s": 0.1}}',
        '{"trial": {"onset_s": "x", "position_m": [[0, 0]], "force_N": [[0, 0]]}}',
        '{"trial": {"onset_s": 0.1, "position_m": [[0, 0]], "force_N": [[0]]}}',
        '{"trial": {"onset_s": 0.1, "position_m": [[0, NaN]], "force_N": [[0, 0]]}}',
        '{"trial": {"onset_s": 1, "end_s": 0, "position_m": [[0, 0]], "force_N": [[0, 0]]}}',
        '{"trial": {"onset_s": true, "position_m": [[0, 0]], "force_N": [[0, 0]]}}',
        "[" * 100_000,
        "9" * 5_000_000,
    ],
)
def test_a_wrong_line_is_answered_and_loses_no_push(line):
    session = PushSession(groups_of_four(), Setup())
    before = said(session, {"ready": True})
    (wrong,) = answers(session, [line])
    assert "expected" in json.loads(wrong)["error"]
    assert said(session, {"ready": True}) == before
    assert not session.trials
    session.close()


@settings(max_examples=40, deadline=None)
@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.text(max_size=5),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(
                st.sampled_from(["trial", "ready", "onset_s", "end_s", "position_m", "force_N"]),
                inner,
            )
        ),
        max_leaves=8,
    )
)
def test_any_line_gets_one_answer(told):
    session = PushSession(groups_of_four(), Setup())
    found = list(answers(session, [json.dumps(told)]))
    session.close()
    assert len(found) == 1
    assert isinstance(json.loads(found[0]), dict)


def test_trials_come_back_as_the_recording_that_they_were():
    recording, _ = simulate_condition(seed=3, sets=1, servo=IDEAL)
    again = recording_of(trials_of(recording), Setup(1000.0, recording.handle_mass_kg))
    assert np.array_equal(again.position, recording.position)
    assert np.array_equal(again.force, recording.force)
    for column in ("condition", "direction_deg", "onset_s", "end_s"):
        assert (again.trials[column] == recording.trials[column]).all()


def test_trials_of_a_table_without_directions_are_refused():
    recording, _ = simulate_condition(seed=3, sets=1, servo=IDEAL)
    bare = recording.trials.drop(columns="direction_deg")
    from dataclasses import replace

    with pytest.raises(InputError, match="direction_deg"):
        trials_of(replace(recording, trials=bare))


@pytest.mark.study
def test_a_session_keeps_to_one_course():
    recording, _ = simulate(
        "cocontraction", seed=3, sets=2, conditions=["cocontraction_00"], disturbance="designed"
    )

    def choose(so_far, course=None):
        robot = PushingRobot(shapes=("minimum_jerk", "designed"), course=course)
        return next_trials(so_far, Aim(k_part=0.02), robot, Comfort())

    keeping = OneCourse(choose)
    first = keeping(recording).pushes[0].profile
    assert first.shape.name == "designed"
    assert keeping(recording).pushes[0].profile == first


def test_a_trial_of_other_axes_is_refused_and_its_push_still_to_be_done():
    session = PushSession(groups_of_four(), Setup())
    wide = {**SAMPLES, "position_m": [[0.0, 0.1, 0.2]] * 50, "force_N": [[1.0, 0.0, 0.0]] * 50}
    asked, first, *refused, second = said(
        session,
        {"ready": True},
        {"trial": SAMPLES},
        {"trial": wide},
        {"trial": {**wide, "direction": [1.0, 0.0, 0.0]}},
        {"ready": True},
    )
    session.close()
    assert "expected shape (50, 2)" in refused[0]["error"]
    assert "trial 2: other axes" in refused[1]["error"]
    assert second == first != asked
    assert session.recording().n_trials == 1
