"""Tables and figures of models hold the printed numbers, the measured ones, and nothing else."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from armimpedance.muscles.models.fitted_model import correlation
from armimpedance.muscles.models.packed import triple
from armimpedance_figures.source_figure import write
from armimpedance_figures.tsuji1997 import (
    fig12_fig13_predicted_against_measured as fig12_fig13,
    fig14_single_joint_activation as fig14,
    over_activation,
    over_posture,
    printed,
    table1_posture_fits as table1,
    table2_activation_fits as table2,
    where_models_extrapolate as where,
)
from armimpedance_figures.tsuji1997.rows import rows_of, without_errors
from armimpedance_figures.tsuji1997.study import study

pytestmark = pytest.mark.study


@pytest.fixture(scope="module")
def postures():
    """All 20 of subject A, one set."""
    return study("postures", subject="A", seed=4, sets=1)


@pytest.fixture(scope="module")
def loaded():
    """Experiments 2 and 3 of subject A, one set."""
    return [study(name, subject="A", seed=4, sets=1) for name in ("cocontraction", "force")]


@pytest.fixture(scope="module")
def posture_fits(postures):
    return table1.fit(postures)


@pytest.fixture(scope="module")
def activation_fits(loaded):
    return over_activation.fit(*loaded)


@pytest.fixture(scope="module")
def extrapolation(postures, loaded):
    return where.fit(postures, *loaded)


def dictionaries(rows):
    header, *rest = rows
    return [dict(zip(header, row, strict=True)) for row in rest]


# What is printed


@pytest.mark.parametrize("element", ["K_ss", "K_ee", "B_ss", "B_ee"])
@pytest.mark.parametrize("order", [1, 2])
def test_printed_r_and_e_agree_where_an_element_was_fitted_alone(element, order):
    """Least squares with a constant: R^2 = 1 - E/E_0, to one in the last printed digit.

    All but one agree to rounding; B_ss at L = 2 is .9679 by its E and printed .967.
    """
    i = printed.TABLE_1_ELEMENTS.index(element)
    E, E0 = printed.TABLE_1_E[order][i], printed.TABLE_1_E[0][i]
    assert np.sqrt(1 - E / E0) == pytest.approx(printed.TABLE_1_R[order][i], abs=0.001)


@pytest.mark.parametrize("element", ["K_se", "K_es"])
def test_printed_r_and_e_of_cross_elements_say_that_one_polynomial_fitted_both(element):
    i = printed.TABLE_1_ELEMENTS.index(element)
    E, E0 = printed.TABLE_1_E[1][i], printed.TABLE_1_E[0][i]
    assert abs(np.sqrt(1 - E / E0) - printed.TABLE_1_R[1][i]) > 0.05


@pytest.mark.parametrize(
    ("R", "E"), [(printed.TABLE_1_R, printed.TABLE_1_E), (printed.TABLE_2_R, printed.TABLE_2_E)]
)
def test_printed_errors_fall_and_correlations_rise_with_the_order(R, E):
    assert (np.diff([E[order] for order in sorted(E)], axis=0) < 0).all()
    assert (np.diff([R[order] for order in sorted(R)], axis=0) > 0).all()


def test_the_adjusted_r2_of_the_print_charges_for_15_coefficients():
    assert table1.printed_adjusted_r2(0, "K_ss") == 0
    assert table1.printed_adjusted_r2(2, "K_ss") == pytest.approx(1 - 4.848 / 5 / (109.205 / 19))
    assert table1.printed_adjusted_r2(2, "K_se") < 0 < table1.printed_adjusted_r2(1, "K_se")


# Table 1


def test_table_1_holds_what_is_printed_digit_by_digit(posture_fits):
    rows = [r for r in dictionaries(table1.table(posture_fits)) if r["model"] == "least squares"]
    found = {(r["L"], r["element"]): (r["printed_R"], r["printed_E"]) for r in rows}
    assert found["0", "K_ss"] == ("0.000", "109.205")
    assert found["1", "B_ee"] == ("0.486", "0.201")
    assert found["2", "K_es"] == ("0.890", "10.560")
    assert len(found) == 24


def test_table_1_r_and_e_are_those_of_a_plain_least_squares_fit(postures, posture_fits):
    """Against numpy's own, at order 1, with one common polynomial for se and es."""
    rows = rows_of(postures, symmetric=False)
    s, e = rows.joint_angles.T
    X = np.stack([np.ones_like(s), s, e, s * s, s * e, e * e], axis=1)
    found = {
        r["element"]: r
        for r in dictionaries(table1.table(posture_fits))
        if (r["model"], r["L"]) == ("least squares", "1")
    }
    cross = rows.stiffness[:, [0, 1], [1, 0]].mean(axis=1)
    for name, measured, target in (
        ("K_ss", rows.stiffness[:, 0, 0], rows.stiffness[:, 0, 0]),
        ("K_es", rows.stiffness[:, 1, 0], cross),
        ("B_ee", rows.viscosity[:, 1, 1], rows.viscosity[:, 1, 1]),
    ):
        fit = X @ np.linalg.lstsq(X, target, rcond=None)[0]
        assert float(found[name]["R"]) == pytest.approx(correlation(measured, fit), abs=1e-5)
        assert float(found[name]["E"]) == pytest.approx(((measured - fit) ** 2).sum(), rel=1e-4)


def test_table_1_has_the_default_model_too(posture_fits):
    assert posture_fits.default.name == "sos"
    assert posture_fits.default.order == 2
    names = {r["model"] for r in dictionaries(table1.table(posture_fits))}
    assert names == {"least squares", "sos"}
    assert not posture_fits.left_out


def test_csv_on_disk_is_the_table(posture_fits, postures, tmp_path):
    paths = write(table1.FIGURE, [postures], tmp_path, [])
    caption, path = paths
    assert caption.read_text(encoding="utf-8").startswith("After Tsuji")
    with open(path, newline="", encoding="utf-8") as stream:
        assert list(csv.reader(stream)) == table1.table(posture_fits)


# Figs 10 and 11


def test_a_constant_joint_stiffness_explains_less_than_the_model(postures):
    """Both predict the points they were fitted to; the larger one fits its own rows no worse."""
    fits = over_posture.fit(postures)
    rows = without_errors(rows_of(postures))
    errors = [
        ((triple(rows.stiffness) - m.predict(rows.joint_angles).stiffness) ** 2).sum()
        for m in (fits.model, fits.constant)
    ]
    assert errors[0] < errors[1]
    assert np.ptp(fits.constant.predict(rows.joint_angles).stiffness, axis=0) == pytest.approx(0)


# Table 2 and what follows


def test_table_2_holds_what_is_printed_and_both_ways_to_fit(activation_fits):
    rows = dictionaries(table2.table(activation_fits))
    assert len(rows) == 2 * 3 * 6
    for r in rows:
        i = printed.TABLE_2_ELEMENTS.index(r["element"])
        assert float(r["printed_R"]) == printed.TABLE_2_R[int(r["N"])][i]
        assert float(r["printed_E"]) == printed.TABLE_2_E[int(r["N"])][i]
        state = str(3 + 6 * int(r["N"])) if r["model"] == "shared coefficients" else ""
        assert r["rank"] == r["coefficients"] == state


def test_the_source_s_way_obeys_the_law_of_its_printed_table(activation_fits):
    """``R^2 = 1 - E / E_0`` with one E_0 per element and all N: elements fitted by themselves."""
    rows = [r for r in dictionaries(table2.table(activation_fits)) if r["model"] == "as the source"]
    for element in printed.TABLE_2_ELEMENTS:
        own = [r for r in rows if r["element"] == element]
        whole = [float(r["E"]) / (1 - float(r["R"]) ** 2) for r in own]
        assert whole == pytest.approx([whole[0]] * 3, rel=1e-2)
        i = printed.TABLE_2_ELEMENTS.index(element)
        whole = [printed.TABLE_2_E[N][i] / (1 - printed.TABLE_2_R[N][i] ** 2) for N in (1, 2, 3)]
        assert whole == pytest.approx([whole[0]] * 3, rel=1e-2)


def test_the_force_term_is_missed_where_two_muscles_alone_could_make_up_for_it(activation_fits):
    """K_se has the fewest coefficients to hide what the source leaves out; B lacks nothing."""
    rows = dictionaries(table2.table(activation_fits))
    of = {(r["model"], r["N"], r["element"]): float(r["R"]) for r in rows}
    for N in "123":
        assert of["shared coefficients", N, "K_se"] > of["as the source", N, "K_se"] + 0.03
        for element in ("B_ss", "B_se", "B_ee"):
            ours = of["shared coefficients", N, element]
            assert ours == pytest.approx(of["as the source", N, element], abs=0.02)


def test_the_points_of_figs_12_and_13_are_measured_and_predicted(activation_fits):
    rows = dictionaries(fig12_fig13.table(activation_fits))
    measured = triple(activation_fits.rows.stiffness)
    model = activation_fits.ours[2].predict(activation_fits.rows.activation)
    ss = [r for r in rows if r["element"] == "K_ss"]
    assert [r["condition"] for r in ss] == list(activation_fits.rows.labels)
    np.testing.assert_allclose([float(r["measured"]) for r in ss], measured[:, 0], rtol=1e-5)
    np.testing.assert_allclose(
        [float(r["predicted"]) for r in ss], model.stiffness[:, 0], rtol=1e-5
    )
    half = model.half_width("stiffness")[:, 0]
    np.testing.assert_allclose([float(r["predicted_half_width"]) for r in ss], half, rtol=1e-5)
    assert len(rows) == 6 * activation_fits.rows.n_rows


def test_fig_14_extrapolates_beyond_each_measured_activation(activation_fits):
    surface = fig14.surfaces(activation_fits)["size"]
    reach = 100 * activation_fits.ours[2].activation_range
    for axis, along, pair in (("x", 1, fig14.FLEXORS), ("y", 0, fig14.EXTENSORS)):
        beyond = getattr(surface, axis) > reach[list(pair), 1].min() + 1e-6
        assert beyond.any()
        assert np.take(surface.extrapolated, np.flatnonzero(beyond), axis=along).all()
    assert not surface.extrapolated.all()


# Where models extrapolate


def test_on_its_lines_the_plane_holds_the_activations_that_were_measured(extrapolation):
    f = extrapolation
    np.testing.assert_allclose(
        where.activation_at(f, f.levels, np.zeros(len(f.levels))), f.at_level, atol=1e-12
    )
    np.testing.assert_allclose(
        where.activation_at(f, np.zeros(len(f.forces)), f.forces), f.at_force, atol=1e-12
    )
    far = where.activation_at(f, np.full(3, 0.6), np.array([-90.0, 0.0, 90.0]))
    assert ((far >= 0) & (far <= 1)).all()


def test_measured_postures_are_inside_and_far_ones_are_not(extrapolation):
    surface = where.in_workspace(extrapolation)
    hands = np.array([e.position for e in extrapolation.studied[0].hand])
    grid = np.stack(surface.grid, axis=-1)
    gap = np.linalg.norm(grid[:, :, None] - hands, axis=-1)
    middle = hands[np.linalg.norm(hands - hands.mean(axis=0), axis=1).argmin()]
    nearest = np.linalg.norm(grid - middle, axis=-1).argmin()
    assert not surface.extrapolated.ravel()[nearest]
    # the hull of the postures bulges by less than this between neighbours at the hand
    assert surface.extrapolated[gap.min(axis=2) > 0.1].all()


def test_measured_conditions_are_not_extrapolated(extrapolation):
    f = extrapolation
    measured = where.activation_at(f, f.levels, np.zeros(len(f.levels)))
    assert not f.activation.predict(measured).extrapolated.any()
    surface = where.over_activation(f)
    beyond = surface.y > 100 * f.levels[-1] + 1
    assert beyond.any()
    assert surface.extrapolated[beyond].all()
