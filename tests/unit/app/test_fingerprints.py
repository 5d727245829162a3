"""The same calls give the same bytes, whatever the order of sets and the folder; changes show."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

pytestmark = pytest.mark.study

SCRIPT = Path(__file__).resolve().parents[2] / "fingerprints" / "fingerprints.py"


@pytest.fixture(scope="module")
def script():
    return runpy.run_path(str(SCRIPT))


@pytest.fixture(scope="module")
def runs(script, tmp_path_factory):
    """The small list of calls, run twice with other hashes of texts."""
    lines, made = script["calls"](small=True), []
    with pytest.MonkeyPatch.context() as patch:
        for seed in ("1", "2"):
            patch.setenv("PYTHONHASHSEED", seed)
            made.append(script["run"](lines, tmp_path_factory.mktemp("run") / "folder"))
    return made


def test_two_runs_print_and_write_the_same_bytes(script, runs):
    first, second = runs
    assert all(entry["status"] == 0 for entry in first.values())
    assert list(script["differences"](first, second)) == []
    assert sum(len(entry["files"]) for entry in first.values()) >= 5


def test_a_byte_that_changes_a_file_that_is_missing_and_a_call_that_is_new_are_seen(script, runs):
    first, second = ({call: {**entry} for call, entry in run.items()} for run in runs)
    call, other, *_ = [call for call, entry in first.items() if entry["files"]]
    name = next(iter(first[call]["files"]))
    second[call]["files"] = {**first[call]["files"], name: "0"}
    second[other]["files"] = {}
    second["999 new"] = second[other]
    found = list(script["differences"](first, second))
    assert f"{call}: {name}" in found
    assert sum(line.startswith(other) for line in found) == len(first[other]["files"])
    assert "999 new: in one of the two only" in found


def test_the_whole_list_covers_every_topic(script):
    words = {line.split()[0] for line in script["calls"]()}
    topics = "estimate map compare plan movement random fit predict elbow passive body therapy"
    assert set(topics.split()) <= words
    assert len(script["calls"]()) >= 120
