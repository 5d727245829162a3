"""`armimpedance inspect --out`: what a table of many recordings is made of."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import pytest
from sessions import pushes

from armimpedance.__main__ import main
from armimpedance.app.inspection import inspect
from armimpedance.recordings.tables.folder import write_folder
from armimpedance.show.verbs.results import read


@pytest.fixture(scope="module")
def recording():
    return pushes(2, ("cocontraction_10",))


@pytest.fixture(scope="module")
def session(recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp("inspected") / "session"
    write_folder(recording, folder, "parquet")
    return folder


def rows(file):
    with open(file, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_every_check_is_a_row_beside_the_verdict_and_the_facts(session, tmp_path, capsys):
    assert main(["inspect", str(session), "--out", str(tmp_path / "c.csv")]) == 0
    printed = capsys.readouterr().out
    table = rows(tmp_path / "c.csv")
    found = inspect(session)
    checks = [row for row in table if row["kind"] == "check"]
    told = [(row["name"], row["state"], row["message"], row["would_have_seen"]) for row in checks]
    assert told == [(c.name, c.verdict, c.message, c.smallest) for c in found.checks]
    assert all(row["message"] in printed for row in checks)
    assert [row["state"] for row in table if row["kind"] == "verdict"] == [found.state]
    facts = {row["name"]: row["value"] for row in table if row["kind"] == "fact"}
    assert float(facts["trials"]) == 16
    samples = len(read(session).time_s)
    assert float(facts["duration"]) * float(facts["sample rate"]) == pytest.approx(samples)


def test_the_json_holds_the_same_and_no_path(session, tmp_path):
    assert main(["inspect", str(session), "--out", str(tmp_path / "c.json")]) == 0
    text = (tmp_path / "c.json").read_text()
    assert len(json.loads(text)["checks"]) == len(inspect(session).checks)
    assert str(session.parent) not in text


def test_equal_recordings_in_two_places_have_equal_files(session, recording, tmp_path):
    write_folder(recording, tmp_path / "elsewhere", "parquet")
    for name, source in (("a", session), ("b", tmp_path / "elsewhere")):
        main(["inspect", str(source), "--out", str(tmp_path / f"{name}.csv")])
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_what_cannot_be_used_says_why_in_its_file_too(recording, tmp_path, capsys):
    turned = replace(recording, force=-recording.force)
    write_folder(turned, tmp_path / "turned", "parquet")
    assert main(["inspect", str(tmp_path / "turned"), "--out", str(tmp_path / "c.csv")]) == 2
    table = rows(tmp_path / "c.csv")
    assert table[0]["kind"] == "verdict"
    assert table[0]["state"] == "unusable"
    assert "force sign" in table[0]["message"]
    capsys.readouterr()


def test_what_cannot_be_read_leaves_no_file_and_the_recording_is_never_replaced(
    session, tmp_path, capsys
):
    (tmp_path / "empty").mkdir()
    assert main(["inspect", str(tmp_path / "empty"), "--out", str(tmp_path / "c.csv")]) == 2
    assert not (tmp_path / "c.csv").exists()
    inside = session / "trials.csv"
    before = inside.read_bytes()
    assert main(["inspect", str(session), "--out", str(inside)]) == 2
    assert inside.read_bytes() == before
    capsys.readouterr()
