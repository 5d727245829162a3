"""A study: who is found, what is done again, what one that fails costs."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from armimpedance.app.study import (
    Processes,
    check_steps,
    chosen,
    find_sessions,
    read_design,
    run_group,
    run_participants,
    unknown_sessions,
)
from armimpedance.core.errors import InputError

DESIGN = """
steps = ["double {recording} --out twice.csv", "add twice.csv --out more.csv --by 1"]
group_steps = ["add twice.csv --out sum.csv --by 0"]
"""


class Fake:
    """Two commands on files with one number; it counts its calls."""

    def __init__(self) -> None:
        self.calls: list[str] = []

    def __call__(self, words: list[str]) -> int:
        """Run a command in the working folder."""
        command, source, _, out, *more = words
        self.calls.append(command)
        sys.stdout.write(f"{command} of {source}\n")
        lines = Path(source).read_text().split() if Path(source).is_file() else []
        values = [line.split(",")[-1] for line in lines[1:]]
        if not values or not all(value.isdigit() for value in values):
            sys.stderr.write(f"{command}: {source}: no number\n")
            return 2
        if values == ["13"]:
            return 1
        change = 0 if not more else int(more[1])
        made = [2 * int(v) if command == "double" else int(v) + change for v in values]
        Path(out).write_text("\n".join(["value", *map(str, made)]) + "\n")
        return 0


def here(work: Callable, tasks: object) -> object:
    """An engine: this process."""
    return map(work, tasks)


def is_recording(path: Path) -> bool:
    return path.suffix == ".rec"


@pytest.fixture
def data(tmp_path):
    for number in (1, 2, 3):
        folder = tmp_path / f"data/sub-0{number}/ses-a"
        folder.mkdir(parents=True)
        (folder / "hand.rec").write_text(f"value\n{number}\n")
    (tmp_path / "data/study.toml").write_text(DESIGN)
    return tmp_path / "data"


def run(data: Path, out: Path, command: Callable, engine: Callable = here) -> list:
    design = read_design(None, data)
    sessions = find_sessions(data, design.recordings, is_recording)
    return list(run_participants(sessions, design, out, command, engine))


def content(folder: Path) -> dict[str, bytes]:
    """Every file of a study but those of its store."""
    files = (p for p in folder.rglob("*") if p.is_file())
    named = {p.relative_to(folder).as_posix(): p.read_bytes() for p in files}
    return {name: held for name, held in named.items() if not name.startswith(".store")}


def test_every_session_has_its_results_and_a_second_run_does_nothing(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    first = run(data, out, command)
    assert [one.outcome.state for one in first] == ["done"] * 3
    assert (out / "sub-03/ses-a/more.csv").read_text() == "value\n7\n"
    before = content(out)
    command.calls.clear()
    second = run(data, out, command)
    assert command.calls == []
    assert [one.outcome.recomputed for one in second] == [0] * 3
    assert content(out) == before


def test_what_changed_is_done_again_and_nothing_else(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    run(data, out, command)
    command.calls.clear()
    (data / "sub-02/ses-a/hand.rec").write_text("value\n20\n")
    run(data, out, command)
    assert command.calls == ["double", "add"]
    assert (out / "sub-02/ses-a/more.csv").read_text() == "value\n41\n"
    command.calls.clear()
    # A later step's words: the earlier one's result is read, not made again.
    (data / "study.toml").write_text(DESIGN.replace("--by 1", "--by 5"))
    run(data, out, command)
    assert command.calls == ["add"] * 3
    command.calls.clear()
    # Back again: both are known.
    (data / "study.toml").write_text(DESIGN)
    run(data, out, command)
    assert command.calls == []
    assert (out / "sub-01/ses-a/more.csv").read_text() == "value\n3\n"


def test_a_step_that_is_the_same_on_other_bytes_stops_the_change_there(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    run(data, out, command)
    command.calls.clear()
    (data / "sub-02/ses-a/hand.rec").write_text("other\n2\n")
    run(data, out, command)
    assert command.calls == ["double"]  # its result is the same number


def test_data_that_were_moved_are_the_same_data(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    run(data, out, command)
    command.calls.clear()
    moved = data.rename(tmp_path / "elsewhere")
    assert [one.outcome.recomputed for one in run(moved, out, command)] == [0] * 3
    assert str(moved) in (out / "sub-01/ses-a/log.txt").read_text()


def test_one_that_fails_is_a_row_and_the_others_are_unharmed(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    (data / "sub-02/ses-a/hand.rec").write_text("value\nx\n")
    shutil.copytree(data / "sub-02", data / "sub-04")
    found = {str(one.session): one.outcome for one in run(data, out, command)}
    assert {name: one.state for name, one in found.items()} == {
        "01 a": "done",
        "02 a": "failed",
        "03 a": "done",
        "04 a": "failed",
    }
    # Equal bytes, one result: the message still names each one's own file.
    assert "sub-04/ses-a/hand.rec: no number" in found["04 a"].reason
    design = read_design(None, data)
    sessions = find_sessions(data, None, is_recording)
    made = run_group(sessions, design, data, out, command)
    assert made.unusable == 2
    assert dict(made.rows) == {"more.csv": 2, "twice.csv": 2}
    assert (out / "group/twice.csv").read_text() == "participant,session,value\n01,a,2\n03,a,6\n"
    rows = (out / "group/sessions.csv").read_text().splitlines()
    assert [row.split(",")[3] for row in rows[1:]] == ["done", "failed", "done", "failed"]


def test_what_the_machine_did_is_tried_again_and_what_the_input_did_is_not(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    (data / "sub-01/ses-a/hand.rec").write_text("value\n13\n")  # ends with status 1
    (data / "sub-02/ses-a/hand.rec").write_text("value\nx\n")  # ends with status 2
    run(data, out, command)
    command.calls.clear()
    run(data, out, command)
    assert command.calls.count("double") == 1


def test_files_of_ones_own_in_a_session_stay_and_files_of_an_old_design_go(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    run(data, out, command)
    (out / "sub-01/ses-a/notes.txt").write_text("mine")
    (data / "study.toml").write_text('steps = ["double {recording} --out other.csv"]')
    run(data, out, command)
    held = {path.name for path in (out / "sub-01/ses-a").iterdir()}
    assert held == {"notes.txt", "other.csv", "log.txt", "session.json"}


def test_a_result_that_somebody_deleted_comes_back(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    run(data, out, command)
    before = content(out)
    (out / "sub-01/ses-a/more.csv").unlink()
    shutil.rmtree(out / "sub-02")
    command.calls.clear()
    run(data, out, command)
    assert content(out) == before
    assert command.calls == []


def test_a_damaged_store_costs_work_and_no_result(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    run(data, out, command)
    before = content(out)
    for number, path in enumerate(sorted((out / ".store").rglob("*.*"))):
        if path.is_file() and path.name != "seen.json":
            path.unlink() if number % 2 else path.write_bytes(b"{")
    (out / ".store/seen.json").write_bytes(b"[1, 2")
    shutil.rmtree(out / "sub-01")
    assert [one.outcome.state for one in run(data, out, command)] == ["done"] * 3
    assert content(out) == before


OTHERS = '{"state": "done", "steps": [], "files": {"../../../mine.txt": "0"}}'


@pytest.mark.parametrize("damage", ["[" * 100_000, OTHERS, "{}"])
def test_a_damaged_record_costs_work_and_no_file_of_others(data, tmp_path, damage):
    command, out = Fake(), tmp_path / "out"
    run(data, out, command)
    before = content(out)
    mine = tmp_path / "mine.txt"
    mine.write_text("mine")
    for path in [*out.rglob("session.json"), *out.rglob("step.json"), out / ".store/seen.json"]:
        path.write_text(damage)
    assert [one.outcome.state for one in run(data, out, command)] == ["done"] * 3
    assert content(out) == before
    assert mine.read_text() == "mine"


def test_a_table_that_was_changed_is_not_gathered_and_comes_back(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    sessions = run(data, out, command)
    design = read_design(None, data)
    args = ([one.session for one in sessions], design, data, out, command)
    whole = run_group(*args)
    table = out / "sub-02/ses-a/twice.csv"
    table.unlink()
    table.write_bytes(b"value\n\xe4\n")
    changed = run_group(*args)
    assert dict(changed.rows)["twice.csv"] == dict(whole.rows)["twice.csv"] - 1
    told = (out / "group/sessions.csv").read_text()
    assert "twice.csv was changed" in told
    run(data, out, command)
    assert run_group(*args).rows == whole.rows


def test_people_that_cannot_be_read_are_one_line(data, tmp_path):
    out = tmp_path / "out"
    sessions = [one.session for one in run(data, out, Fake())]
    (data / "participants.tsv").write_bytes(b"participant_id\tage\nsub-01\t\xe4\n")
    with pytest.raises(InputError, match="participants.tsv: is not UTF-8"):
        run_group(sessions, read_design(None, data), data, out, Fake())


def test_a_dry_run_tells_who_has_work_and_writes_nothing(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    design = read_design(None, data)
    sessions = find_sessions(data, None, is_recording)
    assert unknown_sessions(sessions, design, out) == sessions
    assert not out.exists()
    run(data, out, command)
    (data / "sub-03/ses-a/hand.rec").write_text("value\n8\n")
    assert [s.participant for s in unknown_sessions(sessions, design, out)] == ["03"]


def test_people_are_found_in_folders_of_any_names(tmp_path):
    for name in ("ann/mon.rec", "ann/tue.rec", "ben.rec", "cem/exam.rec", "dee/notes.txt"):
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_text("")
    found = find_sessions(tmp_path, None, is_recording)
    # A folder without a recording is a row too: who has none is told.
    assert [(s.participant, s.session) for s in found] == [
        ("ann", "mon"),
        ("ann", "tue"),
        ("ben", ""),
        ("cem", "exam"),
        ("dee", ""),
    ]
    assert [s.participant for s in chosen(found, ["sub-ben"])] == ["ben"]
    with pytest.raises(InputError, match="eve"):
        chosen(found, ["eve"])
    picked = find_sessions(tmp_path, "*/t*.rec", is_recording)
    assert [str(s) for s in picked] == ["ann tue"]


def test_several_recordings_of_one_session_have_folders_of_their_own(tmp_path):
    for name in ("left", "right"):
        file = tmp_path / f"sub-1/ses-2/{name}.rec"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("")
    found = find_sessions(tmp_path, None, is_recording)
    assert len({s.folder for s in found}) == 2


def test_names_that_make_one_folder_are_refused(tmp_path):
    for name in ("sub-a b", "sub-a-b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "x.rec").write_text("")
    with pytest.raises(InputError, match="sub-a-b"):
        find_sessions(tmp_path, None, is_recording)


@pytest.mark.parametrize(
    "text",
    [
        'steps = "inspect"',
        "steps = [1]",
        'steps = [""]',
        'steps = ["inspect {who}"]',
        'steps = ["inspect \'x"]',
        'step = ["inspect {recording}"]',
        'recordings = "../*.rec"',
        "steps = [",
        "\0",
    ],
)
def test_a_design_that_is_wrong_is_refused_before_any_work(tmp_path, text):
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(InputError, match="study.toml"):
        read_design(None, tmp_path)


def test_a_step_that_is_no_call_of_a_command_is_refused_before_any_work(tmp_path):
    from armimpedance.app.cli.study import parse

    check_steps(read_design(None, tmp_path), parse)
    (tmp_path / "study.toml").write_text('steps = ["estimate {recording} --bye condition"]')
    with pytest.raises(InputError, match="estimate"):
        check_steps(read_design(None, tmp_path), parse)


def test_work_begins_before_every_session_is_looked_at(data, tmp_path):
    """The engine takes tasks one by one; those that are known come between, counted with them."""
    command, out = Fake(), tmp_path / "out"
    run(data, out, command)
    (data / "sub-01/ses-a/hand.rec").write_text("value\n10\n")
    asked = []

    def lazy(work, tasks):
        for task in tasks:
            asked.append(task.name)
            yield work(task)

    ended = run(data, out, command, lazy)
    assert asked == ["sub-01/ses-a"]
    assert [one.done for one in ended] == [1, 2, 3]
    assert {one.session.participant for one in ended} == {"01", "02", "03"}
    assert sum(one.outcome.recomputed for one in ended) == 2


def test_a_study_that_is_all_known_starts_no_engine(data, tmp_path):
    command, out = Fake(), tmp_path / "out"
    run(data, out, command)

    def none(work, tasks):
        pytest.fail("an engine was started")

    assert len(run(data, out, command, none)) == 3


@pytest.mark.study
def test_processes_take_tasks_only_as_they_are_free(tmp_path):
    taken = []

    def tasks():
        for number in range(20):
            taken.append(number)
            yield Named(f"task {number}")

    engine = Processes(1)(Nothing(), tasks())
    assert next(engine).name.startswith("task ")
    assert len(taken) < 6
    assert len(list(engine)) == 19


@dataclass(frozen=True)
class Named:
    """A task that is nothing but its name."""

    name: str


class Nothing:
    """Work that gives the task back."""

    def __call__(self, task):
        return task

    def failed(self, task, _problem):
        return task
