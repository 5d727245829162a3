"""Figures of Ruiz (2011) and of the two studies: what is drawn is what fits and truth say."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.samples import from_recording
from armimpedance_figures.build_all import CATALOGUE
from armimpedance_figures.ruiz2011 import (
    fig05_time_varying as fig05,
    fig06_loads as fig06,
    fig09_windows as fig09,
    fig10_subjects as fig10,
    frequency as elbow_frequency,
    session as elbow_session,
    snr as elbow_snr,
    study_frequency as by_frequency,
    study_snr as by_snr,
)
from armimpedance_figures.ruiz2011.bench import ACTIVE, DEPTH, SOURCES, SWINGING, varying_draws
from armimpedance_figures.ruiz2011.frequency import EXACT
from armimpedance_figures.ruiz2011.snr import RAW
from armimpedance_figures.source_figure import write
from manipulandum_sim.elbow.device import RATE_HZ

pytestmark = pytest.mark.study

OURS = {n: f for n, f in CATALOGUE.items() if n.startswith(("ruiz2011", "elbow_study"))}
FEW_METHODS = ("windows", EXACT)


@pytest.fixture(scope="module")
def studied():
    """Few repetitions, levels and frequencies of every experiment."""
    with pytest.MonkeyPatch.context() as short:
        short.setattr(elbow_session, "REPETITIONS", 2)
        short.setattr(fig06, "DURATION_S", 4.0)
        few = (("elbow_frequency", elbow_frequency), ("elbow_snr", elbow_snr))
        return {
            "elbow_posture": elbow_session.study("elbow_posture", subject="2,4", seed=5, sets=1),
            "elbow_course": fig05.study("elbow_course", subject="", seed=5, sets=1),
            "elbow_loads": fig06.study("elbow_loads", subject="2", seed=5, sets=1),
            few[0][0]: tuple(
                few[0][1].study_joint(
                    joint, 5, frequencies_hz=(0.5, 2.0), draws=1, methods=FEW_METHODS
                )
                for joint in (SWINGING, SOURCES)
            ),
            few[1][0]: tuple(
                few[1][1].study_joint(joint, 5, snrs_db=(5.0, 20.0, 60.0), draws=3)
                for joint in (SWINGING, SOURCES)
            ),
        }


@pytest.fixture(scope="module")
def given(studied):
    found = {f.name: [studied[name] for name in f.experiments] for f in OURS.values()}
    found["ruiz2011_fig09_windows"] = [studied["elbow_posture"][:1]]
    return {name: OURS[name].given(one) for name, one in found.items()}


def dictionaries(rows):
    header, *rest = rows
    return [dict(zip(header, row, strict=True)) for row in rest]


# Every figure


def test_six_figures():
    assert len(OURS) == 6


@pytest.mark.parametrize("figure", OURS.values(), ids=OURS)
def test_written_the_same_twice_with_a_table(figure, studied, tmp_path):
    experiments = [studied[name] for name in figure.experiments]
    if figure.fit is not None:
        experiments = [experiments[0][:1]]
    first, again = (
        {p.suffix: p.read_bytes() for p in write(figure, experiments, tmp_path, ["svg"])}
        for _ in range(2)
    )
    assert first == again
    assert set(first) == {".svg", ".txt", ".csv"}


@pytest.mark.parametrize("figure", OURS.values(), ids=OURS)
def test_captions_say_source_simulation_and_difference(figure, given):
    caption = figure.caption(*given[figure.name])
    assert "Ruiz et al. (2011)" in caption
    for part in ("imulated", "Differs from the source: simulated"):
        assert part in caption
    for slip in ("nan", "  ", "—", "None", "inf "):
        assert slip not in caption


@pytest.mark.parametrize("figure", OURS.values(), ids=OURS)
def test_axes_have_units_and_legends_lie_on_nothing(figure, given):
    drawn = figure.draw(*given[figure.name])
    drawn.draw_without_rendering()
    (legend,) = drawn.legends
    box = legend.get_window_extent()
    assert drawn.bbox.x0 <= box.x0
    assert box.x1 <= drawn.bbox.x1
    for ax in drawn.axes:
        assert ax.get_legend() is None
        assert ax.get_tightbbox().y1 <= box.y0 + 1
        for label in (ax.get_xlabel(), ax.get_ylabel()):
            assert not label or ("(" in label and ")" in label)
        title = ax.title if ax.title.get_text() else ax._left_title
        for text in [*ax.texts, title]:
            assert text.get_fontsize() >= 7
            assert text.get_window_extent().x1 <= drawn.bbox.x1 + 1


@pytest.mark.parametrize("module", [elbow_session, fig05, fig06, elbow_frequency, elbow_snr])
def test_an_experiment_that_there_is_not_is_refused(module):
    with pytest.raises(InputError, match="p5"):
        module.study("p5", subject="1", seed=0, sets=1)


# Fig. 5


def test_drawn_courses_are_the_estimates_and_the_truth(studied):
    course = studied["elbow_course"]
    axes = fig05.draw(course).axes
    for name, ax in zip(fig05.ROWS, axes, strict=True):
        true, windows, smoother = ax.lines
        np.testing.assert_array_equal(true.get_ydata(), getattr(course.record, name))
        for line, method in ((windows, "windows"), (smoother, "smoother")):
            np.testing.assert_array_equal(line.get_ydata(), getattr(course.found[method], name))


def test_rms_that_the_title_says_is_that_of_the_table(studied):
    course = studied["elbow_course"]
    rows = dictionaries(fig05.table(course))
    for name, ax in zip(fig05.ROWS, fig05.draw(course).axes, strict=True):
        for method in fig05.METHODS:
            mine = [r for r in rows if r["parameter"] == name and r["method"] == method]
            off = np.array([float(r["estimated"]) / float(r["true"]) - 1 for r in mine])
            rms = 100 * np.sqrt((off**2).mean())
            assert course.percent(method, name) == pytest.approx(rms, abs=0.01)
            assert f"{method} {course.percent(method, name):.1f} %" in ax.get_title(loc="left")


def test_the_truth_varies_as_is_said(studied):
    record = studied["elbow_course"].record
    for name, mean in (("K", SOURCES.stiffness), ("B", SOURCES.viscosity)):
        course = getattr(record, name)
        assert course.max() == pytest.approx(mean * (1 + DEPTH), rel=1e-3)
        assert course.min() == pytest.approx(mean * (1 - DEPTH), rel=1e-3)
        spectrum = np.abs(np.fft.rfft(course - course.mean()))
        peak = spectrum.argmax() * RATE_HZ / len(course)
        assert peak == pytest.approx(fig05.FREQUENCY_HZ, abs=RATE_HZ / len(course))


# Fig. 6


def test_a_lag_of_the_filter_is_a_false_viscosity_of_the_springs_sign(studied):
    """``K theta(t - d) = K theta - K d theta' + ...``: within the device's own friction, which
    brakes, its viscosity and Coulomb's at this amplitude, 0.25 N m s/rad before it is hidden."""
    spring, _, inertia = studied["elbow_loads"]
    view = spring.views[fig06.MEASURED]
    assert -spring.asked * fig06._lag_s() < view.false < 0
    assert inertia.views[fig06.MEASURED].false > 0


def test_behind_the_controls_filter_most_of_the_loop_is_gone(studied):
    for load in studied["elbow_loads"]:
        before, after = (abs(load.views[v].false) for v in (fig06.MEASURED, fig06.LAG_TAKEN_OFF))
        assert after < 0.6 * before
        # within what the device's own inertia adds to a small load
        assert load.views[fig06.LAG_TAKEN_OFF].load == pytest.approx(load.asked, rel=0.15)


def test_the_filter_is_late_by_what_is_said():
    ramp = np.arange(3000) / RATE_HZ
    late = fig06.behind_control(np.stack([ramp, ramp]))
    assert ramp[-1] - late[0, -1] == pytest.approx(fig06._lag_s(), rel=0.01)


def test_loads_fitted_are_those_drawn(studied):
    for load, ax in zip(
        studied["elbow_loads"], fig06.draw(studied["elbow_loads"]).axes, strict=True
    ):
        for view, line in zip(load.views.values(), ax.lines, strict=False):
            slope = np.polyfit(line.get_xdata(), line.get_ydata(), 1)[0]
            # the variable in quadrature is nearly orthogonal to it
            assert slope == pytest.approx(view.load, rel=0.02)


# Figs 9 and 10


def test_windows_of_both_lengths_are_in_the_table(given):
    (windows,) = given["ruiz2011_fig09_windows"]
    rows = dictionaries(fig09.table(windows))
    for length_s, found in windows.found.items():
        mine = [r for r in rows if float(r["window_s"]) == length_s and r["parameter"] == "K"]
        assert [float(r["estimated"]) for r in mine] == pytest.approx(list(found.K), rel=1e-5)
        for r in mine:
            assert float(r["true"]) == pytest.approx(windows.session.true("K"), rel=1e-5)


def test_longer_windows_scatter_less(given):
    (windows,) = given["ruiz2011_fig09_windows"]
    short, long = sorted(windows.found)
    assert windows.scatter(long, "K") < windows.scatter(short, "K")


def test_subjects_are_drawn_with_mean_sd_and_truth(studied):
    sessions = studied["elbow_posture"]
    rows = {(r["subject"], r["parameter"]): r for r in dictionaries(fig10.table(sessions))}
    assert len(rows) == 2 * len(sessions)
    for name, ax in zip(fig10.PRINTED, fig10.draw(sessions).axes, strict=True):
        lines = {line.get_label(): line for line in ax.lines}
        (bars,) = ax.containers
        means, (_, _), (stems,) = bars.lines
        for i, one in enumerate(sessions):
            each = np.array([getattr(f, fig10_names[name]).value for f in one.fits])
            row = rows[one.subject, name]
            assert float(row["mean"]) == pytest.approx(each.mean(), rel=1e-5)
            assert float(row["sd"]) == pytest.approx(each.std(ddof=1), rel=1e-5)
            assert means.get_ydata()[i] == pytest.approx(each.mean())
            half = np.diff(stems.get_segments()[i][:, 1])[0] / 2
            assert half == pytest.approx(each.std(ddof=1))
            assert lines["true"].get_ydata()[i] == one.true(name)


fig10_names = {"B": "viscosity", "K": "stiffness"}


def test_truths_lie_in_the_printed_range(studied):
    for one in studied["elbow_posture"]:
        for name, (low, high) in fig10.PRINTED.items():
            assert low < one.true(name) < high


def test_a_fit_finds_the_truth_within_four_standard_errors(studied):
    for one in studied["elbow_posture"]:
        for fit in one.fits:
            k = fit.stiffness
            assert abs(k.value - one.true("K")) < 4 * k.sd_robust


# The studies


def test_raw_arx_is_never_within_ten_percent_and_the_others_are_at_20_db(studied):
    for one in studied["elbow_snr"]:
        assert np.isnan(one.lowest_db(RAW)).all()
        at = list(one.snrs_db).index(20.0)
        for method in set(one.error) - {RAW}:
            assert (one.rms(method)[at] < elbow_snr.WITHIN).all()


def test_rms_counts_a_draw_without_a_joint_as_all_wrong():
    error = np.array([[[0.0] * 3, [np.nan] * 3], [[0.05] * 3, [-0.05] * 3]])
    one = elbow_snr.SnrStudy(SOURCES, np.array([5.0, 10.0]), {"iv": error})
    assert one.rms("iv") == pytest.approx(np.sqrt([[0.5] * 3, [0.05**2] * 3]))
    assert list(one.failed("iv")) == [1, 0]
    assert list(one.lowest_db("iv")) == [10.0] * 3


def test_an_snr_that_is_better_by_chance_below_is_not_the_lowest():
    error = np.array([[[0.01] * 3], [[0.5] * 3], [[0.01] * 3]])
    one = elbow_snr.SnrStudy(SOURCES, np.array([0.0, 5.0, 10.0]), {"arx": error})
    assert list(one.lowest_db("arx")) == [10.0] * 3


def test_noise_has_the_snr_that_is_said():
    """White noise of 10 000 samples: its power is known to 1.4 %, 0.06 dB."""
    (record,) = varying_draws(SOURCES, 0.5, draws=1, snr_db=40.0, seed=3)
    clean = record.samples
    white = np.random.default_rng(4).standard_normal((2, len(clean.torque)))
    noisy = elbow_snr._noisy(clean, white, 12.0)
    for name in ("torque", "angle"):
        signal = getattr(clean, name)
        noise = getattr(noisy, name) - signal
        assert 20 * np.log10(signal.std() / noise.std()) == pytest.approx(12.0, abs=0.25)


def test_a_median_of_mostly_refused_draws_is_a_gap():
    error = np.array(
        [[[0.1, 0.2], [np.nan] * 2, [0.3, 0.1]], [[0.1, 0.1], [np.nan] * 2, [np.nan] * 2]]
    )
    one = elbow_frequency.FrequencyStudy(SOURCES, np.array([1.0, 2.0]), {"spline": error}, 40.0)
    assert one.median("spline")[0] == pytest.approx([0.3, 0.2])
    assert np.isnan(one.median("spline")[1]).all()
    assert list(one.refused("spline")) == [1, 2]


def test_activations_make_stiffness_linear_in_them():
    """``K = K0 (1 - ACTIVE) + gain (aF + aE)`` exactly."""
    (record,) = varying_draws(SOURCES, 1.0, draws=1, snr_db=40.0, seed=3)
    X = np.column_stack([np.ones(len(record.K)), record.activation])
    found, left, *_ = np.linalg.lstsq(X, record.K, rcond=None)
    assert found[0] == pytest.approx((1 - ACTIVE) * SOURCES.stiffness)
    assert found[1] == pytest.approx(found[2])
    assert left.sum() < 1e-16 * len(record.K)


def test_windows_get_worse_and_known_activations_do_not(studied):
    """Windows of half a second against a period of half a second and of two."""
    for one in studied["elbow_frequency"]:
        slow, fast = one.median("windows")[:, 1]
        assert fast > 2 * slow
        assert (one.median(EXACT) < 0.02).all()


def test_error_of_a_constant_is_the_mean_over_a_period():
    phase = 2 * np.pi * np.arange(1000) / 1000
    course = 1 + 0.3 * np.sin(phase)
    rms = np.sqrt(((1 / course - 1) ** 2).mean())
    assert by_frequency._of_a_constant(0.3) == pytest.approx(rms)


@pytest.mark.parametrize(
    ("module", "experiment", "count"),
    [(by_snr, "elbow_snr", 3), (by_frequency, "elbow_frequency", 2)],
)
def test_drawn_errors_are_those_of_the_study(module, experiment, count, studied):
    studies = studied[experiment]
    axes = np.reshape(module.draw(studies).axes, (count, len(studies)))
    for column, one in enumerate(studies):
        found = one.rms if experiment == "elbow_snr" else one.median
        for row, index in enumerate(module.DRAWN_ROWS):
            drawn = [
                line for line in axes[row, column].lines if not line.get_label().startswith("_")
            ]
            for line, method in zip(drawn, one.error, strict=True):
                percent = 100 * found(method)[:, index]
                expected = np.minimum(percent, 100) if experiment == "elbow_snr" else percent
                np.testing.assert_allclose(line.get_ydata(), expected)


@pytest.mark.parametrize("module", [by_snr, by_frequency])
def test_tables_hold_every_method_and_level(module, studied):
    name = "elbow_snr" if module is by_snr else "elbow_frequency"
    studies = studied[name]
    rows = dictionaries(module.table(studies))
    levels = len(studies[0].snrs_db if module is by_snr else studies[0].frequencies_hz)
    assert len(rows) == sum(len(one.error) * levels for one in studies)


def test_unknown_methods_are_refused_before_anything_is_simulated():
    with pytest.raises(InputError, match="nosuch"):
        elbow_snr.study_joint(SOURCES, 0, methods=("nosuch",))
    with pytest.raises(InputError, match="nosuch"):
        elbow_frequency.study_joint(SOURCES, 0, methods=("nosuch",))


def test_samples_of_a_repetition_are_those_of_the_recording(studied):
    one = studied["elbow_posture"][0]
    whole = from_recording(one.recording)
    np.testing.assert_array_equal(one.samples(1).angle, whole.angle[whole.samples_of(1)])
