"""A design that comes with the data may compute in its own folders, and nothing else."""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from sessions import pushes

from armimpedance.__main__ import main
from armimpedance.app.cli.main import COMMANDS, make_parser
from armimpedance.app.cli.study import command, parse
from armimpedance.app.study import StudySession, array_script, check_steps, read_design
from armimpedance.app.study.allowed import STEP_COMMANDS
from armimpedance.app.study.chain import carry_out
from armimpedance.app.study.participants import task_of
from armimpedance.app.study.store import Fingerprints, Store
from armimpedance.core.errors import InputError
from armimpedance.core.outputs import staged_file, staged_folder, written_within
from armimpedance.recordings import write_recording
from armimpedance.show.command.outputs import OutputPath

DOCS = Path(__file__).resolve().parents[4] / "docs/reference/study.md"


def simulated(folder: Path) -> None:
    folder.parent.mkdir(parents=True, exist_ok=True)
    write_recording(pushes(1, ("cocontraction_10",)), folder, table="csv")


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A folder with data of one person, whose sessions have no name, and somebody's own files."""
    top = tmp_path_factory.mktemp("foreign")
    simulated(top / "data/sub-1")
    (top / "mine").mkdir()
    (top / "mine/secret.csv").write_text("trial,why\n1,mine\n")
    return top


def held(top: Path) -> dict[str, bytes]:
    """Every file and folder that is neither the study's nor its design."""
    own = (top / "out", top / "data/study.toml")
    return {
        path.relative_to(top).as_posix(): path.read_bytes() if path.is_file() else b""
        for path in top.rglob("*")
        if not any(path.is_relative_to(one) for one in own)
    }


def write_design(folder: Path, *steps: str, group: tuple[str, ...] = ()) -> Path:
    file = folder / "study.toml"
    file.write_text(f"steps = {json.dumps(steps)}\ngroup_steps = {json.dumps(group)}\n")
    return file


WRITES = (
    "inspect {{recording}} --out {top}/mine/x.csv",
    "inspect {{recording}} --out={top}/mine/x.csv",
    "inspect {{recording}} --ou {top}/mine/x.csv",
    "inspect {{recording}} --fig={top}/mine/x.png",
    "inspect {{recording}} --out x.csv --figure {top}/mine/x.png",
    "inspect {{recording}} --out {{study}}/x.csv",
    "inspect {{recording}} --out {{study}}/../mine/x.csv",
    "inspect {{recording}} --out ../x.csv",
    "inspect {{recording}} --out a/../../x.csv",
    "inspect {{recording}} --out ~/x.csv",
    "inspect {{recording}} --out {{recording}}.csv",
    # The session has no name: what follows would be an absolute path.
    "inspect {{recording}} --out {{session}}{top}/mine/x.csv",
    "inspect {{recording}} --out .{{session}}./x.csv",
    "inspect {{recording}} --out {{participant:.0}}{top}/mine/x.csv",
    "inspect {{recording}} --out {{participant:/>9}}x.csv",
    "convert {{recording}} {top}/mine/copy",
    "convert {{recording}} {{study}}/../copy",
    "share {{recording}} --as bids --out {top}/mine/shared",
    "plan --pilot {{recording}} --out-profile {top}/mine/x.csv",
    "therapy contribution {{recording}} --robot r.json --arm a.json --samples {top}/mine/x.csv",
)
READS = (
    "trials {{recording}} --out page.html --leave-out {top}/mine/secret.csv",
    "trials {{recording}} --out page.html --leave={top}/mine/secret.csv",
    "trials {{recording}} --out page.html --leave-out {{study}}/../mine/secret.csv",
    "trials {{recording}} --out page.html --leave-out {{study}}-of-others/secret.csv",
    "trials {{recording}} --out page.html --leave-out {{session}}{top}/mine/secret.csv",
    "trials {{recording}} --out page.html --leave-out {{recording}}/../../../mine/secret.csv",
    "trials {{recording}} --out page.html --leave-out ~/secret.csv",
    "compare {{recording}} {top}/mine/secret.csv --by condition --out x.csv",
    "map hand.csv --recording {{recording}} --to muscle --arm {top}/mine/secret.csv --out x.csv",
    "discriminate --group a {top}/mine/a.json --group b {top}/mine/b.json --out x.csv",
)
#: Commands that serve, show, start studies, or write where nobody asked them to.
NO_STEPS = (
    "demo --quick --out x",
    "live model.json --udp 9000 --host 0.0.0.0",
    "app",
    "new --for kinarm x",
    "study {{study}} x participant",
    "map-columns {{recording}}",
    "simulate cocontraction --sets 1 --out {{study}}/../x",
    "simulate-study {{study}}/study.toml --out x --scheduler tcp://host:8786",
    "benchmark make --out x --key {top}/mine/key",
    "figures --out x",
    "{{participant}} {{recording}}",
    "--version",
    "nothing",
)


@pytest.mark.parametrize("step", [*WRITES, *READS, *NO_STEPS])
def test_a_hostile_step_is_refused_before_any_work(place, capsys, step):
    hostile = step.format(top=place)
    before = held(place)
    for level, steps, group in (
        ("participant", ("inspect {recording} --out checks.csv", hostile), ()),
        ("group", (), (hostile,)),
    ):
        file = write_design(place / "data", *steps, group=group)
        capsys.readouterr()
        assert main(["study", str(place / "data"), str(place / "out"), level]) == 2
        [line] = capsys.readouterr().err.splitlines()
        assert str(file) in line
        assert hostile.split()[0] in line
    assert held(place) == before
    assert not (place / "out").exists()


@pytest.mark.parametrize("step", WRITES)
def test_no_design_writes_elsewhere_not_even_one_that_was_named(place, capsys, step):
    file = write_design(place / "mine", step.format(top=place))
    words = ["study", str(place / "data"), str(place / "out"), "participant", "--dry-run"]
    assert main([*words, "--design", str(file)]) == 2
    file.unlink()
    assert not (place / "out").exists()


def test_a_design_that_was_named_may_read_what_its_steps_name(place):
    step = READS[0].format(top=place)
    file = write_design(place / "data", step)
    check_steps(read_design(file, place / "data"), parse)
    with pytest.raises(InputError):
        check_steps(read_design(None, place / "data"), parse)


@pytest.mark.parametrize(
    "step",
    [
        "estimate {recording} --by condition --out hand.csv --figure hand.png",
        "predict model.json --postures {study}/grid.csv --out grid.csv",
        "map hand.csv --recording {recording} --to muscle --arm {study}/arm.csv --out m.csv",
        "map hand.csv --recording {recording} --to muscle --arm arm26 --out m.csv",
        "trials {recording} --leave-out {study}/lists/{participant}.csv --out page.html",
        "trials {recording} --leave-out {recording}_left_out.csv --out {participant}.html",
        "estimate {recording} --where 'TP == 3 and a / b > .5' --out {participant}_{session}.csv",
        "share {recording} --as bids --subject {participant} --url https://a.org/b --out bids",
        "convert {recording} session --axes x,-z,y",
        "therapy robot {recording} --drawings {study}/drawings.json --out robot.json",
        "armimpedance inspect {recording}",
    ],
)
def test_what_a_study_needs_stays_allowed(tmp_path, step):
    write_design(tmp_path, step)
    check_steps(read_design(None, tmp_path), parse)


@pytest.mark.skipif(not DOCS.exists(), reason="the documentation is not beside")
def test_the_designs_of_the_page_and_the_default_are_allowed(tmp_path):
    check_steps(read_design(None, tmp_path), parse)
    shown = re.findall(r"^```toml\n(.*?)^```", DOCS.read_text(), re.MULTILINE | re.DOTALL)
    assert shown
    for text in shown:
        assert tomllib.loads(text)["steps"]
        (tmp_path / "study.toml").write_text(text)
        check_steps(read_design(None, tmp_path), parse)


@pytest.mark.skipif(not DOCS.exists(), reason="the documentation is not beside")
def test_the_page_lists_the_allowed_commands():
    [listed] = re.findall(r"- It runs a command(.*?)\. ", DOCS.read_text(), re.DOTALL)
    assert set(re.findall(r"`(\S+)`", listed)) == STEP_COMMANDS


# Which paths of a call are written, and what stops one that nobody knew of.

#: Arguments that are read. A new argument that names a file has to stand here or be an OutputPath.
READ = {
    *("recording", "recordings", "input", "inputs", "sources", "exam", "results", "model"),
    *("mapping", "leave_out", "skeleton", "forces", "standing", "robot", "arm", "drawings"),
    *("pilot", "movement", "postures", "activations", "inertia", "imcj", "validate"),
}


def parsers(words: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], argparse.ArgumentParser]]:
    """The parser of a command, and those of all that stand below it."""
    parser = make_parser(words)
    for word in words:
        parser = below(parser)[word]
    yield words, parser
    for name in below(parser):
        yield from parsers((*words, name))


def below(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    found = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    return dict(found[0].choices) if found else {}


def test_a_step_knows_only_commands_that_there_are():
    assert set(COMMANDS) > STEP_COMMANDS


@pytest.mark.parametrize("name", sorted(STEP_COMMANDS))
def test_every_path_of_an_allowed_command_is_read_or_known_as_an_output(name):
    written = 0
    for words, parser in parsers((name,)):
        for action in parser._actions:
            called = (*words, *action.option_strings, action.dest)
            assert action.type is not Path or action.dest in READ, called
            assert action.type is not OutputPath or action.dest not in READ, called
            assert action.dest not in ("out", "figure") or action.type is OutputPath, called
            written += action.type is OutputPath
    assert written


@pytest.mark.parametrize(
    "step",
    ["inspect {recording} --out {study}/x.csv", "convert {recording} {study}/x", "exam {study}"],
)
def test_what_the_check_does_not_see_the_writer_refuses(place, tmp_path, step):
    """The steps are carried out unchecked; the last one fails for its input, and writes nothing."""
    write_design(place / "data", step)
    session = StudySession("1", "", place / "data/sub-1")
    before = held(place)
    prints = Fingerprints()
    task = task_of(session, read_design(None, place / "data"))
    outcome = carry_out(task, Store(tmp_path / "store", prints), prints, command)
    assert outcome.state == "failed"
    assert held(place) == before


def test_a_persons_name_that_is_an_option_writes_nothing_elsewhere(tmp_path):
    data = tmp_path / "data"
    simulated(data / "sub---out")
    # Checked, this is a list of recordings; with the person's name it is an output beside the data.
    write_design(data, "estimate {recording} {participant} {study}/x.csv --method exact")
    design = read_design(None, data)
    check_steps(design, parse)
    before = held(data)
    prints = Fingerprints()
    task = task_of(StudySession("--out", "", data / "sub---out"), design)
    outcome = carry_out(task, Store(tmp_path / "store", prints), prints, command)
    assert outcome.state == "failed"
    assert "x.csv: lies outside" in str(outcome)
    assert held(data) == before


@pytest.mark.parametrize("name", ["sub-..", "sub-1/ses-.."])
def test_names_that_would_be_the_folder_above_are_refused(tmp_path, name):
    simulated(tmp_path / "data" / name / "hand")
    write_design(tmp_path / "data", "inspect {recording} --out {participant}x.csv")
    words = ["study", str(tmp_path / "data"), str(tmp_path / "out"), "participant"]
    assert main([*words, "--dry-run"]) == 2


def test_a_folder_bounds_what_is_written_as_long_as_it_is_asked(tmp_path):
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir()
    (inside / "link").symlink_to(tmp_path)
    with written_within(inside):
        with staged_file(inside / "a.txt") as file:
            file.write_text("a")
        with staged_folder(inside / "b") as folder:
            (folder / "recording.json").write_text("{}")
        for path in (outside, inside / "../outside", inside / "link/outside"):
            for stage in (staged_file, staged_folder):
                with pytest.raises(InputError, match="outside"), stage(path):
                    raise AssertionError("was opened")
    with staged_file(outside) as file:
        file.write_text("a")
    assert {path.name for path in inside.iterdir()} == {"a.txt", "b", "link"}
    assert outside.read_text() == "a"


# Scripts for SLURM.

HOSTILE_WORDS = (
    "a\ntouch X\n",
    "'\ntouch X\n'",
    "$(touch X)",
    "`touch X`",
    '"; touch X; "',
    "a\n#SBATCH --wrap='touch X'\n",
    "\\\ntouch X",
    "!! ~ * ?",
)


def test_hostile_words_of_a_script_stay_words(tmp_path):
    """The script runs as SLURM would run it; the job that it submits runs too."""
    tools, work = tmp_path / "tools", tmp_path / "work"
    tools.mkdir()
    work.mkdir()
    for name, text in {
        "sbatch": 'while [ $# -gt 0 ]; do [ "$1" = --wrap ] && sh -c "$2"; shift; done',
        "armimpedance": f"printf '%s\\0' CALL \"$@\" >> '{tmp_path}/calls'",
    }.items():
        (tools / name).write_text(f"#!/bin/sh\n{text}\ntrue\n")
        (tools / name).chmod(0o755)
    words = ["armimpedance", "study", *HOSTILE_WORDS]
    options = ["--design", *HOSTILE_WORDS]
    script = array_script(words, options, 1, "01:00:00", "4G")
    env = {
        "PATH": f"{tools}:{os.environ['PATH']}",
        "SLURM_ARRAY_TASK_ID": "0",
        "SLURM_ARRAY_JOB_ID": "1",
    }
    subprocess.run(["bash", "-c", script], check=True, cwd=work, env=env)
    assert list(work.iterdir()) == []
    calls = (tmp_path / "calls").read_text().split("CALL\0")
    group, share = (call.split("\0")[:-1] for call in calls[1:])
    assert group == [*words[1:], "group", *options]
    own = ["--workers", "1", "--task-index", "0", "--tasks", "1"]
    assert share == [*words[1:], "participant", *options, *own]


@pytest.mark.parametrize(
    "option",
    [
        ("--time", "1:0\ntouch X"),
        ("--time", "1:0 --uid=0"),
        ("--time", "$(touch X)"),
        ("--time", "1:2:3:4"),
        ("--time", ""),
        ("--time", "1:00\n"),
        ("--time", "١:٠٠"),
        ("--memory", "4G\ntouch X"),
        ("--memory", "4G; touch X"),
        ("--memory", "4X"),
        ("--memory", ""),
        ("--memory", "-4G"),
        ("--memory", "4\N{KELVIN SIGN}"),
    ],
)
def test_a_time_or_memory_that_slurm_does_not_know_makes_no_script(place, capsys, option):
    (place / "data/study.toml").unlink(missing_ok=True)
    words = ["study", str(place / "data"), str(place / "out"), "slurm-script", "--tasks", "2"]
    assert main([*words, "=".join(option)]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    [line] = told.err.splitlines()
    assert option[0] in line


@pytest.mark.parametrize("time", ["30", "30:00", "04:00:00", "2-0", "2-12:30", "2-12:30:00"])
@pytest.mark.parametrize(
    ("memory", "asked"), [("4G", "4G"), ("4GB", "4G"), ("4000M", "4000M"), ("4000", "4000M")]
)
def test_times_and_memory_as_slurm_takes_them(time, memory, asked):
    script = array_script(["armimpedance"], [], 2, time, memory)
    assert script.count(f"--time={time}") == script.count(f"--mem={asked}") == 2
