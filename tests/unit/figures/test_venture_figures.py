"""Figures of Venture's two sources: what is drawn is what the fits, the truth and the print say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.motion import EmgSignals
from armimpedance.hand.comparison.discrimination import PeopleGroup, discriminate_groups
from armimpedance.hand.comparison.show.plot import plot_discrimination
from armimpedance.joint.body.rows import each_trial
from armimpedance.joint.relaxed.methods import METHODS
from armimpedance.joint.relaxed.show.plot import plot_emg_level
from armimpedance.numerics.regression import NamedParameter
from armimpedance.numerics.signals.emg.silence import EmgLevel
from armimpedance_figures.build_all import CATALOGUE
from armimpedance_figures.source_figure import write
from armimpedance_figures.venture_elbow import (
    fig04,
    fig06_fig07 as fig06,
    fig08_fig09 as fig08,
    printed as venture_printed,
    study as passive_study,
    table2_table3 as tables,
)
from armimpedance_figures.venture_poster import (
    conditions,
    cross_validation as poster,
    discrimination as groups,
    shoulders as venture_shoulders,
    study as body_study,
)
from armimpedance_figures.venture_poster.shoulders import Population, Shoulder, StudiedShoulders
from manipulandum_sim.passive.subject import PASSIVE_SUBJECTS

pytestmark = pytest.mark.study

VENTURE = {name: figure for name, figure in CATALOGUE.items() if name.startswith("venture")}
MOTIONS = ("all_joints", "front_squat", "bending")
#: Rms error of k over the 22 people of the figure, %: what the skin's slide and the noise make.
USUAL_ERROR_PERCENT = 2.1


@pytest.fixture(scope="module")
def studied():
    """Short recordings of every experiment."""
    with pytest.MonkeyPatch.context() as short:
        short.setattr(passive_study, "P5_FRAMES", {"1": 100, "2": 95})
        short.setattr(passive_study, "RELEASES", 2)
        short.setattr(passive_study, "RELEASE_FRAMES", 45)
        short.setattr(body_study, "MOTIONS", MOTIONS)
        short.setattr(venture_shoulders, "_examine", guessed)
        yield {
            "p5": passive_study.study("p5", subject="1,2", seed=5, sets=1),
            "release": passive_study.study("release", subject="1,2", seed=5, sets=1),
            "body": body_study.study("body", subject="B", seed=5, sets=1),
            "shoulders": venture_shoulders.study("shoulders", subject="", seed=5, sets=1),
        }


def guessed(group, someone, seed):
    """A person whose stiffness is known to 5 %, without a recording."""
    true = someone.joints[venture_shoulders.FLEXION].k
    value = true * (1 + 0.05 * np.random.default_rng(seed).standard_normal())
    k = NamedParameter("k", value, 0.01 * true, 0.05 * true, "N m/rad")
    return Shoulder(group, someone.name, someone.mass_kg, someone.height_m, true, k, 100)


@pytest.fixture(scope="module")
def given(studied):
    return {f.name: [studied[name] for name in f.experiments] for f in VENTURE.values()}


def dictionaries(rows):
    header, *rest = rows
    return [dict(zip(header, row, strict=True)) for row in rest]


# Every figure


@pytest.mark.parametrize("figure", VENTURE.values(), ids=VENTURE)
def test_the_same_twice(figure, given, tmp_path):
    first, again = (
        {p.suffix: p.read_bytes() for p in write(figure, given[figure.name], tmp_path, ["svg"])}
        for _ in range(2)
    )
    assert first == again
    assert set(first) == {".svg", ".txt"} | (set() if figure.table is None else {".csv"})


@pytest.mark.parametrize("figure", VENTURE.values(), ids=VENTURE)
def test_captions_say_source_simulation_and_difference(figure, given):
    caption = figure.caption(*given[figure.name])
    assert caption.startswith("After Venture")
    for part in ("imulated", "Differs from the source: simulated"):
        assert part in caption
    for slip in ("nan", "  ", "—", "None"):
        assert slip not in caption


@pytest.mark.parametrize("figure", VENTURE.values(), ids=VENTURE)
def test_text_is_readable_and_nothing_lies_on_anything(figure, given):
    drawn = figure.draw(*given[figure.name])
    drawn.draw_without_rendering()
    legends = [*drawn.legends, *(ax.get_legend() for ax in drawn.axes if ax.get_legend())]
    assert not any(legend.get_frame_on() for legend in legends)
    for ax in drawn.axes:
        for label in (ax.get_xlabel(), ax.get_ylabel()):
            assert not label or ("(" in label and ")" in label)
        assert all(t.get_fontsize() >= 7 for t in [*ax.texts, ax.title])
        boxes = [t.get_window_extent() for t in ax.texts if t.get_text()]
        for i, box in enumerate(boxes):
            assert box.x0 >= -1
            assert box.x1 <= drawn.bbox.x1 + 1
            assert not any(overlap(box, other) for other in boxes[:i])


def overlap(a, b, slack=1.0):
    """Whether two boxes share more than a pixel's width."""
    wide = min(a.x1, b.x1) - max(a.x0, b.x0)
    high = min(a.y1, b.y1) - max(a.y0, b.y0)
    return wide > slack and high > slack


@pytest.mark.parametrize(
    ("study", "word"),
    [(passive_study.study, "p6"), (body_study.study, "p5"), (venture_shoulders.study, "p5")],
)
def test_an_experiment_that_there_is_not_is_refused(study, word):
    with pytest.raises(InputError, match=word):
        study(word, subject="1", seed=0, sets=1)


# The elbow's tables


def test_the_print_breaks_its_own_rule():
    """The source's text calls h of both releases well estimated; twice its sd is above 10 %."""
    for subject in "12":
        h = float(venture_printed.TABLES_II_III[subject, "release"].relative_sd_percent[1])
        assert h < 10 < 2 * h


def test_tables_hold_print_and_truth(given):
    rows = dictionaries(tables.table(*given["venture_elbow_table2_table3"]))
    assert len(rows) == 2 * 2 * 3 * 3
    found = {(r["subject"], r["test"], r["parameter"], r["method"]): r for r in rows}
    assert found["1", "p5", "f", "ls"]["printed"] == "-0.015"
    assert found["2", "p5", "f", "ls"]["printed_relative_sd_percent"] == "68.16"
    assert found["1", "release", "h", "parallel"]["printed_cond_W"] == "2.91"
    assert found["2", "p5", "k", "ls"]["printed_n"] == "450"
    for (subject, _, name, _), row in found.items():
        elbow = PASSIVE_SUBJECTS[subject].joints["right_elbow_flexion"]
        assert float(row["simulated_truth"]) == pytest.approx(getattr(elbow, name))
        small = 2 * float(row["relative_sd_percent"]) < 10
        assert row["well_identified"] == ("yes" if small else "no")


def test_ls_is_the_sources_estimator_and_covariance(studied):
    """Against numpy's own least squares on the smoothed samples, eqs (8)-(11)."""
    one = studied["p5"][0]
    s, fit = one.samples, one.fits["ls"]
    W = np.column_stack([s.q[:, 0] - one.true("q_r"), s.qd[:, 0], np.sign(s.qd[:, 0])])
    X, (left,), *_ = np.linalg.lstsq(W, s.torque[:, 0], rcond=None)
    sd = np.sqrt(left / (len(W) - 3) * np.diag(np.linalg.inv(W.T @ W)))
    for i, name in enumerate(("k", "h", "f")):
        assert fit.parameters[name].value == pytest.approx(X[i], rel=1e-8)
        assert fit.parameters[name].sd == pytest.approx(sd[i], rel=1e-6)
    assert fit.torque_fit.cond_raw == pytest.approx(np.linalg.cond(W), rel=1e-8)
    assert fit.torque_fit.n_rows == len(W)


def test_stiffness_is_found_by_the_default_method(studied):
    """Within four robust standard errors."""
    for one in (*studied["p5"], *studied["release"]):
        k = one.fits[METHODS.default].parameters["k"]
        assert abs(k.value - one.true("k")) < 4 * k.sd_robust


def test_a_subject_that_the_source_does_not_have_gets_dashes(studied):
    someone = [replace(studied[name][0], subject="whole-arm") for name in ("p5", "release")]
    rows = dictionaries(tables.table(*((one,) for one in someone)))
    assert {r["printed"] for r in rows} == {""}
    texts = [t.get_text() for t in tables.draw(*((one,) for one in someone)).axes[0].texts]
    assert "-" in texts
    assert not any("Table II" in text for text in texts)


# The elbow's figures


def lines(ax):
    return {name: line_group(ax, name) for name in ("measured", "estimated", "difference")}


def line_group(ax, name):
    """y of all lines of a look, pieces one after another; three lines a piece."""
    at = ["measured", "estimated", "difference"].index(name)
    return np.concatenate([line.get_ydata() for line in ax.lines[at::3]])


@pytest.mark.parametrize("module", [fig06, fig08])
def test_the_difference_is_drawn_and_its_rms_is_said(module, studied):
    panels = module.panels(studied["p5"], studied["release"])
    axes = module.draw(studied["p5"], studied["release"]).axes
    rows = dictionaries(module.table(studied["p5"], studied["release"]))
    assert len(panels) == len(axes) == len(rows) == 4
    for panel, ax, row in zip(panels, axes, rows, strict=True):
        drawn = lines(ax)
        left = drawn["measured"] - drawn["estimated"]
        np.testing.assert_allclose(drawn["difference"], left, atol=1e-12)
        rms = np.sqrt((left**2).mean())
        assert float(row["rms_Nm"]) == pytest.approx(rms, rel=1e-5)
        r2 = 1 - (left**2).sum() / (drawn["measured"] ** 2).sum()
        assert float(row["r2_about_zero"]) == pytest.approx(r2, abs=1e-5)
        assert f"rms {rms:.3f} N m" in ax.get_title(loc="left")
        assert ax.get_title(loc="left").startswith(panel.title)


def test_cross_validation_is_of_recordings_that_were_not_fitted(studied):
    p5, release = studied["p5"], studied["release"]
    panels = fig08.panels(p5, release)
    assert [panel.fit for panel in panels] == [p5[i].fits[METHODS.default] for i in (0, 0, 1, 1)]
    samples = [release[0].samples, p5[0].again, release[1].samples, p5[1].again]
    for panel, expected in zip(panels, samples, strict=True):
        assert panel.samples is expected
    for i in (0, 1):
        assert not np.array_equal(p5[i].again.q, p5[i].samples.q)


def test_emg_lies_about_two_percent_below_the_gate(studied):
    one = studied["p5"][0]
    assert abs(one.level.mean_percent - 2).max() < 0.2
    for ax in fig04.draw(studied["p5"]).axes:
        _, mean, gate = ax.lines
        assert set(gate.get_ydata()) == {one.level.limit_percent}
        assert mean.get_ydata().max() < one.level.limit_percent


def test_the_drawn_mean_is_the_one_that_the_gate_judges(studied):
    one = studied["p5"][0]
    for ax, highest in zip(
        fig04.draw(studied["p5"]).axes, one.level.highest_percent[0], strict=True
    ):
        # the drawn envelope is clipped at zero, the gate's is not: they differ at the filter's ends
        assert ax.lines[1].get_ydata().max() == pytest.approx(highest, rel=0.01)


def test_emg_in_volts_is_not_drawn():
    emg = EmgSignals(1000.0, [0, 2000], np.ones((2000, 1)), ("biceps",), "V")
    with pytest.raises(InputError, match="EMG in V"):
        plot_emg_level(emg, EmgLevel(emg.muscles, [[1.0]], [[1.0]], 3.0))


# The poster


def test_the_body_has_as_many_base_parameters_as_the_posters(studied):
    assert studied["body"].weighted.base.rank == venture_printed.BASE_PARAMETERS


def test_conditions_are_those_of_the_scaled_regressor(studied):
    body = studied["body"]
    rows = dictionaries(conditions.table(body))
    assert [r["motion"] for r in rows] == list(MOTIONS)
    leading = body.weighted.base.leading
    for row, trial in zip(rows, each_trial(body.recording, body.rows), strict=True):
        W = trial.W[..., leading].reshape(-1, len(leading))
        plain = np.linalg.cond(W / np.linalg.norm(W, axis=0))
        assert float(row["condition_alone"]) == pytest.approx(plain, rel=1e-4)


def test_greedy_choices_start_best_and_only_improve(studied):
    body = studied["body"]
    for column, left_out in (("all", ""), ("natural", body_study.UNNATURAL)):
        rows = [r for r in dictionaries(conditions.table(body)) if r["motion"] != left_out]
        after = "condition_after_it" + ("_natural" if left_out else "")
        chosen = sorted(
            (r for r in rows if r[f"chosen_of_{column}"]), key=lambda r: -float(r[after])
        )
        assert [r[f"chosen_of_{column}"] for r in chosen] == [
            str(i + 1) for i in range(len(chosen))
        ]
        best = min(float(r["condition_alone"]) for r in rows)
        assert float(chosen[0][after]) == pytest.approx(best, rel=1e-4)
        assert len({r[after] for r in chosen}) == len(chosen)


def test_noise_makes_poor_motions_look_better(studied):
    """What the caption warns of: bending hardly moves the wrists, noise does."""
    found = {r["motion"]: r for r in dictionaries(conditions.table(studied["body"]))}
    bending = found["bending"]
    assert float(bending["condition_alone_without_noise"]) > 5 * float(bending["condition_alone"])


def test_predicted_motions_were_not_fitted(studied):
    body = studied["body"]
    shown = poster.shown(body)
    assert shown
    assert not set(shown) & set(body.weighted.choice.motions)


def test_what_is_drawn_is_what_the_table_judges(studied):
    body = studied["body"]
    rows = {
        (r["motion"], r["component"]): r
        for r in dictionaries(poster.table(body))
        if r["parameters"] == "weighted least squares"
    }
    shown = poster.shown(body)
    axes = np.reshape(poster.draw(body).axes, (6, len(shown)))
    for m, motion in enumerate(shown):
        for r, component in enumerate(("fx", "fy", "fz", "mx", "my", "mz")):
            measured, predicted = (line.get_ydata() for line in axes[r, m].lines)
            row, left = rows[motion, component], measured - predicted
            assert float(row["rms"]) == pytest.approx(np.sqrt((left**2).mean()), rel=1e-3)
            r2 = 1 - (left**2).sum() / ((measured - measured.mean()) ** 2).sum()
            assert float(row["r2_about_mean"]) == pytest.approx(r2, abs=1e-4)
            zero = 1 - (left**2).sum() / (measured**2).sum()
            assert float(row["r2_about_0"]) == pytest.approx(zero, abs=1e-4)
            assert row["unit"] == ("N" if r < 3 else "N m")
            assert axes[r, m].texts[0].get_text() == f"R² {float(row['r2_about_mean']):.2f}"


def test_moments_are_predicted_as_well_as_the_truth_predicts_them(studied):
    """Noise of the angles is all that is left: within a tenth of what the true parameters leave."""
    body = studied["body"]
    moments = body.weighted.fitted.moments
    shown = poster.shown(body)
    ours, true = (
        body.agreement(phi, shown).pooled_rms(moments)
        for phi in (body.prior.predicting_phi, body.true_phi)
    )
    assert ours < 1.1 * true


# Two groups


def test_groups_are_as_far_apart_as_is_said():
    """Equal steps of probability: the mean exactly, the sd from below."""
    for group in (venture_shoulders.CONTROLS, venture_shoulders.PATIENTS):
        drawn = [group.stiffness(i) for i in range(group.people)]
        assert np.mean(drawn) == pytest.approx(group.mean)
        assert 0.85 * group.sd < np.std(drawn, ddof=1) < 1.05 * group.sd


def test_everybody_is_in_the_table_and_in_the_drawing(studied):
    shoulders = studied["shoulders"]
    rows = dictionaries(groups.table(shoulders))
    assert len(rows) == venture_shoulders.CONTROLS.people + venture_shoulders.PATIENTS.people
    assert len({r["person"] for r in rows}) == len({r["mass_kg"] for r in rows}) == len(rows)
    ax = groups.draw(shoulders).axes[0]
    for container, name in zip(ax.containers, ("controls", "patients"), strict=True):
        drawn = container.lines[0].get_ydata()
        told = sorted(float(r["k_Nm_per_rad"]) for r in rows if r["group"] == name)
        np.testing.assert_allclose(drawn, told, rtol=1e-5)


def test_the_threshold_is_drawn_midway():
    rng = np.random.default_rng(2)
    first, second = (
        PeopleGroup(name, tuple("abcd"), mean + rng.standard_normal(4))
        for name, mean in (("controls", 0.0), ("patients", 3.0))
    )
    ax = plot_discrimination(discriminate_groups(first, second), label="k (N m/rad)")
    middle = (first.values.mean() + second.values.mean()) / 2
    assert any(np.allclose(line.get_ydata(), middle) for line in ax.lines)
    assert "threshold" in [t.get_text() for t in ax.texts]


def test_a_shoulder_is_found_from_its_markers(monkeypatch):
    """Within five times the usual error."""
    monkeypatch.setattr(venture_shoulders, "SECONDS", 2.0)
    rng = np.random.default_rng(3)
    someone = venture_shoulders._person("P1", 5.0, rng)
    found = venture_shoulders._examine("patients", someone, 7)
    assert found.true_k == 5.0
    assert abs(found.k.value / 5.0 - 1) < 5 * USUAL_ERROR_PERCENT / 100


def test_a_person_keeps_their_body_whatever_the_size_of_the_group(monkeypatch):
    monkeypatch.setattr(venture_shoulders, "_examine", guessed)
    few, many = (
        venture_shoulders._group(Population("controls", count, 4.0, 0.7), 9, 0) for count in (3, 5)
    )
    assert [p.mass_kg for p in few] == [p.mass_kg for p in many[:3]]


def test_caption_counts_intervals_that_hold_the_truth(studied):
    shoulders = studied["shoulders"]
    inside = sum(abs(p.k.value - p.true_k) <= 1.96 * p.k.sd_robust for p in shoulders.people)
    assert f"{inside} of {len(shoulders.people)} of" in groups.caption(shoulders)
    assert isinstance(shoulders, StudiedShoulders)
