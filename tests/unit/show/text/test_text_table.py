"""The tables say what was found, in units, in 100 columns."""

import numpy as np
import pytest

from armimpedance.hand.show.quantities import antisymmetric, principal_values
from armimpedance.hand.show.text import estimate_text, summary_table

Z_95 = 1.959964


def test_summary_fits_a_terminal_and_names_units_and_conditions(make_estimate):
    estimates = [
        make_estimate(seed=i, keys={"condition": f"hand force 19.6 N towards {45 * i} degrees"})
        for i in range(8)
    ]
    estimates += [make_estimate(k=3), make_estimate(k=1, level="joint")]
    text = summary_table(estimates)
    assert max(map(len, text.splitlines())) <= 100
    for part in ("(kg)", "(N s/m)", "(N/m)", "(deg)", "(N m/rad)", "315 degrees", "95 %"):
        assert part in text


def test_summary_shows_principal_values_with_their_half_widths(make_estimate):
    exact = make_estimate(
        stiffness=np.diag([200.0, 50.0]),
        covariance=np.diag([1e-4] * 4 + [0.01] * 4 + [100.0, 1, 1, 25]),
        dof=np.inf,
    )
    # First order at a diagonal matrix: the variances of K_11 and K_22 themselves.
    values, half = principal_values(exact, "stiffness")
    np.testing.assert_allclose(values, [200, 50])
    np.testing.assert_allclose(half, [Z_95 * 10, Z_95 * 5], rtol=1e-6)
    row = summary_table([exact]).partition("Stiffness K (N/m)")[2].splitlines()[2]
    assert "200 ± 20" in row
    assert "50.0 ± 9.8" in row


def test_principal_values_half_widths_agree_with_draws(make_estimate):
    estimate = make_estimate(dof=np.inf)
    rng = np.random.default_rng(7)
    draws = rng.multivariate_normal(estimate.stiffness.ravel(), estimate.covariance[8:, 8:], 20000)
    a = draws.reshape(-1, 2, 2)
    sampled = np.linalg.eigvalsh((a + a.transpose(0, 2, 1)) / 2)[:, ::-1].std(axis=0)
    # A sampled sd is known to 1/sqrt(2 n) = 0.5 %: four of these, and curvature within as much.
    np.testing.assert_allclose(
        principal_values(estimate, "stiffness")[1] / Z_95, sampled, rtol=0.04
    )


def test_antisymmetric_part_is_zero_with_its_error_for_a_symmetric_matrix(make_estimate):
    covariance = np.diag([1.0] * 8 + [1.0, 9.0, 16.0, 1.0])
    covariance[9, 10] = covariance[10, 9] = 12.0
    estimate = make_estimate(stiffness=[[3.0, 1.0], [1.0, 3.0]], covariance=covariance)
    # var (a - b)/2 = (9 + 16 - 2 * 12)/4
    assert antisymmetric(estimate, "K") == (0.0, pytest.approx(0.5))


def test_warnings_are_footnotes_that_their_rows_point_to(make_estimate):
    text = summary_table(
        [
            make_estimate(keys={"condition": "one"}, warnings=("first", "second")),
            make_estimate(keys={"condition": "two"}, warnings=()),
            make_estimate(keys={"condition": "three"}, warnings=("second",)),
        ]
    )
    assert text.endswith("[1] first\n\n[2] second")
    rows = {line.split()[0]: line for line in text.splitlines()[2:5]}
    assert rows["one"].endswith("[1,2]")
    assert "[" not in rows["two"]
    assert rows["three"].endswith("[2]")


def test_a_matrix_without_an_ellipse_shows_its_negative_value(make_estimate):
    estimate = make_estimate(stiffness=[[1.0, 300.0], [300.0, 1.0]])
    row = summary_table([estimate]).partition("Stiffness")[2].splitlines()[2]
    assert "-299" in row
    assert row.split()[-3:] == ["-", "-", "-"]
    assert "not positive definite" in estimate_text(estimate)


def test_full_text_holds_all_matrices_and_both_inertias(make_estimate):
    estimate = make_estimate(
        inertia=np.diag([2.0, 1.0]), inertia_with_handle=np.diag([2.164, 1.164])
    )
    text = estimate_text(estimate)
    assert max(map(len, text.splitlines())) <= 100
    for part in ("inertia M (kg)", "inertia with the handle (kg)", "viscosity B", "stiffness K"):
        assert part in text
    assert "2.16" in text
    assert "antisymmetric part, (K_12 - K_21)/2" in text
    assert "warning: onsets were detected" in text
    same_mass = make_estimate(inertia_with_handle=None)
    assert "with the handle" not in estimate_text(same_mass)
