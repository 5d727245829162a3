"""`armimpedance plan`: trials, profile, figure; what cannot be met is refused in one line."""

import re

import numpy as np
import pytest
from sessions import pushes

from armimpedance.app.cli.main import run as main
from armimpedance.hand.show.results_csv import write_results
from armimpedance.hand.still.estimation import estimate
from armimpedance.recordings.tables.folder import write_folder


def profile_of(file):
    """The samples of a profile: time, displacement, velocity, acceleration."""
    return np.loadtxt(file, delimiter=",", skiprows=3)


@pytest.fixture(scope="module")
def pilot(tmp_path_factory):
    """A recording of two sets, and its estimate."""
    folder = tmp_path_factory.mktemp("pilot")
    recording = pushes(2, ("cocontraction_10",))
    write_folder(recording, folder / "session")
    write_results(estimate(recording), folder / "hand.csv")
    return folder


def refused(capsys, *arguments):
    try:
        code = main(["plan", *map(str, arguments)])
    except SystemExit as end:
        code = end.code
    captured = capsys.readouterr()
    assert code == 2, captured.err
    lines = captured.err.strip().splitlines()
    assert len(lines) == 1, captured.err
    return lines[0]


def row(text, name):
    """Cells of the first table's row of a shape."""
    line = next(line for line in text.splitlines() if line.startswith(name))
    return line.removeprefix(name).split()


def test_table_profile_and_figure(tmp_path, capsys):
    profile, figure = tmp_path / "p.csv", tmp_path / "plan.png"
    outputs = ["--out-profile", str(profile), "--figure", str(figure)]
    assert main(["plan", "--k-percent", "5", "--duration-s", "0.3", *outputs]) == 0
    text = capsys.readouterr().out
    trials = {n: int(row(text, n)[-1]) for n in ("minimum_jerk", "designed", "reflex_separating")}
    assert trials["designed"] < 0.2 * trials["minimum_jerk"]
    assert f"Fewest trials: {min(trials.values())}" in text
    assert re.search(r"^minimum_jerk +0\.3 +\+1\d to \+2\d", text, re.MULTILINE)
    lines = [line for line in text.splitlines() if "written to" not in line]
    assert max(map(len, lines)) <= 100
    assert np.abs(profile_of(profile)[:, 1]).max() == pytest.approx(0.005, rel=1e-5)
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_pilot_brings_arm_noise_and_its_own_disturbance(pilot, capsys):
    call = ["plan", "--pilot", str(pilot / "session"), "--duration-s", "0.3", "--trials", "24"]
    assert main([*call, "--max-trials", "100000"]) == 0
    text = capsys.readouterr().out
    own, planned = row(text, "pilot's own"), row(text, "minimum_jerk")
    # the pilot was a bump of 5 mm in .3 s: planned on its noise, within 25 % of itself
    assert float(own[0]) == 0.3
    assert float(own[1]) == pytest.approx(5.0, abs=0.3)
    for measured, expected in zip(own[3:6], planned[3:6], strict=True):
        assert float(measured) == pytest.approx(float(expected), rel=0.25)


def test_results_bring_the_arm(pilot, capsys):
    call = ["plan", "--results", str(pilot / "hand.csv"), "--shape", "designed"]
    assert main([*call, "--noise", "sensor"]) == 0
    assert "cocontraction_10" in capsys.readouterr().out


def test_design_for_the_users_limits(tmp_path, capsys):
    out = tmp_path / "p.csv"
    call = ["plan", "--design", "--shape", "biphasic", "--duration-s", "0.25"]
    limits = ["--max-acceleration", "4", "--amplitude-mm", "4", "--servo", "20000"]
    assert main([*call, *limits, "--out-profile", str(out)]) == 0
    assert "new design written" in capsys.readouterr().out
    values = profile_of(out)
    assert len(values) == 251
    assert np.abs(values[:, 1]).max() <= 0.004 * (1 + 1e-6)
    assert np.abs(values[:, 3]).max() <= 4 * (1 + 1e-6)


def test_too_fast_is_refused_with_what_would_do(capsys):
    line = refused(capsys, "--design", "--duration-s", "0.05")
    assert "5 mm in 0.05 s" in line
    assert "0.123 s" in line
    call = ["--shape", "minimum_jerk", "--amplitude-mm", "5", "--duration-s", "0.1"]
    line = refused(capsys, *call)
    assert "reaches 12 m/s^2" in line
    assert "2.21 mm" in line


@pytest.mark.study
def test_a_wish_too_far_names_the_binding_limit(capsys):
    line = refused(capsys, "--k-percent", "0.5", "--shape", "minimum_jerk", "--duration-s", "0.3")
    assert re.search(r"needs \d+,\d{3} trials, more than 1,000; what binds most: 7.5 mm", line)


def test_a_raised_cosine_alone_is_not_recommended(capsys):
    line = refused(capsys, "--shape", "raised_cosine")
    assert "proportional up to an offset" in line


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--shape", "square"], "--shape square"),
        (["--noise", "loud"], "--noise"),
        (["--servo", "soft"], "--servo soft"),
        (["--servo", "5000", "--bandwidth-hz", "10"], "one of them"),
        (["--robot-kg", "-1"], "-1 kg"),
        (["--k-percent", "5", "--duration-s", "0.05"], "no course of 5 mm in 0.05 s"),
        (["--k-percent", "-3"], "--k-percent -3"),
        (["--trials", "1"], "--trials 1"),
        (["--reflex-delay-ms", "0"], "--reflex-delay-ms 0"),
        (["--duration-s", "nan"], "--duration-s nan"),
        (["--amplitude-mm", "0"], "--amplitude-mm 0"),
        (["--max-acceleration", "0"], "--max-acceleration 0"),
        (["--figure", "plan.gif", "--duration-s", "0.3"], ".png, .svg or .pdf"),
        (["--pilot", "nowhere"], "nowhere"),
    ],
)
def test_bad_calls_are_one_line(arguments, says, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert says in refused(capsys, *arguments)
    assert not list(tmp_path.iterdir())


def test_an_unknown_condition_is_refused(pilot, capsys):
    assert "cocontraction_10" in refused(capsys, "--pilot", pilot / "session", "--condition", "x")
    assert "cocontraction_10" in refused(
        capsys, "--results", pilot / "hand.csv", "--condition", "x"
    )
