"""What `robot`, `arm` and `contribution` refuse: one line that says what to do, nothing written."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from therapy_bench import DRAWINGS, PERSON, PIPE, lifted, recorded

from armimpedance.__main__ import main
from armimpedance.core.records import Subject
from armimpedance.joint.therapy.arm.mockup import pipes
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm
from armimpedance.recordings.tables.folder import write_folder


@pytest.fixture(scope="module")
def bench(sound_bench):
    return sound_bench


def test_sound_files_are_taken_and_predict_other_movements(bench, tmp_path, capsys):
    moving = recorded([lifted("validation", axis) for axis in (0, 1, 3)], Subject("empty"))
    write_folder(moving, tmp_path / "moving")
    out = tmp_path / "robot.json"
    call = bench.call("robot", "--validate", tmp_path / "moving", out=out)
    assert main([str(a) for a in call]) == 0
    assert "movements that were not fitted" in capsys.readouterr().out
    validation = json.loads(out.read_text())["validation"]
    assert [v["joint"] for v in validation] == [1, 2, 3, 4, 5]
    # but for the slowest samples: v_s is set by rule, and is not the bench's
    assert min(validation[axis]["moving_r2"] for axis in (0, 1, 3)) > 0.99


def test_pipes_are_weighed(bench, tmp_path, capsys):
    ways = [lifted("passive", axis) for axis in (0, 1)]
    ways += [(t, q[::-1], -qd[::-1], qdd[::-1], row) for t, q, qd, qdd, row in ways]
    arm = PassiveArm("pipes", DRAWINGS.name, 0.32, pipes())
    # without its length: --upper-arm-m says it
    write_folder(recorded(ways, Subject("pipes"), arm, elastic=False), tmp_path / "pipes")
    call = ("therapy", "arm", tmp_path / "pipes", "--robot", bench.folder / "robot.json", *PIPE)
    call = (*call, "--pipe", "1.7,0.30,0.09", "--upper-arm-m", "0.32")
    assert main([str(a) for a in call]) == 0
    said = capsys.readouterr().out
    off = [float(word) for word in re.findall(r"([+-]\d+\.\d+) %", said)]
    assert len(off) == 2
    assert max(map(abs, off)) < 1.0


def table_with(recording, **columns):
    return replace(recording, trials=recording.trials.assign(**columns))


def without(recording, column):
    return replace(recording, trials=recording.trials.drop(columns=column))


def where(recording, **values):
    """Trials in which any of these columns has this value."""
    rows = np.zeros(recording.n_trials, dtype=bool)
    for column, value in values.items():
        rows |= (recording.trials[column] == value).to_numpy()
    return recording.select(rows)


def three_axes(recording):
    return replace(recording, position=recording.position[:, :3], force=recording.force[:, :3])


def sweeps_up(recording):
    """Without the second sweep of every pair, which goes down."""
    sweep = recording.trials["condition"].eq("sweep").to_numpy()
    return recording.select(~(sweep & (np.arange(len(sweep)) % 2 == 1)))


def two_speeds(recording):
    """The first four of an axis' eight sweeps, and the holds."""
    rows = np.arange(recording.n_trials)
    return recording.select((rows % 8 < 4) | (rows >= 40))


#: What happens to a recording, and words that its one line must hold.
OF_ANY = {
    "torque in mNm": (lambda r: replace(r, force=1e3 * r.force), ("tau1_Nm", "mNm", "59.5 N m")),
    "torque in kNm": (lambda r: replace(r, force=1e-3 * r.force), ("unit", "weight")),
    "wrong sign": (lambda r: replace(r, force=-r.force), ("other sign", "force_by")),
    "interaction": (lambda r: replace(r, torque="interaction"), ("interaction", "'commanded'")),
    "which torque": (lambda r: replace(r, torque=None), ("does not say", "'commanded'")),
    "degrees": (lambda r: replace(r, position=np.rad2deg(r.position)), ("degrees", "radians")),
    "far angles": (lambda r: replace(r, position=2.5 * r.position), ("q1_rad", "range of axis 1")),
    "no torque": (lambda r: replace(r, force=0 * r.force), ("motor torques are all zero",)),
    "three axes": (three_axes, ("3 axes", "the 5", "pronation")),
}
OF_CALIBRATION = {
    "no axis": (lambda r: without(r, "axis"), ("column axis",)),
    "no onset": (lambda r: without(r, "onset_s"), ("column onset_s", "a number for every sweep")),
    "words": (lambda r: table_with(r, axis="one"), ("column axis", "trial 1: 'one'", "a number")),
    "word": (lambda r: table_with(r, approach="below"), ("column approach", "'below'", "a number")),
    "axis 9": (lambda r: table_with(r, axis=9), ("axis 9", "1 to 5")),
    "sweeps one way": (sweeps_up, ("axis 1", "one direction only", "both")),
    "two speeds": (two_speeds, ("axis 1", "speeds", "3 or more")),
    "no sweeps": (lambda r: where(r, condition="hold"), ("no sweeps of axis 1", "'sweep'")),
    "neither": (lambda r: table_with(r, condition="passive"), ("no sweeps of axis 1", "'sweep'")),
    "holds one way": (
        lambda r: where(r, condition="sweep", approach=1),
        ("column approach", "from below (1)", "from above (-1)"),
    ),
    "no approach": (lambda r: without(r, "approach"), ("column approach", "0 of 5 angles")),
    "half an approach": (lambda r: table_with(r, approach=0.5), ("approach 0.5", "-1 from above")),
    "no holds": (lambda r: where(r, condition="sweep"), ("no holds", "spring", "4 or more")),
    "short": (lambda r: table_with(r, end_s=0.1), ("trial 1", "end_s", "0.15 s or more")),
}
OF_SESSION = {
    "two": (lambda r: r.select([0, 1, 3]), ("2 passive repetitions of", "elevation", "3 or more")),
    "one": (lambda r: r.select([0, 3]), ("1 passive repetition of", "elevation", "3 or more")),
    "none": (lambda r: r.select([3]), ("missing passive calibration", "half_active", "3 or more")),
    "no mass": (
        lambda r: replace(r, subject=replace(PERSON, mass_kg=None)),
        ("body mass is not known", "subject.mass_kg", "--mass-kg"),
    ),
    "no length": (
        lambda r: replace(r, subject=replace(PERSON, upper_arm_m=None)),
        ("upper arm's length is not known", "--upper-arm-m"),
    ),
    "no forearm": (
        lambda r: replace(r, subject=replace(PERSON, forearm_hand_m=None)),
        ("forearm's length is not known", "--forearm-m"),
    ),
    "axis 0": (lambda r: table_with(r, axis=0), ("trial 1", "axis 0", "1 to 5")),
    "name": (
        lambda r: table_with(r, movement="horizontal", axis=1),
        ("movement horizontal is about axis 1, elevation", "axis 2 of robot"),
    ),
    "late": (lambda r: table_with(r, onset_s=9.0, end_s=10.0), ("trials.csv, row 2", "onset_s")),
}


def cases(table):
    return pytest.mark.parametrize("case", table.values(), ids=list(table))


def of_each(commands, table):
    """Every case with another command first, then with the other commands."""
    pairs = [
        pytest.param(commands[(i + turn) % len(commands)], case, id=f"{name}-{turn}")
        for turn in range(len(commands))
        for i, (name, case) in enumerate(table.items())
    ]
    every = pytest.mark.parametrize(("command", "case"), pairs)
    return lambda test: pytest.mark.first_cases(len(table))(every(test))


def refused(refusal, bench, command, case, folder):
    """The line about a recording that was damaged, which must name it."""
    damage, words = case
    whole = bench.calibration if command == "robot" else bench.session
    write_folder(damage(whole), folder)
    said = refusal(*bench.call(command, recording=folder))
    for word in (str(folder), *words):
        assert word in said, said


@of_each(("robot", "arm", "contribution"), OF_ANY)
def test_a_recording_that_this_robot_cannot_have_made(refusal, bench, command, case, tmp_path):
    refused(refusal, bench, command, case, tmp_path / "damaged")


@cases(OF_CALIBRATION)
def test_a_calibration_that_lacks_something(refusal, bench, case, tmp_path):
    refused(refusal, bench, "robot", case, tmp_path / "damaged")


@cases(OF_SESSION)
def test_passive_repetitions_that_make_no_arm(refusal, bench, case, tmp_path):
    refused(refusal, bench, "arm", case, tmp_path / "damaged")


def cell(lines, row, column, word):
    """The lines of a CSV with one cell changed."""
    place, cells = lines[0].split(",").index(column), lines[row - 1].split(",")
    cells[place] = word
    return [*lines[: row - 1], ",".join(cells), *lines[row:]]


@pytest.mark.parametrize("word", ["nan", "", "x", "inf"])
@pytest.mark.parametrize("column", ["q4_rad", "tau2_Nm"])
def test_a_cell_that_is_no_number_names_its_row(refusal, bench, word, column, tmp_path):
    write_folder(bench.session, tmp_path / "damaged", table="csv")
    samples = tmp_path / "damaged" / "samples.csv"
    samples.write_text("\n".join(cell(samples.read_text().splitlines(), 51, column, word)) + "\n")
    said = refusal(*bench.call("contribution", recording=tmp_path / "damaged"))
    assert f"samples.csv, row 51, column {column}" in said
    assert "expected a finite number" in said


def edited(bench, tmp_path, name, change):
    """A copy of ROBOT.json or ARM.json whose record was changed."""
    content = json.loads((bench.folder / f"{name}.json").read_text())
    change(content[name])
    path = tmp_path / f"another_{name}.json"
    path.write_text(json.dumps(content))
    return path


def other_axes(robot):
    robot["axes"][4] = "grip"


def three_of_five(robot):
    for field in ("axes", "limits_rad", "torque_limit_Nm", "motor_inertia_kgm2"):
        robot[field] = robot[field][:3]


def no_limits(robot):
    del robot["limits_rad"]


def no_number(robot):
    robot["loads"]["theta"][0] = "nan"


#: What happens to ROBOT.json; which file the line names; words that it must hold.
ROBOTS = {
    "axes": (other_axes, "robot", ("grip", "pronation")),
    "three axes": (three_of_five, "robot", ("pronation", "elevation, horizontal, rotation")),
    "limits": (
        lambda r: r.update(limits_rad=[[0.0, 0.5]] * 5),
        "recording",
        ("q1_rad", "another robot", "0 to 0.5 rad"),
    ),
    "motors": (lambda r: r.update(torque_limit_Nm=[5.0] * 5), "recording", ("at most", "5 N m")),
    "no limits": (no_limits, "robot", ("no limits_rad", "`armimpedance therapy robot`")),
    "no number": (no_number, "robot", ("theta", "finite")),
    "drawings": (
        lambda r: r.update(loads=None),
        "robot",
        ("not known", "`armimpedance therapy robot`"),
    ),
}


@of_each(("contribution", "arm"), ROBOTS)
def test_another_robots_file(refusal, bench, command, case, tmp_path):
    change, at_fault, words = case
    path = edited(bench, tmp_path, "robot", change)
    said = refusal(*bench.call(command, robot=path))
    for word in (str({"robot": path, "recording": bench.folder / "session"}[at_fault]), *words):
        assert word in said, said


def massless(arm):
    for segment in arm["segments"]:
        segment.update(mass_kg=0.0, inertia_kgm2=0.0, inertia_long_kgm2=0.0)
    for elastic in arm["elastic"]:
        elastic.update(stiffness=0.0, offset=0.0)


def not_repeated(arm):
    arm["elastic"][0].update(repeatable=False, verdict="refused: they are too different")


def of_two_parameters(arm):
    arm["elastic"][0].update(robot_gradient=[[0.0, 0.0], [0.0, 0.0]])


#: What happens to ARM.json; which file the line names; words that it must hold.
ARMS = {
    "another robot's": (
        lambda a: a.update(robot="ARMin IV"),
        "arm",
        ("'ARMin IV'", "'ARMin III (simulated)'", "robot.json"),
    ),
    "another person's": (
        lambda a: a.update(subject="Q9"),
        "arm",
        ("arm of subject Q9", "whose recording this is"),
    ),
    "no stiffness": (
        lambda a: a.update(elastic=[]),
        "arm",
        ("no passive calibration of axis elevation", "`armimpedance therapy arm`"),
    ),
    "not repeated": (not_repeated, "arm", ("axis elevation", "--unrepeatable")),
    "too long": (lambda a: a.update(upper_arm_m=3.0), "arm", ("3.0 m", "0.15 to 0.5 m")),
    "massless": (massless, "recording", ("trial 1", "tau_h is zero", "mass or stiffness")),
    "other parameters": (of_two_parameters, "recording", ("2 parameters", "has 23")),
}


@cases(ARMS)
def test_an_arm_that_the_recording_cannot_be_held_against(refusal, bench, case, tmp_path):
    change, at_fault, words = case
    path = edited(bench, tmp_path, "arm", change)
    said = refusal(*bench.call("contribution", arm=path))
    for word in (str({"arm": path, "recording": bench.folder / "session"}[at_fault]), *words):
        assert word in said, said


def test_files_that_hold_something_else_are_named(refusal, bench, tmp_path):
    robot, arm = bench.folder / "robot.json", bench.folder / "arm.json"
    for command in ("arm", "contribution"):
        said = refusal(*bench.call(command, robot=arm))
        assert str(arm) in said
        assert "`armimpedance therapy robot`" in said
    said = refusal(*bench.call("contribution", arm=robot))
    assert str(robot) in said
    assert "`armimpedance therapy arm`" in said
    broken = tmp_path / "broken.json"
    for text, words in (('{"format": "armimp', "broken JSON"), ("", "empty"), ("[]", "object")):
        broken.write_text(text)
        for call in (("robot", "drawings"), ("arm", "robot"), ("contribution", "arm")):
            said = refusal(*bench.call(call[0], **{call[1]: broken}))
            assert str(broken) in said
            assert words in said
    for call in (("robot", "drawings"), ("arm", "robot"), ("contribution", "recording")):
        assert "not_there" in refusal(*bench.call(call[0], **{call[1]: tmp_path / "not_there"}))


@pytest.mark.parametrize(
    ("command", "options", "words"),
    [
        *((c, ("--figure", "x.gif"), ("x.gif", ".png")) for c in ("robot", "arm", "contribution")),
        ("contribution", ("--samples", "no/such.csv"), ("no: no such folder",)),
        ("contribution", ("--samples", "out.csv"), ("--out and to --samples", "two files")),
        ("contribution", ("--condition", "activ"), ("'activ'", "one of passive, half_active")),
        ("arm", ("--mass-kg", "0"), ("body mass", "more than 0")),
        ("arm", ("--mass-kg", "nan"), ("body mass", "more than 0")),
        ("arm", ("--mass-kg", "heavy"), ("--mass-kg", "heavy")),
        ("arm", ("--upper-arm-m", "30"), ("upper_arm_m", "at most 0.5")),
        ("arm", ("--upper-arm-m", "0.1"), ("0.1 m", "0.15 to 0.5 m")),
        ("arm", ("--forearm-m", "-1"), ("forearm_m", "more than 0")),
        ("arm", ("--hand-m", "inf"), ("hand_m", "at most 0.3")),
        ("arm", ("--mass-sd-percent", "-3"), ("--mass-sd-percent -3", "less than 50")),
        ("arm", ("--mass-sd-percent", "300"), ("--mass-sd-percent 300", "less than 50")),
        ("arm", ("--mass-sd-percent", "nan"), ("--mass-sd-percent nan", "less than 50")),
    ],
    ids=lambda v: " ".join(v) if isinstance(v, tuple) else v,
)
def test_options_that_cannot_be(refusal, bench, command, options, words):
    said = refusal(*bench.call(command, *options))
    for word in words:
        assert word in said, said


#: What each command writes.
OUTPUTS = (("robot", "out.json"), ("arm", "out.json"), ("contribution", "out.csv"))


@pytest.mark.parametrize(("command", "out"), OUTPUTS)
def test_an_output_has_a_folder(refusal, bench, command, out):
    assert "existing folder" in refusal(*bench.call(command, out=f"no/such/{out}"))


@pytest.mark.parametrize(("command", "out"), OUTPUTS)
def test_an_output_is_no_folder(refusal, bench, command, out, tmp_path):
    (tmp_path / out).mkdir()
    said = refusal(*bench.call(command, out=tmp_path / out))
    assert "is a folder (expected the name of a file)" in said


@pytest.mark.parametrize(
    ("command", "out"), [("robot", "x.csv"), ("arm", "x"), ("contribution", "x.txt")]
)
def test_an_output_has_an_ending_that_can_be_written(refusal, bench, command, out):
    assert "one that ends in" in refusal(*bench.call(command, out=out))


def test_what_is_read_is_not_written_over(refusal, bench):
    robot, inside = bench.folder / "robot.json", bench.folder / "session" / "result.csv"
    for call, path in (
        (bench.call("arm", out=robot), robot),
        (bench.call("contribution", "--samples", inside), inside),
    ):
        before = path.read_bytes() if path.exists() else None
        said = refusal(*call)
        assert str(path) in said
        assert (path.read_bytes() if path.exists() else None) == before
    assert "would replace what is read" in refusal(*bench.call("arm", out=robot))


def test_a_person_is_not_taken_for_the_empty_robot(refusal, bench):
    for call in (
        bench.call("robot", recording=bench.folder / "session"),
        bench.call("robot", "--validate", bench.folder / "session"),
    ):
        said = refusal(*call)
        assert str(bench.folder / "session") in said
        assert "is in the robot" in said
        assert "the empty robot" in said


def test_what_was_fitted_does_not_validate_a_robot(refusal, bench):
    said = refusal(*bench.call("robot", "--validate", bench.folder / "calibration"))
    assert str(bench.folder / "calibration") in said
    assert "sweeps and holds only" in said


@pytest.mark.parametrize(
    "given",
    [
        PIPE,
        3 * PIPE,
        (*PIPE, "--pipe", "1.7,0.30"),
        (*PIPE, "--pipe", "heavy,0.3,0.1"),
        (*PIPE, "--pipe=-1.7,0.3,0.1"),
        (*PIPE, "--pipe", "nan,0.3,0.1"),
        (*PIPE, "--pipe", "inf,0.3,0.1"),
        (*PIPE, "--pipe", "1.7,0,0.1"),
    ],
    ids=" ".join,
)
def test_a_pipe_that_is_no_pipe(refusal, bench, given):
    call = bench.call("arm")[:-2]
    said = refusal(*call, *given)
    assert "--pipe twice" in said
    assert "such as 1.8,0.32,0.10" in said


@pytest.mark.parametrize(
    "option",
    [
        ("--out", "arm.json"),
        ("--figure", "pipes.png"),
        ("--mass-kg", "70"),
        ("--hand-m", "0.2"),
        ("--mass-sd-percent", "3"),
        ("--point-masses",),
    ],
    ids=" ".join,
)
def test_a_mock_up_takes_no_options_of_a_person(refusal, bench, option):
    said = refusal(*bench.call("arm")[:-2], *2 * PIPE, *option)
    assert f"{option[0]} with --pipe" in said


def test_a_mock_up_is_moved_up_and_down(refusal, bench):
    said = refusal(*bench.call("arm")[:-2], *2 * PIPE)
    assert str(bench.folder / "session") in said
    assert "up and down" in said


@pytest.mark.parametrize("command", ["robot", "arm", "contribution"])
def test_an_output_that_was_there_is_kept(refusal, bench, command, tmp_path):
    recording = bench.calibration if command == "robot" else bench.session
    write_folder(replace(recording, force=-recording.force), tmp_path / "turned")
    kept = tmp_path / "kept"
    kept.mkdir()
    out = kept / dict(OUTPUTS)[command]
    out.write_text("somebody's only copy")
    refusal(*bench.call(command, recording=tmp_path / "turned", out=out))
    assert [path.name for path in kept.iterdir()] == [out.name]
    assert out.read_text() == "somebody's only copy"
