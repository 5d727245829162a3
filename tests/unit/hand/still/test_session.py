"""A session as its own witness: what changes between its trials, and what does not."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.still import check_response
from armimpedance.hand.still.doubts.courses import Part, fit_course, rows_scaled
from armimpedance.hand.still.doubts.departures import session_blocks
from armimpedance.hand.still.show import estimate, plot_session
from armimpedance.show.plots import new_figure
from manipulandum_sim.hand import simulate
from manipulandum_sim.hand.robot import IDEAL

CONDITIONS = ("cocontraction_10", "cocontraction_30")
MIDDLE = 32


@lru_cache
def session(subject="A"):
    """64 trials in 4 sets, two conditions in each set, numbered as they were made."""
    rec, _ = simulate(
        "cocontraction",
        seed=3,
        subject=subject,
        sets=4,
        conditions=CONDITIONS,
        emg=False,
        servo=IDEAL,
    )
    rec = rec.select(np.argsort(rec.trials["set"].to_numpy(), kind="stable"))
    return replace(rec, trials=rec.trials.assign(trial=np.arange(1, rec.n_trials + 1)))


def scaled(rec, factor, trials):
    """The force of some trials times a factor, of all axes or one each."""
    force = rec.force.copy()
    for row in trials:
        force[rec.samples_of(row)] *= factor
    return replace(rec, force=force)


def spliced(first, second, trials):
    """A session whose trials from another one replace its own."""
    force, position = first.force.copy(), first.position.copy()
    for row in trials:
        at, of = first.samples_of(row), second.samples_of(row)
        force[at], position[at] = second.force[of], second.position[of]
    return replace(first, force=force, position=position)


def found(rec, name="session"):
    (one,) = [one for one in check_response(rec) if one.name == name]
    return one


def told_trial(message):
    return int(message.split("from trial ")[1].split()[0].rstrip(","))


def told_size(message):
    """Percent."""
    return float(message.split("changes by ")[1].split()[0])


def test_a_clean_session_stays_and_says_what_it_would_have_seen():
    clean = found(session())
    assert clean.verdict == "ok"
    assert "%" in clean.smallest
    assert found(session(), "labels").verdict == "ok"


@pytest.mark.first_cases(1)
@pytest.mark.parametrize("first", [MIDDLE, 16, 45])
def test_a_gain_that_changes_is_found_with_its_trial_and_size(first):
    warned = found(scaled(session(), 1.1, range(first, 64)))
    assert warned.verdict == "warning"
    assert abs(told_trial(warned.message) - (first + 1)) <= 3
    assert "another person" in warned.message
    assert "gain" in warned.message
    assert abs(told_size(warned.message) - 10) < 4


def test_one_channel_and_a_sign_are_told_from_a_gain():
    half = found(scaled(session(), np.array([0.5, 1.0]), range(MIDDLE, 64)))
    assert half.verdict == "warning"
    assert "along x" in half.message
    # said with a standard error of 1 %
    assert abs(told_size(half.message) + 50) <= 3
    turned = found(scaled(session(), np.array([1.0, -1.0]), range(48, 64)))
    assert "along y has the other sign from trial 49 on" in turned.message


def test_a_drift_and_one_set_alone_are_told():
    rec = session()
    force = rec.force.copy()
    for row in range(64):
        force[rec.samples_of(row)] *= 1 + 0.1 * row / 63
    assert "from the first trial to the last" in found(replace(rec, force=force)).message
    assert "in set 2 alone" in found(scaled(rec, 0.85, range(16, 32))).message


def test_another_person_from_the_middle_on_is_told():
    other = found(spliced(session("A"), session("D"), range(MIDDLE, 64)))
    assert other.verdict == "warning"
    assert abs(told_trial(other.message) - (MIDDLE + 1)) <= 3
    assert "another person" in other.message


def test_stiffness_that_falls_is_no_alarm():
    """A stiff condition in the first half and a soft one in the second, under one name."""
    rec = session()
    stiff = (rec.trials["condition"] == CONDITIONS[1]).to_numpy()
    tired = rec.select(np.flatnonzero(stiff == (np.arange(64) < MIDDLE)))
    fading = found(replace(tired, trials=tired.trials.assign(condition="one")))
    assert fading.verdict == "ok"
    assert "stiffness falls" in fading.message


def test_the_order_is_that_of_the_sets_where_the_table_is_sorted_by_condition():
    rec = scaled(session(), 1.1, range(MIDDLE, 64))
    by_condition = rec.select(np.argsort(rec.trials["condition"].to_numpy(), kind="stable"))
    assert "gain" in found(by_condition).message


def test_labels_exchanged_in_one_set_are_told():
    rec = session()
    names = rec.trials["condition"].to_numpy().astype(object)
    inside = (rec.trials["set"] == 3).to_numpy()
    names[inside] = np.where(names[inside] == CONDITIONS[0], CONDITIONS[1], CONDITIONS[0])
    exchanged = found(replace(rec, trials=rec.trials.assign(condition=names)), "labels")
    assert exchanged.verdict == "warning"
    assert "set 3" in exchanged.message


def test_conditions_in_blocks_are_held_against_each_other():
    rec = session()
    blocks = rec.select(np.argsort(rec.trials["condition"].to_numpy(), kind="stable"))
    blocks = replace(blocks, trials=blocks.trials.drop(columns=["set", "day"]))
    assert found(blocks).verdict == "ok"
    other_gain = found(scaled(blocks, 1.15, range(32, 64)))
    assert other_gain.verdict == "warning"
    assert "at the same place" in other_gain.message


def test_the_interval_holds_either_gain():
    """A gain that changed in the middle: which half is right nobody knows."""
    whole = estimate(session())
    changed = estimate(scaled(session(), 1.1, range(MIDDLE, 64)))
    for one, before in zip(changed, whole, strict=True):
        wide = 2.5 * one.sd.ravel()[:4]
        for factor in (1.0, 1.1):
            with_handle = before.inertia + 0.164 * np.eye(2)
            truth = (factor * with_handle - 0.164 * np.eye(2)).ravel()
            assert (np.abs(one.parameters[:4] - truth) < wide + 2.5 * before.sd.ravel()[:4]).all()
        assert any(text.startswith("session:") for text in one.warnings)
        widened = one.sd.ravel()[:4] > before.sd.ravel()[:4]
        assert widened.all()


def test_clean_intervals_grow_by_little(monkeypatch):
    """What a session does not exclude of a changed gain: at most 5 % beside the other doubts."""
    from armimpedance.hand.still.doubts import allowance

    with_it = estimate(session())
    monkeypatch.setattr(allowance, "possible_gains", lambda *_: [])
    without = estimate(session())
    for one, plain in zip(with_it, without, strict=True):
        assert (one.sd <= 1.05 * plain.sd).all()


def test_a_course_is_solved_as_one_large_regression():
    """Against rows stacked by hand: y_t = X_t (theta_c + w_t D g) of two conditions."""
    rng = np.random.default_rng(0)
    d, T, n = 2, 30, 40
    p, scale = 3 * d * d, []
    parts, rows, values, w = [], [], [], rng.uniform(0, 1, 2 * T)
    theta = rng.normal(0, 1, (2, p))
    D = [rows_scaled(one, d) for one in theta]
    for c in range(2):
        X = rng.normal(0, 1, (T, n, p))
        y = X @ theta[c] + rng.normal(0, 0.5, (T, n)) + 0.2 * w[c * T : c * T + T, None]
        A, b = np.einsum("tnp,tnq->tpq", X, X), np.einsum("tnp,tn->tp", X, y)
        inverse = np.linalg.inv(A.sum(axis=0))
        at = np.arange(c * T, c * T + T)
        parts.append(Part(at, A, b, inverse @ b.sum(axis=0), D[c], inverse))
        wide = np.zeros((T, n, 2 * p + 3 * d))
        wide[..., c * p : c * p + p] = X
        wide[..., 2 * p :] = w[at][:, None, None] * (X @ D[c])
        rows.append(wide.reshape(T * n, -1))
        values.append(y.ravel())
        scale.append(y)
    solved = np.linalg.lstsq(np.concatenate(rows), np.concatenate(values), rcond=None)[0]
    fit = fit_course(parts, w, np.eye(3 * d))
    np.testing.assert_allclose(fit.sizes, solved[2 * p :], rtol=1e-8)


def test_twelve_trials_are_asked_for_a_drift_alone():
    """A step wants eight trials on either side; what cannot be asked is not named."""
    few = session().select(range(12))
    assert "from trial" not in found(scaled(few, 1.1, range(6, 12))).message
    assert found(few).verdict in ("ok", "cannot tell")


def test_blocks_are_parts_of_the_whole_and_show_a_gain():
    blocks = session_blocks(session())
    assert blocks.first[0] == 1
    assert blocks.last[-1] == session().n_trials
    assert np.array_equal(blocks.first[1:], blocks.last[:-1] + 1)
    apart = np.abs(blocks.sizes - 1) / blocks.sd
    assert (apart[:, 0] < 4).all()
    # a block's standard error is that of the whole, of a part of the trials
    assert np.sqrt((apart**2).mean()) < 1.5
    late = session_blocks(scaled(session(), 1.2, range(MIDDLE, 64)))
    step = late.sizes[late.first > MIDDLE, 0].mean() / late.sizes[late.last <= MIDDLE, 0].mean()
    assert step == pytest.approx(1.2, abs=0.04)


def test_the_course_is_drawn_where_it_is_asked_for():
    ax = new_figure(3.5, 2.0).subplots()
    assert plot_session(session(), ax=ax) is ax
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["M", "K"]
    few = session().select(np.arange(2))
    with pytest.raises(InputError):
        plot_session(few)


@pytest.mark.parametrize(
    "gain",
    [
        0.5,
        np.array([1.0, -1.0]),
        *(pytest.param(gain, marks=pytest.mark.study) for gain in (0.0, 1.5, -1.0)),
    ],
)
def test_a_single_trial_that_answers_otherwise_is_named_by_its_number(gain):
    off = scaled(session(), gain, [20])
    said = found(off, "single trials")
    number = session().trials["trial"].iloc[20]
    assert said.verdict == "warning"
    assert said.message.startswith(f"trial {number} answers by ")
    assert all(said.sentence in one.warnings for one in estimate(off))


@pytest.mark.first_cases(1)
@pytest.mark.parametrize("subject", list("ABC"))
def test_clean_trials_are_alike(subject):
    assert found(session(subject), "single trials").verdict == "ok"


def test_several_single_trials_are_listed_the_worst_first():
    off = scaled(scaled(session(), 1.5, [5]), -1.0, [40])
    said = found(off, "single trials")
    assert "trial 41 answers" in said.message.split(",")[0]
    assert "trial 6 answers by 1" in said.message
