"""All sessions together: who is far from the others, who is there twice, what groups differ in."""

from __future__ import annotations

import csv
import json
import shutil
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from scipy.stats import ttest_ind

from armimpedance.app.cli.study import parse
from armimpedance.app.study import StudyDesign, StudySession, run_group
from armimpedance.app.study.design import StudyStep
from armimpedance.app.study.people_groups import (
    compare_people,
    far_from_others,
    groups_of_people,
    robust_scores,
)
from armimpedance.app.study.strips import Strip, strips_of

HOSTILE = '<img src=x onerror="alert(1)">&$\\frac$'


def strip(values, errors, kind="difference"):
    values, errors = np.asarray(values, float), np.broadcast_to(errors, len(values)).astype(float)
    low, high = values - 2 * errors, values + 2 * errors
    numbers = np.arange(len(values))
    return Strip("hand.csv", "a", "K_11", "N/m", kind, numbers, values, low, high, errors)


def named(strips):
    return sorted({one.session for one in far_from_others(strips)})


@pytest.mark.study
@pytest.mark.parametrize("share", [0.0, 0.7, 3.0], ids=["exact", "some error", "all error"])
def test_of_people_who_are_alike_nobody_is_named_in_about_19_of_20_cohorts(share):
    rng = np.random.default_rng(1)
    cohorts, strips, people = 100, 6, 30
    wrong = 0
    for _ in range(cohorts):
        errors = share * rng.uniform(0.5, 1.5, (strips, people))
        values = rng.normal(size=(strips, people)) + errors * rng.normal(size=(strips, people))
        wrong += bool(named([strip(*both) for both in zip(values, errors, strict=True)]))
    # Five percent, and twice the spread of a count of so many.
    assert wrong <= 0.05 * cohorts + 2 * np.sqrt(0.05 * 0.95 * cohorts)


def test_who_is_far_is_named_and_who_was_measured_badly_is_not():
    rng = np.random.default_rng(2)
    values, errors = rng.normal(100, 10, 30), np.full(30, 3.0)
    values[[4, 9]] = 300
    errors[9] = 90.0
    assert named([strip(values, errors)]) == [4]
    # Too few to know their spread.
    assert named([strip(values[:7], errors[:7])]) == []


def test_one_who_is_far_in_everything_lets_nobody_else_be_named_for_little():
    rng = np.random.default_rng(8)
    values = rng.normal(100, 10, (60, 40))
    values[:, 7] *= 5
    alone = named([strip(own, 1.0) for own in values])
    assert alone == [7]


def test_who_is_far_does_not_hang_on_units_or_on_half_a_turn():
    rng = np.random.default_rng(3)
    values, errors = rng.normal(100, 10, 40), rng.uniform(1, 5, 40)
    _, z = robust_scores(values, errors)
    centre, scaled = robust_scores(1000 * values - 7, 1000 * errors)
    np.testing.assert_allclose(scaled, z)
    assert centre == pytest.approx(1000 * np.median(values) - 7)
    angles = rng.normal(88, 3, 40)
    angles[0] = 30.0
    turned = np.where(angles > 90, angles - 180, angles)
    assert named([strip(angles, 1.0, "axis")]) == named([strip(turned, 1.0, "axis")]) == [0]


def test_people_who_are_all_the_same_have_no_outlier():
    assert named([strip(np.full(20, 5.0), 0.0)]) == []


def people_of(count):
    return {str(i): {"group": "ab"[i % 2], "age": str(i), "hand": "r"} for i in range(count)}


def test_groups_are_columns_with_few_values_and_people_enough():
    people = people_of(6) | {"7": {"group": "n/a"}, "8": {"group": "c"}}
    assert groups_of_people(people, list("012345")) == {"group": ("a", "b")}
    assert groups_of_people(people, [*"012345", "7"]) == {"group": ("a", "b")}
    assert groups_of_people(people, [*"012345", "8"]) == {}
    assert groups_of_people(people, list("01234")) == {}


def test_three_groups_are_compared_pair_by_pair():
    people = {str(i): {"group": "abc"[i % 3]} for i in range(30)}
    rng = np.random.default_rng(8)
    values = rng.normal(10, 1, 30) + 5 * (np.arange(30) % 3 == 2)
    names = groups_of_people(people, list(people))["group"]
    found = compare_people([strip(values, 0.1)], list(people), people, "group", names)
    assert [(one.first, one.second) for one in found] == [("a", "b"), ("a", "c"), ("b", "c")]
    alone = compare_people([strip(values, 0.1)], list(people), people, "group", ("a", "c"))[0]
    assert (found[1].low, found[1].high, found[1].p) == (alone.low, alone.high, alone.p)
    # Holm over three pairs
    ordered = sorted(found, key=lambda one: one.p)
    assert ordered[0].p_adjusted == pytest.approx(3 * ordered[0].p)
    assert [one.p_adjusted < 0.05 for one in found] == [False, True, True]


def test_ages_part_nobody():
    people = {str(i): {"age": str(20 + i % 9)} for i in range(45)}
    assert groups_of_people(people, list(people)) == {}


def test_without_errors_of_their_own_it_is_the_test_of_welch():
    rng = np.random.default_rng(4)
    values = rng.normal(10, 2, 23) + np.arange(23) % 2
    found = compare_people(
        [strip(values, 0.0)], list(map(str, range(23))), people_of(23), "group", ("a", "b")
    )[0]
    other = ttest_ind(values[1::2], values[::2], equal_var=False)
    low, high = other.confidence_interval()
    assert (found.low, found.high) == pytest.approx((low, high))
    assert found.p == pytest.approx(other.pvalue)
    assert (found.n_first, found.n_second) == (12, 11)


def test_exchanging_the_groups_turns_the_sign_and_a_person_counts_once():
    rng = np.random.default_rng(5)
    values, persons = rng.normal(10, 2, 20), [str(i) for i in range(20)]
    one = compare_people([strip(values, 0.5)], persons, people_of(20), "group", ("a", "b"))[0]
    other = compare_people([strip(values, 0.5)], persons, people_of(20), "group", ("b", "a"))[0]
    assert (other.change, other.low, other.high) == pytest.approx(
        (-one.change, -one.high, -one.low)
    )
    # Everybody came twice, and gave the same: nobody became two people.
    twice = strip(np.tile(values, 2), 0.5 * np.sqrt(2))
    again = compare_people([twice], persons * 2, people_of(20), "group", ("a", "b"))[0]
    assert (again.low, again.high) == pytest.approx((one.low, one.high))
    assert again.n_first == 10


@pytest.mark.study
def test_the_interval_between_groups_covers_the_truth():
    rng = np.random.default_rng(6)
    persons, people, hits, draws = [str(i) for i in range(16)], people_of(16), 0, 200
    for _ in range(draws):
        errors = rng.uniform(0.2, 2.0, 16)
        values = rng.normal(np.arange(16) % 2, 1.0) + errors * rng.normal(size=16)
        found = compare_people([strip(values, errors)], persons, people, "group", ("a", "b"))[0]
        hits += found.low <= 1.0 <= found.high
    assert 0.91 <= hits / draws <= 0.995


class Study:
    """Folders of sessions as the level participant leaves them."""

    def __init__(self, top: Path) -> None:
        self.data, self.out = top / "data", top / "out"
        self.out.mkdir()
        self.data.mkdir()
        self.sessions: list[StudySession] = []

    def add(
        self,
        person,
        stiffness=100.0,
        *,
        key=None,
        state="done",
        checks=(),
        session="1",
        missing=False,
    ):
        session = StudySession(person, session, self.data / f"{len(self.sessions)}")
        self.sessions.append(session)
        if missing:
            return session
        folder = self.out / session.folder
        folder.mkdir(parents=True)
        files = {}
        if stiffness is not None:
            header = ["condition", "n_trials", "level", "K_11", "sd_K_11"]
            rows = [
                [name, 40, "hand", k, 5, k - 10, k + 10]
                for name, k in (("calm", stiffness), ("tense", 2 * stiffness))
            ]
            write(folder / "hand.csv", [[*header, "ci_low_K_11", "ci_high_K_11"], *rows])
            files["hand.csv"] = f"{stiffness!r}"
            (folder / "report.html").write_text("report")
            files["report.html"] = "x"
        if checks:
            head = ["kind", "name", "state", "message"]
            verdict = next((s for s in ("unusable", "warning") if s in dict(checks).values()), "ok")
            table = [head, ["verdict", "", verdict, "told"]]
            table += [["check", name, how, f"seen of {name}"] for name, how in checks]
            write(folder / "checks.csv", table)
            files["checks.csv"] = f"checks {person}"
        step = {"command": "inspect '{recording}'", "status": 0, "key": key or person}
        reason = "" if state == "done" else f"armimpedance inspect: {session.recording}: no trials"
        files = {name: sha256((folder / name).read_bytes()).hexdigest() for name in files}
        record = {"state": state, "reason": reason, "steps": [step], "files": files}
        (folder / "session.json").write_text(json.dumps(record))
        (folder / "log.txt").write_text("log")
        return session

    def group(self, command=lambda _: 0, steps=()):
        design = StudyDesign((), steps, (), None, self.data)
        return run_group(self.sessions, design, self.data, self.out, command)


def write(file, rows):
    with open(file, "w", newline="", encoding="utf-8") as stream:
        csv.writer(stream, lineterminator="\n").writerows(rows)


class Seen(HTMLParser):
    """Rows of the table of marks, addresses and elements of a page."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.links, self.rows, self.tags, self.words = [], [], [], ""
        self._row = False
        self._skip = False
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self._skip = tag in ("script", "style")
        if tag == "a" and not dict(attrs)["href"].startswith("#"):
            self.links.append(dict(attrs)["href"])
        if tag == "tr":
            self._row = "data-state" in dict(attrs)
            if self._row:
                self.rows.append("")

    def handle_data(self, data):
        if self._skip:
            return
        self.words += data
        if self._row:
            self.rows[-1] += data


@pytest.fixture
def study(tmp_path):
    return Study(tmp_path)


def test_every_session_stands_once_in_the_table_and_every_link_leads_somewhere(study):
    for i in range(6):
        study.add(f"p{i}", 100 + i, checks=[("rate", "ok"), ("axes", "warning" if i else "ok")])
    study.add("stopped", None, state="failed", checks=[("axes", "unusable")])
    study.add("broken", None, state="failed")
    study.add("away", missing=True)
    study.add("ünïcode 7", 104.5)
    made = study.group()
    seen = Seen(made.page)
    for session in study.sessions:
        assert sum(row.strip().startswith(str(session)) for row in seen.rows) == 1, session
    assert len(seen.rows) == len(study.sessions)
    assert len(seen.links) >= 2 * 7
    for link in seen.links:
        assert (made.folder / unquote(link)).resolve().is_file(), link
    assert "7 of 10 sessions can be used, 5 of them with care" in seen.words
    assert "1 session: inspect: no trials" in seen.words
    assert "1 session: cannot be used: axes" in seen.words
    # What failed stands before what can be used.
    order = [row.strip().split()[0] for row in seen.rows]
    assert order[:3] == ["broken", "stopped", "away"]
    assert order[-1] in ("p0", "ünïcode")


def test_a_hostile_name_is_text(study):
    for i in range(8):
        study.add(f"p{i}", 100 + i)
    study.add(HOSTILE, 900.0, checks=[(HOSTILE, "warning")])
    seen = Seen(study.group().page)
    plain = [tag for tag in seen.tags if tag == "img"]
    assert len(plain) == 1  # the picture of the strips
    assert any(HOSTILE in row for row in seen.rows)


def test_an_outlier_is_on_the_page_and_in_a_table_and_goes_with_its_reason(study):
    rng = np.random.default_rng(7)
    for i, k in enumerate(rng.normal(100, 8, 20)):
        study.add(f"p{i}", k)
    made = study.group()
    assert not (made.folder / "outliers.csv").exists()
    assert "Nobody is far" in Seen(made.page).words
    study.add("odd", 1000.0)
    made = study.group()
    with open(made.folder / "outliers.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert {row["participant"] for row in rows} == {"odd"}
    assert {row["condition"] for row in rows} == {"calm", "tense"}
    assert "1 session far from the others (odd 1)" in Seen(made.page).words


def test_equal_bytes_are_named_also_under_another_name_and_empty_folders_are_not(study):
    study.add("a", 100.0, key="k1")
    study.add("b", 101.0, key="k2")
    study.add("same key", 100.5, key="k1")
    study.add("same numbers", 101.0, key="k9")
    study.add("empty", None, state="failed", key="k3")
    study.add("empty too", None, state="failed", key="k3")
    words = Seen(study.group().page).words
    assert "same key 1 = a 1" in words
    assert "same numbers 1 = b 1" in words
    assert "empty too 1 =" not in words
    assert "2 sessions held twice" in words


def test_a_copy_and_a_session_that_cannot_be_used_have_no_say(study):
    for i in range(4):
        study.add(f"p{i}", 100.0 + i)
    study.add("copy", 103.0)
    study.add("stopped", 500.0, state="failed", checks=[("axes", "unusable")])
    names = [*(f"p{i}" for i in range(4)), "copy", "stopped"]
    lines = [f"{name}\t{'x' if i < 2 else 'y'}" for i, name in enumerate(names)]
    (study.data / "participants.tsv").write_text("\n".join(["participant_id\tgroup", *lines]))
    assert not (study.group().folder / "people_groups.csv").exists()
    study.add("p4", 110.0)
    study.add("p5", 111.0)
    lines += ["p4\tx", "p5\ty"]
    (study.data / "participants.tsv").write_text("\n".join(["participant_id\tgroup", *lines]))
    with open(study.group().folder / "people_groups.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["condition"], row["n_first"], row["n_second"]) for row in rows] == [
        ("calm", "3", "3"),
        ("tense", "3", "3"),
    ]


@pytest.fixture
def calls():
    made = []

    def command(words):
        made.append(words)
        return 0

    command.made = made
    return command


def test_conditions_are_compared_over_people_unless_the_design_says_otherwise(study, calls):
    study.add("a", 100.0)
    study.add("b", 101.0)
    study.group(calls)
    assert calls.made == []
    study.add("c", 102.0)
    study.group(calls)
    assert [words[0] for words in calls.made] == ["compare"]
    assert "session" not in calls.made[0]
    parse(calls.made[0])
    study.group(calls, (StudyStep(("other",)),))
    assert calls.made[1] == ["other"]


def test_who_came_twice_is_compared_session_by_session(study, calls):
    for name in "abc":
        for number in "12":
            study.add(name, 100.0 + ord(name) + int(number) / 8, session=number)
    study.group(calls)
    assert calls.made[0][2:6] == ["--by", "condition", "--by", "session"]
    # Days of their own: no two groups that people share.
    calls.made.clear()
    for session in list(study.sessions):
        shutil.rmtree(study.out / session.folder)
    study.sessions.clear()
    for i, name in enumerate("aabbcc"):
        study.add(name, 200.0 + i, session=f"day {i}")
    study.group(calls)
    assert calls.made == []


def test_a_study_in_which_all_failed_has_a_page_that_says_so(study):
    study.add("a", None, state="failed")
    study.add("b", missing=True)
    words = Seen(study.group().page).words
    assert "0 of 2 sessions can be used" in words
    assert "Cannot be used" in words


def test_fits_and_long_tables_are_set_side_by_side_too(study, tmp_path):
    head = ["participant", "session", "parameter", "joint", "value", "sd", "unit"]
    rows = [["a", "1", "K", "elbow", 30, 2, "N m/rad"], ["b", "1", "K", "elbow", 40, 3, "N m/rad"]]
    write(tmp_path / "fit.csv", [[*head, "ci_low", "ci_high"], *([*r, 20, 50] for r in rows)])
    head = ["participant", "session", "hand", "condition", "quantity", "value", "lower", "upper"]
    rows = [["a", "1", "left", "calm", "K_size", 30, 20, 45], ["b", "1", "", "calm", "K_size", 5]]
    write(tmp_path / "long.csv", [head, rows[0], [*rows[1], "", ""]])
    tables = {name: tmp_path / name for name in ("fit.csv", "long.csv")}
    fit, long = strips_of(tables, {("a", "1"): 0, ("b", "1"): 1}, ["hand"])
    assert (fit.quantity, fit.condition, fit.unit, fit.kind) == (
        "K",
        "elbow",
        "N m/rad",
        "difference",
    )
    np.testing.assert_array_equal(fit.values, [30, 40])
    np.testing.assert_array_equal(fit.errors, [2, 3])
    # No limits: nothing is known of the second one's error.
    assert (long.condition, long.kind, list(long.sessions)) == ("calm", "ratio", [0])
    assert long.errors[0] == pytest.approx(np.log(45 / 20) / (2 * 1.96), rel=1e-4)


def test_a_result_that_was_taken_away_makes_the_session_missing(study):
    for i in range(3):
        session = study.add(f"p{i}", 100.0 + i)
    (study.out / session.folder / "hand.csv").unlink()
    made = study.group()
    assert made.unusable == 1
    assert dict(made.rows) == {"hand.csv": 4}
    assert "2 of 3 sessions can be used" in Seen(made.page).words


def test_the_same_sessions_give_the_same_page(study):
    for i in range(9):
        study.add(f"p{i}", 100.0 + i)
    first = study.group().page.read_bytes()
    assert study.group().page.read_bytes() == first
