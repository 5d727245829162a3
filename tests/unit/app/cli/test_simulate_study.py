"""A simulated study: the same bits however it is worked on, nothing done twice, truth recovered."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from armimpedance.app.study import Dask, Processes
from armimpedance.core.errors import InputError
from armimpedance.hand.comparison import changes as compared
from armimpedance.hand.still import Group, Options, estimate_window
from armimpedance.lab.simulate_study import carry_out
from armimpedance.lab.simulate_study.blocks import STORE, Blocks
from armimpedance.lab.simulate_study.config import read_config
from armimpedance.lab.simulate_study.hand_numbers import QUANTITIES, numbers_of, values_of
from armimpedance.lab.simulate_study.rig import RIGS
from armimpedance.lab.simulate_study.rigs.linear import LIMB, linear_window
from armimpedance.lab.simulate_study.summary import changes, wilson

pytestmark = pytest.mark.study

TINY = """
sessions = 30
seed = 5
power = [["nominal", "stiffer"]]
[grid]
rig = "linear"
conditions = [["nominal", "stiffer"]]
sets = 1
noise = "sensor"
method = ["exact", "weak_form"]
"""


class Here:
    """An engine that works in this process, and may be made to stop."""

    def __init__(self, stop_after: int | None = None) -> None:
        self.stop_after, self.done = stop_after, []

    def __call__(self, work, tasks):
        for task in tasks:
            if len(self.done) == self.stop_after:
                raise KeyboardInterrupt
            self.done.append(task)
            yield work(task)


class Broken(Here):
    """An engine whose process is killed by every block but the first."""

    def __call__(self, work, tasks):
        for task in tasks:
            yield work.failed(task, "killed") if task.block else work(task)


def study(folder: Path, text: str, engine=None, name: str = "out") -> Path:
    """Carry out a study; its folder."""
    file = folder / "study.toml"
    file.write_text(text)
    config = read_config(file)
    out = folder / name
    assert carry_out(config, Blocks(out, config.seed), engine or Here()) == 0
    return out


def written(out: Path) -> dict[str, bytes]:
    return {p.relative_to(out).as_posix(): p.read_bytes() for p in out.rglob("*") if p.is_file()}


def rows(out: Path, table: str = "cells.csv") -> list[dict[str, str]]:
    with open(out / table, encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def tiny(tmp_path_factory) -> Path:
    return study(tmp_path_factory.mktemp("tiny"), TINY)


def test_the_truth_lies_in_the_intervals_and_where_it_should(tiny):
    found = rows(tiny)
    assert len(found) == 2 * 2 * len(QUANTITIES)
    elements = [row for row in found if row["quantity"].startswith("K_")]
    for row in elements:
        limb = LIMB * (1.3**0.5 if row["condition"] == "stiffer" else 1)
        i, j = int(row["quantity"][2]) - 1, int(row["quantity"][3]) - 1
        assert float(row["truth"]) == pytest.approx(limb[2, i, j], rel=1e-12)
        assert abs(float(row["bias"])) < 5 * float(row["bias_se"])
        assert float(row["coverage_low"]) <= float(row["coverage"]) <= float(row["coverage_high"])
    # 30 sessions of 8 elements of two methods; 95 % of them, give or take four standard errors
    held = np.mean([float(row["coverage"]) for row in elements])
    assert 0.88 < held < 0.99


def test_power_is_that_of_the_intervals_of_compare(tiny):
    found = {r["quantity"]: r for r in rows(tiny, "changes.csv") if r["method"] == "exact"}
    assert float(found["size_K"]["true_change"]) == pytest.approx(np.log(1.3))
    assert float(found["size_K"]["power"]) > 0.9
    assert float(found["M_11"]["power"]) < 0.3


def test_two_processes_give_the_bits_of_one(tiny, tmp_path):
    for workers in (1, 2):
        out = study(tmp_path, TINY, Processes(workers), f"out{workers}")
        assert written(out) == written(tiny)


def test_dask_gives_the_bits_of_one_process(tiny, tmp_path, monkeypatch):
    from distributed import LocalCluster

    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": ":0"}
    with LocalCluster(**options) as local:
        out = study(tmp_path, TINY, Dask(local.scheduler_address, patience_s=60))
    assert written(out) == written(tiny)


def test_a_study_that_was_stopped_goes_on(tiny, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        study(tmp_path, TINY, Here(stop_after=1))
    kept = written(tmp_path / "out")
    assert kept
    assert all(name.startswith(STORE) for name in kept)
    rest = Here()
    out = study(tmp_path, TINY, rest)
    assert [task.block for task in rest.done] == [1]
    assert written(out) == written(tiny)
    again = Here()
    study(tmp_path, TINY, again)
    assert again.done == []


def test_a_damaged_block_is_made_again(tiny, tmp_path):
    out = study(tmp_path, TINY)
    for number, block in enumerate(sorted((out / STORE).rglob("*.block"))):
        content = bytearray(block.read_bytes())
        content[40 + 97 * number] ^= 1
        block.write_bytes(bytes(content) if number % 2 else bytes(content[: 10 * number]))
    assert written(study(tmp_path, TINY)) == written(tiny)


def test_a_study_that_was_killed_goes_on(tmp_path, tiny):
    (tmp_path / "study.toml").write_text(TINY)
    words = ["simulate-study", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]
    call = [sys.executable, "-m", "armimpedance", *words, "--workers", "1"]
    one = subprocess.Popen(call, stdout=subprocess.DEVNULL, start_new_session=True)
    until = time.monotonic() + 60
    while one.poll() is None and time.monotonic() < until:
        if list((tmp_path / "out").rglob("*.block")):
            os.killpg(one.pid, signal.SIGKILL)
            break
        time.sleep(0.01)
    assert one.wait() == -signal.SIGKILL
    assert written(study(tmp_path, TINY)) == written(tiny)


def test_more_sessions_leave_the_first_as_they_are(tiny, tmp_path):
    import pandas as pd

    out = study(tmp_path, TINY.replace("30", "60"))
    more, before = (pd.read_parquet(folder / "sessions.parquet") for folder in (out, tiny))
    assert len(more) == 2 * len(before)
    first = more[more.session < 30].reset_index(drop=True)
    pd.testing.assert_frame_equal(first, before, check_exact=True)
    # fewer than were done: nothing to do
    engine = Here()
    assert rows(study(tmp_path, TINY, engine)) == rows(tiny)
    assert engine.done == []


def test_methods_meet_the_same_sessions_and_conditions_do_not(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(TINY)
    one, other = read_config(file).cells
    assert one.seeds(5) == other.seeds(5)
    file.write_text(TINY.replace('"sensor"', '"nominal"'))
    assert read_config(file).cells[0].seeds(5) != one.seeds(5)
    file.write_text(
        TINY.replace('[["nominal", "stiffer"]]', '["stiffer"]', 2).replace("power", "#")
    )
    assert read_config(file).cells[0].seeds(5) == one.seeds(5)


def test_a_session_of_the_simulated_arm_hangs_on_nothing_beside_it(tmp_path):
    """Three sessions side by side are the first three of five, and hold the truth."""
    settings = {field.name: field.default for field in RIGS["hand"].fields}
    settings |= {"sets": 1, "noise": "sensor", "method": "exact"}
    rig = RIGS["hand"]
    file = tmp_path / "study.toml"
    file.write_text('sessions = 5\n[grid]\nsets = 1\nnoise = "sensor"\nmethod = "exact"')
    (cell,) = read_config(file).cells
    few, more = (
        rig.estimate(settings, rig.simulate(settings, cell.seeds(0), range(n))) for n in (3, 5)
    )
    assert np.array_equal(few.values, more.values[:, :3], equal_nan=True)
    wrong = few.values[0, :, 8:12, 0] / few.values[0, :, 8:12, 5] - 1
    assert np.abs(wrong).max() < 0.05


HOSTILE = {
    "sessions = 0": "sessions",
    "sessions = true": "sessions",
    "sessions = 1e3": "sessions",
    "sessions = 99999999999999999999": "sessions",
    "": "sessions",
    "sessions = 1\n[fixed]\nfull = 400\ndrawn = 10": "fixed",
    "[fixed]\nfull = 10\ndrawn = 10": "fixed.full",
    "[fixed]\nfull = 400": "fixed.drawn",
    "fixed = 3": "fixed",
    "sessions = 1\nseed = -1": "seed",
    "sessions = 1\nseeds = 1": "seeds",
    "sessions = 1\ngrid = 3": "grid",
    "sessions = 1\n[grid]\nrig = 'foot'": "hand, ",
    "sessions = 1\n[grid]\nrig = [[['hand']]]": "rig",
    "sessions = 1\n[grid]\nnoise = []": "grid.noise",
    "sessions = 1\n[grid]\nnoise = 'loud'": "nominal, sensor, none",
    "sessions = 1\n[grid]\nloudness = 1": "grid.loudness",
    "sessions = 1\n[grid]\nmethod = ['exact', 'guess']": "weak_form",
    "sessions = 1\n[grid]\nsets = [0]": "grid.sets",
    "sessions = 1\n[grid]\namplitude_m = nan": "grid.amplitude_m",
    "sessions = 1\n[grid]\nservo = inf": "grid.servo",
    "sessions = 1\n[grid]\nduration_s = 0.30005": "milliseconds",
    "sessions = 1\n[grid]\nservo = 'ideal'\ndisturbance = 'half_sine'": "half_sine",
    "sessions = 1\n[grid]\nconditions = 'tense'": "conditions",
    "sessions = 1\n[grid]\nconditions = [['nominal', 'nominal']]": "conditions",
    "sessions = 1\n[grid]\nconditions = [3]": "conditions",
    "sessions = 1\npower = 'nominal'": "power",
    "sessions = 1\npower = [['nominal', 'tense']]": "power",
    "sessions = 1\npower = [['nominal']]": "power",
    f"sessions = 1\n[grid]\nsets = {list(range(1, 1000))}\namplitude_m = {[0.001] * 99}": "cells",
    "sessions = ": "TOML",
    "a = " + "[" * 5000: "TOML",
    "sessions = 1\n\u202e\x00": "TOML",
}


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_what_is_wrong_is_told_in_one_line_before_any_work(text, tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(text)
    with pytest.raises(InputError) as told:
        read_config(file)
    line = str(told.value)
    assert str(file)[-20:] in line
    assert HOSTILE[text] in line
    assert line.isprintable()
    assert len(line) <= 400


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"#" * 1_000_001, None])
def test_what_is_no_text_is_refused(content, tmp_path):
    file = tmp_path / "study.toml"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(InputError):
        read_config(file)


def test_a_folder_of_something_else_is_left_alone(tmp_path, capsys):
    from armimpedance.app.cli.main import run

    (tmp_path / "mine.txt").write_text("x")
    (tmp_path / "study.toml").write_text(TINY)
    words = ["simulate-study", str(tmp_path / "study.toml"), "--out"]
    assert run([*words, str(tmp_path)]) == 2
    assert "mine.txt" in capsys.readouterr().err
    assert run([*words, str(tmp_path / "new"), "--dry-run"]) == 0
    assert "30 to be simulated" in capsys.readouterr().out
    assert not (tmp_path / "new").exists()


def test_a_rig_that_cannot_go_on_is_a_reason_and_the_others_are_unharmed(tmp_path, capsys):
    """A process that is killed with its block: exit status 3, the rest in the tables."""

    (tmp_path / "study.toml").write_text(TINY)
    config = read_config(tmp_path / "study.toml")
    assert carry_out(config, Blocks(tmp_path / "out", 5), Broken()) == 3
    assert "killed" in capsys.readouterr().out
    assert {row["n"] for row in rows(tmp_path / "out")} == {"25"}
    assert written(study(tmp_path, TINY)).keys() >= {"cells.csv", "changes.csv"}


def estimates(count: int, noise: str = "nominal", sets: int = 1):
    rng = np.random.default_rng(3)
    group, options = Group("hand", {}), Options("exact", bound=False)
    for factor in np.linspace(1, 1.4, count):
        limb = LIMB * np.array([1, factor, factor])[:, None, None]
        yield estimate_window(linear_window(noise, rng, limb=limb, trials=8 * sets), group, options)


def test_limits_of_drawn_sessions_are_those_of_their_estimates():
    """Also of matrices that may be circles, and of those without an ellipse."""
    both = [numbers_of(one, LIMB) for one in estimates(40)]
    values, extras = (np.array(part) for part in zip(*both, strict=True))
    circular = values[..., 2] - values[..., 1] == np.pi
    assert circular.any()
    assert not circular[:, 19].all()
    again = values_of(extras, values[0, :, 5], values[0, :, 6])
    assert np.allclose(again[..., :5], values[..., :5], rtol=1e-9, equal_nan=True)


def test_changes_are_those_of_compare():
    first, second = list(estimates(2, sets=3))
    values = np.array([[numbers_of(one, LIMB)[0]] for one in (first, second)])
    change, low, high, _ = (part[0] for part in changes(values[0], values[1], QUANTITIES))
    of = {q.name: n for n, q in enumerate(QUANTITIES)}
    for one in compared(first, second):
        if one.quantity.endswith("_12"):
            continue  # of the symmetric part there, each element here
        symbol = {"inertia": "M", "viscosity": "B", "stiffness": "K"}[one.matrix]
        at = of.get(one.quantity, of.get(f"{one.quantity}_{symbol}"))
        mine = np.array([change[at], low[at], high[at]])
        mine = np.exp(mine) if one.kind == "ratio" else mine
        assert np.allclose(mine, [one.value, one.low, one.high], rtol=1e-9)


def test_wilson_against_statsmodels():
    from statsmodels.stats.proportion import proportion_confint

    held, n = np.array([0.0, 3, 17, 285, 300]), np.array([10.0, 10, 20, 300, 300])
    theirs = proportion_confint(held, n, method="wilson")
    assert np.allclose(wilson(held, n), theirs, atol=1e-12)


FIXED = """
seed = 1
power = [["nominal", "stiffer"]]
fixed = {full = 150, drawn = 4000}
[grid]
rig = "linear"
conditions = [["nominal", "stiffer"]]
method = "exact"
sets = 1
"""
#: Standard errors by which a drawn number may lie off another study's: 21 quantities of two
#: conditions in four columns, of which chance takes none beyond this once in a thousand studies.
TOLERANCE = 5.0


@pytest.fixture(scope="module")
def drawn(tmp_path_factory) -> Path:
    return study(tmp_path_factory.mktemp("fixed"), FIXED, name="drawn")


def test_drawn_sessions_agree_with_those_of_another_study(drawn, tmp_path):
    """Bias, error, coverage and power, within the errors that the tables give them."""
    full = FIXED.replace("fixed = {full = 150, drawn = 4000}", "sessions = 200")
    other = study(tmp_path, full.replace("seed = 1", "seed = 2"), name="other")
    asked = ((drawn, "drawn"), (other, "simulated"))
    pairs = list(zip(*(by_source(*one) for one in asked), strict=True))
    assert len(pairs) == 2 * len(QUANTITIES)
    for one, two in pairs:
        for name in ("bias", "rmse"):
            apart(one, two, name, float(one[f"{name}_se"]), float(two[f"{name}_se"]))
        apart(one, two, "coverage", half(one, "coverage"), half(two, "coverage"))
        assert int(one["n"]) > 3900
    pairs = list(zip(*(by_source(*one, "changes.csv") for one in asked), strict=True))
    for one, two in pairs:
        apart(one, two, "power", half(one, "power"), half(two, "power"))


def by_source(out: Path, source: str, table: str = "cells.csv") -> list[dict[str, str]]:
    return [row for row in rows(out, table) if row["source"] == source]


def half(row: dict[str, str], name: str) -> float:
    """Standard error of a share, from its interval."""
    return (float(row[f"{name}_high"]) - float(row[f"{name}_low"])) / 3.92


def apart(one, two, name: str, first: float, second: float) -> None:
    gap = abs(float(one[name]) - float(two[name]))
    where = (name, one["quantity"], one[name], two[name])
    assert gap <= TOLERANCE * np.hypot(first, second), where


def test_drawn_sessions_are_the_same_again(drawn):
    before = written(drawn)
    study(drawn.parent, FIXED, name="drawn")
    assert written(drawn) == before


def test_where_nothing_can_be_drawn_it_is_said(drawn, capsys):
    """Too many sessions without an estimate: the others do not stand for all."""
    file = drawn.parent / "study.toml"
    file.write_text(FIXED)
    config = read_config(file)
    out = Blocks(drawn.parent / "cut", 1)
    assert carry_out(config, out, Broken()) == 3
    assert "nothing drawn: 125 of 150" in capsys.readouterr().out
    assert by_source(out.out, "drawn") == []


@pytest.mark.parametrize("name", RIGS.names)
def test_every_rig_has_what_a_study_needs(name):
    """Its defaults pass its own checks, and what it draws has the shape of what it estimates."""
    rig = RIGS[name]
    settings = {field.name: field.default for field in rig.fields}
    for field in rig.fields:
        if field.default is not None:
            assert field.check(field.default) == field.default
    assert rig.conditions(settings)
    assert rig.shortcut is not None
    n = len(rig.quantities)
    extras = np.random.default_rng(0).normal(size=(7, rig.extras))
    assert rig.shortcut().values(extras, np.zeros(n), np.zeros(n)).shape == (7, n, 7)


def test_an_elbow_holds_its_truth(tmp_path):
    text = 'sessions = 1\n[grid]\nrig = "elbow"\nsets = 2\nduration_s = 4\nnoise = "sensor"'
    found = {row["quantity"]: row for row in rows(study(tmp_path, text))}
    for name in ("I", "B"):
        assert abs(float(found[name]["bias"])) < 0.05 * float(found[name]["truth"])


def test_plain_numbers_are_drawn_as_they_are():
    from armimpedance.lab.simulate_study.rig import SHORTCUT, FittedNumbers, numbers_of

    rng = np.random.default_rng(1)
    truth = np.array([1.0, 2.0])
    fits = [FittedNumbers(truth + 0.1 * rng.normal(size=2), rng.uniform(0.05, 0.2, 2), 9.0, truth)]
    fits += [FittedNumbers(truth, np.array([0.1, 0.3]), 9.0 + n, truth) for n in range(5)]
    found = numbers_of([lambda one=one: one for one in fits], len(fits), 2)
    again = SHORTCUT.values(found.extras[0], truth, np.full(2, np.nan))
    assert np.allclose(again, found.values[0], equal_nan=True)
