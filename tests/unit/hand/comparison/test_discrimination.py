"""Two groups told apart by one number: independent formulas, limits, coverage."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from scipy.stats import norm, ttest_ind

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.app.study import discriminate
from armimpedance.core.errors import InputError
from armimpedance.hand.comparison.discrimination import (
    PeopleGroup,
    discriminate_groups,
    hedges_g,
    leave_one_out,
    newcombe_auc,
    wilson,
)
from armimpedance.hand.comparison.show.plot import plot_discrimination
from armimpedance.numerics.regression import NamedParameter


def group(name, values, sd=None):
    return PeopleGroup(
        name, tuple(f"{name}{i}" for i in range(len(values))), np.asarray(values), sd
    )


def test_the_area_is_the_share_of_pairs_and_the_difference_welch_s():
    rng = np.random.default_rng(1)
    x, y = rng.normal(0, 1, 9), rng.normal(1.2, 2, 13)
    result = discriminate_groups(group("a", x), group("b", y))
    pairs = np.mean([(b > a) + 0.5 * (b == a) for a in x for b in y])
    assert result.auc == pytest.approx(pairs, abs=1e-12)
    scipy_s = ttest_ind(y, x, equal_var=False).confidence_interval(0.95)
    assert result.difference_ci95 == pytest.approx((scipy_s.low, scipy_s.high), rel=1e-9)


def test_turning_the_groups_round_turns_every_sign():
    rng = np.random.default_rng(2)
    a, b = group("a", rng.normal(size=7)), group("b", rng.normal(1, 1, 10))
    there, back = discriminate_groups(a, b), discriminate_groups(b, a)
    assert back.difference == pytest.approx(-there.difference)
    assert back.effect_ci95 == pytest.approx([-v for v in there.effect_ci95[::-1]], rel=1e-6)
    assert back.auc_ci95 == pytest.approx([1 - v for v in there.auc_ci95[::-1]], abs=1e-6)
    assert (back.p, back.correct) == (pytest.approx(there.p), there.correct)


def test_leave_one_out_is_its_slow_obvious_version():
    rng = np.random.default_rng(3)
    x, y = rng.normal(size=8), rng.normal(1, 1, 6)
    right = 0
    for own, other in ((x, y), (y, x)):
        for i in range(len(own)):
            rest = np.delete(own, i)
            side = abs(own[i] - rest.mean()) < abs(own[i] - other.mean())
            right += int(side)
    assert leave_one_out(x, y) == right


def test_groups_fully_apart_keep_honest_limits():
    result = discriminate_groups(group("a", np.arange(6.0)), group("b", 10 + np.arange(6.0)))
    assert result.auc == 1.0
    assert result.auc_ci95[1] == 1.0
    assert 0.5 < result.auc_ci95[0] < 0.9
    assert (result.correct, result.people) == (12, 12)
    assert result.accuracy_ci95[0] < 0.85


@pytest.mark.study
@pytest.mark.first_cases(1)
@pytest.mark.parametrize(("apart", "sizes"), [(1.0, (10, 6)), (0.0, (8, 8)), (2.5, (8, 12))])
def test_intervals_cover_the_truth(apart, sizes):
    repeats, rng = 600, np.random.default_rng(4)
    area = norm.cdf(apart / np.sqrt(2))
    inside = np.zeros(3)
    for _ in range(repeats):
        x, y = rng.normal(size=sizes[0]), rng.normal(apart, 1, sizes[1])
        r = discriminate_groups(group("a", x), group("b", y))
        limits = (r.difference_ci95, r.effect_ci95, r.auc_ci95)
        truths = (apart, apart, area)
        inside += [low <= t <= high for (low, high), t in zip(limits, truths, strict=True)]
    # four standard errors of a share of .95 in 600 draws: .036
    assert (np.abs(inside / repeats - 0.95) < 0.036).all()


def test_hedges_takes_the_bias_of_a_small_sample_off():
    rng, repeats = np.random.default_rng(5), 4000
    drawn = [hedges_g(rng.normal(size=5), rng.normal(1, 1, 5))[0] for _ in range(repeats)]
    assert abs(np.mean(drawn) - 1) < 4 * np.std(drawn) / np.sqrt(repeats)


def test_score_intervals_at_their_ends():
    assert newcombe_auc(0.0, 8, 8)[0] == 0.0
    low, high = wilson(0, 10)
    # Wilson's upper limit for no success is z^2/(n + z^2)
    assert low == 0.0
    assert high == pytest.approx(1.959964**2 / (10 + 1.959964**2), rel=1e-5)


def test_the_share_of_measurement_error_is_named():
    rng = np.random.default_rng(6)
    true, sd = rng.normal(size=400), np.full(400, 2.0)
    noisy = true + 2.0 * rng.normal(size=400)
    result = discriminate_groups(
        group("a", noisy[:200], sd[:200]), group("b", noisy[200:], sd[200:])
    )
    # variance 4 of 5; the sample variance of 400 has a standard error of 7 %
    assert result.measurement_share == pytest.approx(0.8, abs=4 * 0.07 * 0.8)
    assert any("measurement's own error" in w for w in result.warnings)
    # errors that are stated far too large are no share of more than everything
    stated = [
        group(n, part, 100 * sd[:200]) for n, part in (("a", noisy[:200]), ("b", noisy[200:]))
    ]
    (said,) = (w for w in discriminate_groups(*stated).warnings if "own error" in w)
    assert all(int(part) <= 100 for part in re.findall(r"(\d+) %", said))
    assert "times as large" in said


def test_too_few_people_and_no_spread_are_refused():
    with pytest.raises(InputError, match="has 2 people"):
        group("a", [1.0, 2.0])
    with pytest.raises(InputError, match="all values within a group are equal"):
        discriminate_groups(group("a", [1.0] * 3), group("b", [2.0] * 3))


def test_the_drawing_shows_every_person():
    result = discriminate_groups(
        group("a", np.arange(4.0), np.ones(4)), group("b", np.arange(3.0) + 2)
    )
    ax = plot_discrimination(result, label="k (N m/rad)")
    points = [len(line.get_xdata()) for line in ax.lines if line.get_marker() in ("o", "s")]
    assert points == [4, 3]
    assert ax.get_ylabel() == "k (N m/rad)"


def fit_file(folder, name, value, unit="N m/rad"):
    row = {"name": "k", "joint": 1, "value": value, "sd": 0.1, "sd_robust": 0.2, "unit": unit}
    path = folder / f"{name}.json"
    path.write_text(json.dumps({"parameters": [row, row | {"joint": 2, "value": value + 5}]}))
    return str(path)


def test_the_command_reads_one_file_a_person(tmp_path, capsys):
    controls = [fit_file(tmp_path, f"c{i}", 2 + 0.1 * i) for i in range(5)]
    patients = [fit_file(tmp_path, f"p{i}", 3 + 0.1 * i) for i in range(4)]
    call = ["discriminate", "--group", "controls", *controls, "--group", "patients", *patients]
    out, figure = tmp_path / "groups.json", tmp_path / "groups.png"
    assert main([*call, "--joint", "2", "--out", str(out), "--figure", str(figure)]) == 0
    written = json.loads(out.read_text())
    assert written["groups"][1]["people"][0] == {"id": "p0", "value": 8.0, "sd": 0.2}
    assert written["difference"] == pytest.approx(0.95)
    assert figure.stat().st_size > 1000
    assert "9 of 9 in the right group" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda call: call[:5], "1 groups"),
        (lambda call: [*call, "--parameter", "h"], "no parameter h"),
        (lambda call: call, "k of several joints"),
        (lambda call: [*call, call[-1], "--joint", "1"], "appears twice"),
    ],
)
def test_a_wrong_call_is_one_line_and_writes_nothing(tmp_path, capsys, change, message):
    files = [fit_file(tmp_path, f"p{i}", float(i)) for i in range(6)]
    call = change(["--group", "a", *files[:3], "--group", "b", *files[3:]])
    out = tmp_path / "groups.json"
    assert main(["discriminate", *call, "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not out.exists()


def test_files_fits_and_parameters_tell_the_same(tmp_path):
    first, second = [2.0, 2.1, 2.5], [3.0, 3.3, 3.6]
    files = {
        name: [fit_file(tmp_path, f"{name}{i}", v) for i, v in enumerate(values)]
        for name, values in (("a", first), ("b", second))
    }
    told = discriminate(files, joint=1)
    fitted = {
        name: [NamedParameter("k", v, 0.1, 0.2, "N m/rad", joint=1) for v in values]
        for name, values in (("a", first), ("b", second))
    }
    again = discriminate(fitted)
    assert again.to_dict() | {"groups": 0} == told.to_dict() | {"groups": 0}
    named = {name: dict(zip("xyz", people, strict=True)) for name, people in fitted.items()}
    assert discriminate(named).first.people == ("x", "y", "z")
    assert told.first.people == ("a0", "a1", "a2")
    with pytest.raises(InputError, match="3 groups"):
        discriminate({**files, "c": files["a"]})


@pytest.mark.parametrize(
    "people", [[1.0, 2.0, 3.0], "a.json", np.ones(3), [None, None, None]], ids=str
)
def test_who_is_no_person_is_told(people):
    with pytest.raises(InputError):
        discriminate({"a": people, "b": people})


def test_the_fit_of_one_joint_is_a_person():
    from manipulandum_sim.passive import simulate_passive

    whole = []
    for seed in (1, 2):
        markers, _ = simulate_passive("release", seed=seed, trials=1, duration_s=1.0)
        whole.append(ai.passive(markers, rest_angle=1.5, mass_sd_percent=3))
    whole.append(whole[0])
    alone = [fits["right_elbow_flexion"] for fits in whole]
    told = discriminate({"alone": alone, "whole": whole})
    assert (told.first.values == told.second.values).all()


def test_a_result_shows_itself_in_a_few_lines_and_escaped():
    x, y = np.arange(4.0), np.arange(4.0) + 3
    result = discriminate_groups(group("<b>", x), group("b", y), "<i>k</i>")
    assert len(repr(result).splitlines()) <= 12
    html = result._repr_html_()
    assert "<b>" not in html
    assert "<i>" not in html
    frame = result.to_frame()
    assert list(frame.columns) == ["value", "ci_low", "ci_high"]
    assert frame.loc["difference of means", "value"] == result.difference
    assert (frame.ci_low <= frame.value).all()
    assert (frame.value <= frame.ci_high).all()


def test_groups_of_different_units_are_refused():
    a, b = (PeopleGroup(n, ("x", "y", "z"), np.arange(3.0), None, n) for n in ("N m", "N"))
    with pytest.raises(InputError, match="in N m and in N"):
        discriminate_groups(a, b, "k")
