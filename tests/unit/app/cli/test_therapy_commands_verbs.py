"""The verbs of therapy: a record and its path give the same, and what the commands write."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from therapy_bench import DRAWINGS, PIPE, lifted, recorded

from armimpedance.__main__ import main
from armimpedance.core.arrays import to_plain
from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.joint.therapy import PassiveArm, pipes
from armimpedance.joint.therapy.show import (
    calibrate_arm,
    calibrate_robot,
    check_mockup,
    contribution,
    read_arm,
    read_robot,
)

HOSTILE = "<script>alert(1)</script>"


@pytest.fixture(scope="module")
def bench(sound_bench):
    return sound_bench


@pytest.fixture(scope="module")
def robot(bench):
    return calibrate_robot(bench.calibration, DRAWINGS)


@pytest.fixture(scope="module")
def arm(bench, robot):
    return calibrate_arm(bench.session, robot)


@pytest.fixture(scope="module")
def results(bench, robot, arm):
    return contribution(bench.session, robot=robot, arm=arm)


@pytest.mark.study
def test_a_path_and_a_record_give_the_same_robot(bench, robot):
    again = calibrate_robot(str(bench.folder / "calibration"), bench.folder / "drawings.json")
    assert again.to_dict() == robot.to_dict()
    assert to_plain(again.robot) == to_plain(robot.robot)
    assert to_plain(read_robot(bench.folder / "robot.json")) == to_plain(robot.robot)


def test_a_path_and_a_record_give_the_same_arm(bench, arm):
    again = calibrate_arm(bench.folder / "session", bench.folder / "robot.json")
    assert again.to_dict() == arm.to_dict()
    assert to_plain(read_arm(bench.folder / "arm.json")) == to_plain(arm.arm)


def test_a_path_and_a_record_give_the_same_contributions(bench, results, tmp_path):
    known = {"robot": bench.folder / "robot.json", "arm": str(bench.folder / "arm.json")}
    again = contribution(bench.folder / "session", **known)
    assert again.to_dict() == results.to_dict()
    results.to_csv(tmp_path / "result.csv")
    results.write_samples(tmp_path / "samples.csv")
    whole = (tmp_path / "result.csv").read_bytes()
    assert whole == (bench.folder / "contribution.csv").read_bytes()
    call = bench.call("contribution", "--samples", tmp_path / "s.csv", out=tmp_path / "r.csv")
    assert main([str(a) for a in call]) == 0
    assert whole == (tmp_path / "r.csv").read_bytes()
    assert (tmp_path / "samples.csv").read_bytes() == (tmp_path / "s.csv").read_bytes()


def test_contributions_are_a_sequence_and_a_table(results):
    assert len(results) == 4
    assert [r.condition for r in results] == 3 * ["passive"] + ["half_active"]
    assert results[3] is results[-1]
    assert len(results[1:3]) == 2
    table = results.to_frame()
    assert list(table.columns) == list(results[0].to_dict())
    assert table["share_percent"].tolist() == [r.share.percent for r in results]
    assert [len(s.percent) for s in results.samples()] == [len(m.q) for m in results.movements]


def test_one_condition_alone(bench, robot, arm, results):
    half = contribution(bench.session, robot=robot, arm=arm, condition="half_active")
    assert half.to_dict() == results.to_dict()[3:]
    with pytest.raises(InputError, match="no condition 'activ'"):
        contribution(bench.folder / "session", robot=robot, arm=arm, condition="activ")


@pytest.mark.study
def test_the_live_form_is_the_same(results):
    told = []
    report = results.replay(lambda done, total: told.append((done, total)))
    assert told == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert report.largest_difference < 1e-9
    assert repr(report).startswith("live: ")


def test_an_axis_that_did_not_repeat_is_left_out(bench, robot, arm):
    elastic = replace(arm.arm.elastic[0], repeatable=False, verdict="refused: too different")
    other = replace(elastic, axis="horizontal")
    unsure = replace(arm.arm, elastic=(arm.arm.elastic[0], other))
    both = bench.session.trials.assign(axis=[1, 1, 1, 2], movement=["up", "up", "up", "across"])
    mixed = replace(bench.session, trials=both)
    kept = contribution(mixed, robot=robot, arm=unsure)
    assert [r.movement for r in kept] == ["up", "up", "up"]
    assert kept.recording.n_trials == 3
    assert "too different" in kept.left_out["horizontal"]
    assert "left out: subject S: axis horizontal" in repr(kept)
    with pytest.raises(InputError, match="no passive model"):
        contribution(bench.session, robot=robot, arm=replace(unsure, elastic=(elastic,)))


def test_progress_ends_with_the_last_trial(bench, robot, arm):
    for verb in (
        lambda tell: calibrate_robot(bench.calibration, DRAWINGS, progress=tell),
        lambda tell: calibrate_arm(bench.session, robot, progress=tell),
        lambda tell: contribution(bench.session, robot=robot, arm=arm, progress=tell),
    ):
        told = []
        verb(lambda done, total, told=told: told.append((done, total)))
        assert [done for done, _ in told] == list(range(1, told[-1][1] + 1))


def test_a_validation_goes_with_the_robot(bench, robot):
    moving = recorded([lifted("validation", axis) for axis in (0, 1, 3)], Subject("empty"))
    checked = calibrate_robot(bench.calibration, DRAWINGS, validate=moving)
    assert robot.validation == ()
    assert [v.name for v in checked.validation] == list(DRAWINGS.axes)
    assert len(checked.to_dict()["validation"]) == 5


def test_pipes_by_the_verb(bench, robot, tmp_path):
    ways = [lifted("passive", axis) for axis in (0, 1)]
    ways += [(t, q[::-1], -qd[::-1], qdd[::-1], row) for t, q, qd, qdd, row in ways]
    arm = PassiveArm("pipes", DRAWINGS.name, 0.32, pipes())
    recording = recorded(ways, Subject("pipes"), arm, elastic=False)
    upper, lower = (tuple(map(float, p.split(","))) for p in (PIPE[1], "1.7,0.30,0.09"))
    given = {"upper_pipe": upper, "lower_pipe": lower, "upper_arm_m": 0.32}
    check = check_mockup(recording, robot, **given)
    table = check.to_frame()
    assert list(table.index) == ["gravity", "inertia"]
    np.testing.assert_allclose(table["value"], table["model"], rtol=0.01)
    assert repr(check).count("\n") == 1
    assert "<table" in check._repr_html_()


def test_results_are_short_texts_and_tables(robot, arm, results):
    for found, columns in (
        (robot, ["joint", "value", "sd", "ci_low", "ci_high", "unit"]),
        (arm, ["joint", "value", "sd", "ci_low", "ci_high", "unit"]),
        (results, list(results[0].to_dict())),
    ):
        assert repr(found).count("\n") < 12
        table = found.to_frame()
        assert isinstance(table, pd.DataFrame)
        assert list(table.columns) == columns


def test_hostile_names_do_nothing_in_a_notebook(bench, robot, arm, results):
    named = replace(results[0], condition=HOSTILE, movement=HOSTILE)
    elastic = replace(arm.axes[0].elastic, verdict=HOSTILE)
    for shown in (
        replace(results, results=(named,), left_out={"x": HOSTILE}, notes=(HOSTILE,)),
        replace(arm, arm=replace(arm.arm, subject=HOSTILE)),
        replace(arm, axes=(replace(arm.axes[0], elastic=elastic),)),
        replace(robot, robot=replace(robot.robot, name=HOSTILE)),
    ):
        page = shown._repr_html_()
        assert "alert(1)" in page
        assert "<script>" not in page


def test_errors_name_the_file_at_fault(bench, robot, arm, tmp_path):
    with pytest.raises(InputError) as refused:
        contribution(bench.folder / "session", robot=bench.folder / "drawings.json", arm=arm)
    assert str(bench.folder / "drawings.json") in str(refused.value)
    with pytest.raises(InputError) as refused:
        calibrate_robot(bench.folder / "session", DRAWINGS)
    assert str(bench.folder / "session") in str(refused.value)
    with pytest.raises(InputError, match="another"):
        contribution(bench.session, robot=robot, arm=replace(arm.arm, robot="another"))


@pytest.mark.parametrize("which", ["robot", "arm"])
def test_a_calibration_has_every_form_of_a_fit(which, robot, arm, tmp_path):
    made = {"robot": robot, "arm": arm}[which]
    for ending in ("csv", "json", "xlsx", "mat"):
        made.write(tmp_path / f"fit.{ending}")
    frame = pd.read_csv(tmp_path / "fit.csv")
    values = [p.value for p in made.summary.parameters]
    np.testing.assert_allclose(frame["value"], values)
    np.testing.assert_allclose(made.to_xarray()["value"], values)
    long = made.to_long()
    np.testing.assert_allclose(long["value"], values)
    assert list(long["unit"]) == [p.unit for p in made.summary.parameters]
