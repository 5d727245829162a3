"""Plots of models over posture and activation draw what they are given, and mark what is not."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_rgba
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from armimpedance.core.errors import InputError
from armimpedance.hand.ellipses import ellipse, ellipse_of
from armimpedance.limb.arm.two_link import TwoLinkArm
from armimpedance.muscles.models.packed import matrix
from armimpedance.muscles.models.posture.fit import fit_posture_model
from armimpedance.muscles.models.prediction import JointPrediction, at_hand
from armimpedance.muscles.models.rows import JointRows
from armimpedance.muscles.show.maps_plot import (
    mean_axis_deg,
    measured_field,
    plot_map,
    predicted_field,
    turned_near,
)
from armimpedance.muscles.show.plot import (
    PARAMETERS,
    activation_surfaces,
    half_width_surface,
    plot_ellipse_surfaces,
    posture_points,
    posture_surfaces,
)
from armimpedance.muscles.show.predictions_plot import plot_predicted_against_measured
from armimpedance.show.plots.rows import DrawnRow, TableBlock, plot_table
from armimpedance.show.plots.surfaces import COLORS, MeasuredPoints, Surface, plot_surface

ARM = TwoLinkArm(0.30, 0.34, 1.8, 1.4, 0.13, 0.16, 0.02, 0.02)


def prediction(triples, **changes):
    """A joint prediction at different postures around the nominal one."""
    triples = np.asarray(triples, dtype=float)
    p = len(triples)
    fields = {
        "joint_angles": np.array([1.0, 1.5]) + 0.05 * np.arange(p)[:, None],
        "stiffness": triples,
        "viscosity": triples / 10,
        "stiffness_covariance": np.tile(np.diag([0.4, 0.2, 0.3]), (p, 1, 1)),
        "viscosity_covariance": np.tile(np.diag([0.004, 0.002, 0.003]), (p, 1, 1)),
        "dof": 12.0,
        "extrapolated": np.zeros(p, dtype=bool),
        "reasons": ("",) * p,
    }
    return JointPrediction(**(fields | changes))


@pytest.fixture(scope="module")
def model():
    """First order, on 20 postures of a stiffness that bends with the elbow."""
    rng = np.random.default_rng(5)
    q = np.column_stack([rng.uniform(0.2, 1.4, 20), rng.uniform(0.9, 2.1, 20)])
    K = matrix(np.column_stack([15 + 3 * q[:, 0], 6 - q[:, 1], 14 + 2 * q[:, 1] ** 2]))
    noisy = K + rng.normal(scale=0.3, size=K.shape)
    return fit_posture_model(JointRows(q, noisy, noisy / 8), order=1)


def dome(count=21, edge=0.6):
    """A surface that is extrapolated beyond a square, with its outline."""
    x, y = np.linspace(-1, 1, count), np.linspace(-1, 1, count + 2)
    X, Y = np.meshgrid(x, y)
    outside = (np.abs(X) > edge) | (np.abs(Y) > edge)
    outline = edge * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return Surface(x, y, 2 - X**2 - Y**2, outside, "x (deg)", "y (deg)", "z (m)", outline)


POINTS = MeasuredPoints(
    x=np.array([-0.4, 0.1, 0.5]),
    y=np.array([0.2, -0.3, 0.5]),
    values=np.array([1.9, 1.5, 1.7]),
    predicted=np.array([1.8, 1.9, 1.5]),
)


# Ellipses in many places


def test_a_field_is_the_ellipse_of_each_matrix_and_nan_where_there_is_none():
    hand = at_hand(prediction([[16, 5, 15], [10, 11, 10], [12, -2, 20]]), ARM)
    field = predicted_field(hand, "stiffness")
    for p in (0, 2):
        one = ellipse(hand.stiffness_matrices[p], reference_angle_rad=hand.reference_angle_rad[p])
        assert field.size[p] == pytest.approx(one.size)
        assert field.orientation_deg[p] == pytest.approx(np.rad2deg(one.orientation_rad))
        assert field.shape[p] == pytest.approx(one.shape)
    for name in (*PARAMETERS, "size_half_width"):
        assert np.isnan(getattr(field, name)[1])


def test_the_half_width_of_the_size_is_what_draws_of_the_matrix_say():
    made = prediction([[16, 5, 15]], dof=np.inf)
    field = predicted_field(at_hand(made, ARM), "stiffness")
    rng = np.random.default_rng(3)
    draws = rng.multivariate_normal(made.stiffness[0], made.stiffness_covariance[0], 20_000)
    size = np.linalg.det(matrix(draws))
    spread = 1.96 * np.std(np.log(size))
    # the spread of 20,000 draws is known to half a per cent; second order adds up to one
    assert field.size_half_width[0] == pytest.approx(spread, rel=0.03)


def test_measured_fields_are_those_of_the_estimates(make_estimate):
    given = [make_estimate(), make_estimate(0.2)]
    field = measured_field(given, "viscosity")
    for p, estimate in enumerate(given):
        assert field.size[p] == pytest.approx(ellipse_of(estimate, "viscosity").size)
    with pytest.raises(InputError, match="level joint"):
        measured_field([make_estimate(level="joint")], "viscosity")


def test_turned_axes_are_the_same_axes_near_the_centre():
    angle = np.linspace(-90, 90, 61)
    turned = turned_near(angle, 80.0)
    assert (np.abs(turned - 80) <= 90).all()
    again, given = (np.exp(2j * np.deg2rad(each)) for each in (turned, angle))
    np.testing.assert_allclose(again, given, atol=1e-12)


def test_the_mean_of_axes_does_not_mind_where_they_wrap():
    assert abs(mean_axis_deg(np.array([85.0, -85.0, np.nan]))) == pytest.approx(90)


# Surfaces


def faces_of(ax):
    """Corners (k, 3) of each face."""
    (sheet,) = (c for c in ax.collections if isinstance(c, Poly3DCollection))
    if hasattr(sheet, "_faces"):
        return list(sheet._faces)
    # Matplotlib 3.10.0 has all corners in a row
    return [sheet._vec[:3, part].T for part in sheet._segslices]


def test_points_stand_where_they_were_measured_on_stems_from_the_model():
    ax = plot_surface(dome(), POINTS)
    lines = [np.array(line.get_data_3d()) for line in ax.lines]
    stems = [line for line in lines if line.shape[1] == 2]
    marks = [line[:, 0] for line in lines if line.shape[1] == 1]
    given = np.column_stack([POINTS.x, POINTS.y, POINTS.values])
    np.testing.assert_allclose(marks, given)
    for stem, mark, predicted in zip(stems, given, POINTS.predicted, strict=True):
        np.testing.assert_allclose(stem[:, 0], [*mark[:2], predicted])
        np.testing.assert_allclose(stem[:, 1], mark)


def test_points_above_the_surface_are_filled_and_those_below_are_open():
    ax = plot_surface(dome(), POINTS)
    fills = [line.get_markerfacecolor() for line in ax.lines if len(line.get_data_3d()[0]) == 1]
    assert fills == ["black", "white", "black"]


def test_no_coloured_cell_reaches_where_the_model_extrapolates():
    surface = dome()
    ax = plot_surface(surface)
    x, y, _ = np.array([f for face in faces_of(ax) for f in face]).T
    assert np.abs(x).max() <= 0.6 + 1e-9
    assert np.abs(y).max() <= 0.6 + 1e-9
    nets = [c for c in ax.collections if isinstance(c, Line3DCollection)]
    assert nets
    assert all(np.allclose(c.get_color(), to_rgba("0.6")) for c in nets)


def test_no_cell_is_drawn_around_a_missing_value():
    surface = dome()
    values = np.array(surface.values)
    values[11, 10] = np.nan
    for outline in (surface.outline, None):
        whole = replace(surface, outline=outline)
        holed = faces_of(plot_surface(replace(whole, values=values)))
        assert len(holed) < len(faces_of(plot_surface(whole)))
        x, y = (grid[11, 10] for grid in surface.grid)
        for face in holed:
            inside = Path(np.asarray(face)[:, :2]).contains_point((x, y), radius=-1e-9)
            assert not inside


def test_a_surface_ends_at_its_outline_and_not_in_stairs():
    corner = np.array([[-0.5, -0.5], [0.55, -0.2], [0.1, 0.6]])
    x = np.linspace(-1, 1, 21)
    X, Y = np.meshgrid(x, x)
    outside = ~Path(corner).contains_points(np.column_stack([X.ravel(), Y.ravel()]))
    labels = ("x (m)", "y (m)", "z (m)")
    surface = Surface(x, x, X + Y, outside.reshape(X.shape), *labels, corner)
    area = 0.0
    for face in faces_of(plot_surface(surface)):
        (ax, ay), (bx, by), (cx, cy) = np.asarray(face)[:, :2]
        area += abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) / 2
    a, b = corner[1] - corner[0], corner[2] - corner[0]
    assert area == pytest.approx(abs(a[0] * b[1] - a[1] * b[0]) / 2, rel=0.01)


def test_a_surface_is_seen_from_the_side_to_which_it_falls():
    x = np.linspace(0, 1, 5)
    X, Y = np.meshgrid(x, x)
    inside = np.zeros((5, 5), dtype=bool)
    labels = ("x (m)", "y (m)", "z (m)")
    for sign in (1, -1):
        ax = plot_surface(Surface(x, x, sign * (X + Y), inside, *labels))
        viewer = np.array([np.cos(np.deg2rad(ax.azim)), np.sin(np.deg2rad(ax.azim))])
        assert viewer @ [sign, sign] < 0


def test_a_surface_with_nothing_measured_is_refused():
    surface = dome()
    nothing = replace(surface, extrapolated=np.ones_like(surface.extrapolated), outline=None)
    with pytest.raises(InputError, match="rests on measurements"):
        plot_surface(nothing)


def test_a_surface_needs_three_dimensions_and_a_grid_that_fits():
    ax = plot_map(dome())
    with pytest.raises(InputError, match="3d"):
        plot_surface(dome(), ax=ax)
    with pytest.raises(InputError, match="shape"):
        replace(dome(), values=np.zeros((3, 3)))
    with pytest.raises(InputError, match="finite or nan"):
        replace(dome(), values=np.full_like(dome().values, np.inf))


# Maps


def filled_at(path, point):
    """Whether the rings of a path turn around a point, by the winding rule that is drawn with."""
    rings = [ring for ring in path.to_polygons() if Path(ring).contains_point(point)]
    areas = [ring[:-1, 0] @ ring[1:, 1] - ring[1:, 0] @ ring[:-1, 1] for ring in rings]
    return sum(np.sign(areas)) != 0


def test_points_of_a_map_have_their_places_and_the_colours_of_their_values():
    ax = plot_map(dome(), POINTS)
    (points,) = (c for c in ax.collections if len(c.get_offsets()) == 3)
    np.testing.assert_allclose(points.get_offsets(), np.column_stack([POINTS.x, POINTS.y]))
    ax.figure.draw_without_rendering()
    filled = ax.collections[0]
    wanted = colormaps[COLORS](filled.norm(POINTS.values))
    np.testing.assert_allclose(points.get_facecolors(), wanted)


def test_what_lies_outside_of_the_outline_is_hatched_and_what_lies_inside_is_not():
    ax = plot_map(dome())
    hatched = [p for p in ax.patches if isinstance(p, PathPatch) and p.get_hatch()]
    assert len(hatched) == 1
    path = hatched[0].get_path()
    assert filled_at(path, (0.9, 0.0))
    assert not filled_at(path, (0.0, 0.0))
    assert not filled_at(path, (0.55, -0.55))


def test_without_an_outline_the_grid_says_what_is_hatched():
    surface = replace(dome(), outline=None)
    hatched = [c for c in plot_map(surface).collections if any(getattr(c, "hatches", []))]
    assert len(hatched) == 1
    (path,) = hatched[0].get_paths()
    assert filled_at(path, (0.9, 0.0))
    assert not filled_at(path, (0.0, 0.0))
    within = replace(surface, extrapolated=np.zeros_like(surface.extrapolated))
    assert not any(any(getattr(c, "hatches", [])) for c in plot_map(within).collections)


def test_crosses_stand_where_the_quantity_does_not_exist_and_nowhere_else():
    surface = dome(count=33)
    values = np.array(surface.values)
    values[:, :9] = np.nan
    ax = plot_map(replace(surface, values=values))
    (crosses,) = (line for line in ax.lines if line.get_marker() == "x" and len(line.get_xdata()))
    assert crosses.get_xdata().max() <= surface.x[8]
    plain = plot_map(surface)
    assert not [li for li in plain.lines if li.get_marker() == "x" and len(li.get_xdata())]


def test_a_bent_grid_is_drawn_where_its_points_lie():
    q = np.stack(np.meshgrid(np.linspace(0, 1, 9), np.linspace(1, 2, 7)), axis=-1).reshape(-1, 2)
    x, y = ARM.hand_position(q).T.reshape(2, 7, 9)
    inside = np.zeros(x.shape, dtype=bool)
    ax = plot_map(Surface(x, y, x + y, inside, "x (m)", "y (m)", "z (m)"))
    assert ax.get_xlim() == pytest.approx((x.min(), x.max()), rel=0.01)
    assert ax.get_ylim() == pytest.approx((y.min(), y.max()), rel=0.05)


# From models


def test_posture_surfaces_are_the_models_own_ellipses(model):
    surfaces = posture_surfaces(model, ARM, "stiffness", count=7)
    s, e = (np.deg2rad(getattr(surfaces["size"], axis)) for axis in "xy")
    for row, column in ((1, 2), (5, 3), (0, 6)):
        hand = at_hand(model.predict([s[column], e[row]]), ARM)
        one = ellipse(hand.stiffness_matrices[0], reference_angle_rad=hand.reference_angle_rad[0])
        assert surfaces["size"].values[row, column] == pytest.approx(1e-4 * one.size)
        assert surfaces["shape"].values[row, column] == pytest.approx(one.shape)
        turned = surfaces["orientation_deg"].values[row, column]
        assert np.cos(2 * (np.deg2rad(turned) - one.orientation_rad)) == pytest.approx(1)
        for surface in surfaces.values():
            assert surface.extrapolated[row, column] == hand.joint.extrapolated[0]


def test_the_outline_is_the_hull_of_the_measured_postures(model):
    surface = posture_surfaces(model, ARM, "stiffness", count=5)["size"]
    q = np.deg2rad(surface.outline)
    assert not model.predict(q).extrapolated.any()
    away = q + 0.1 * (q - q.mean(axis=0))
    assert model.predict(away).extrapolated.all()


def test_points_hold_measured_and_predicted_ellipses_of_each_posture(model, make_estimate):
    given = [make_estimate(joint_angles=np.array(q)) for q in ([0.8, 1.4], [1.1, 1.9])]
    points = posture_points(model, ARM, given, "viscosity")
    hand = at_hand(model.predict([e.joint_angles for e in given]), ARM)
    np.testing.assert_allclose(points["size"].x, np.rad2deg([0.8, 1.1]))
    np.testing.assert_allclose(points["size"].y, np.rad2deg([1.4, 1.9]))
    np.testing.assert_allclose(
        points["size"].values, [ellipse_of(e, "viscosity").size for e in given]
    )
    np.testing.assert_allclose(
        points["size"].predicted, [ellipse(A).size for A in hand.viscosity_matrices]
    )
    with pytest.raises(InputError, match="joint angles"):
        posture_points(model, ARM, [make_estimate(joint_angles=None)], "viscosity")


def test_activations_go_to_the_muscles_that_share_an_axis():
    asked = []

    def predict(alpha):
        asked.append(np.array(alpha))
        p = len(alpha)
        q = np.tile([1.04, 1.57], (p, 1))
        triples = np.column_stack([16 + 40 * alpha[:, 0], np.full(p, 5.0), 15 + 9 * alpha[:, 3]])
        return prediction(triples, joint_angles=q, extrapolated=alpha[:, 0] > 0.16)

    fake = SimpleNamespace(predict=predict, muscles=tuple("abcdef"))
    surfaces = activation_surfaces(
        fake,
        ARM,
        "stiffness",
        along_x=(0, 2),
        along_y=(1, 3),
        others=0.1,
        reach=(0.2, 0.3),
        labels=("x (%)", "y (%)"),
        count=5,
    )
    (alpha,) = asked
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 0.2, 5), np.linspace(0, 0.3, 5)))
    np.testing.assert_allclose(alpha, np.column_stack([x, y, x, y, 0 * x + 0.1, 0 * x + 0.1]))
    np.testing.assert_allclose(surfaces["size"].x, np.linspace(0, 20, 5))
    np.testing.assert_allclose(surfaces["size"].y, np.linspace(0, 30, 5))
    assert (np.diff(surfaces["size"].values, axis=1) > 0).all()
    np.testing.assert_array_equal(surfaces["size"].extrapolated[0], [0, 0, 0, 0, 1])


def test_half_widths_in_percent_fall_with_the_covariance():
    wide = at_hand(prediction(np.tile([16, 5, 15], (4, 1))), ARM)
    narrow = replace(wide, stiffness_covariance=wide.stiffness_covariance / 4)
    x = np.array([0.0, 1.0])
    labels = ("x (m)", "y (m)")
    a, b = (half_width_surface(h, x, x, labels).values for h in (wide, narrow))
    np.testing.assert_allclose(a, 2 * b)
    np.testing.assert_allclose(a.ravel(), 100 * predicted_field(wide, "stiffness").size_half_width)


def test_six_panels_have_titles_units_and_bars(model, make_estimate):
    given = [make_estimate(joint_angles=np.array(q)) for q in ([0.8, 1.4], [1.1, 1.9])]
    axes = plot_ellipse_surfaces(
        posture_surfaces(model, ARM, "stiffness", count=9),
        posture_points(model, ARM, given, "stiffness"),
    )
    assert [ax.get_title() for ax in axes[0]] == [
        "(a) size (10⁴ N²/m²)", "(b) orientation (deg)", "(c) shape (minor/major)",
    ]  # fmt: skip
    (legend,) = axes[0, 0].figure.legends
    assert [text.get_text().split()[1] for text in legend.get_texts()] == ["above", "below"]
    bars = [ax for ax in axes[0, 0].figure.axes if ax not in list(axes.ravel())]
    assert [bar.get_xlabel() for bar in bars] == [
        "size (10⁴ N²/m²)", "orientation (deg)", "shape (minor/major)",
    ]  # fmt: skip


# Measured against predicted


def test_measured_over_predicted_with_both_intervals_and_the_identity():
    x, y = np.array([1.0, 2.0, 4.0]), np.array([1.2, 1.9, 4.5])
    x_half, y_half = np.array([0.1, 0.2, 0.3]), np.array([0.3, 0.2, 0.1])
    ax = plot_predicted_against_measured(x, y, x_half, y_half, ["a", "b", "a"], label="K (N m/rad)")
    first, second = ax.containers
    np.testing.assert_allclose(first.lines[0].get_xydata(), [[1.0, 1.2], [4.0, 4.5]])
    np.testing.assert_allclose(second.lines[0].get_xydata(), [[2.0, 1.9]])
    along_x, along_y = first.lines[2]
    np.testing.assert_allclose(along_x.get_segments()[1], [[3.7, 4.5], [4.3, 4.5]])
    np.testing.assert_allclose(along_y.get_segments()[1], [[4.0, 4.4], [4.0, 4.6]])
    identity = ax.lines[0].get_xydata()
    np.testing.assert_array_equal(identity[:, 0], identity[:, 1])
    assert ax.get_xlim() == ax.get_ylim()
    assert ax.get_xlim()[0] < 0.9
    assert ax.get_xlim()[1] > 4.6
    assert first.lines[0].get_marker() != second.lines[0].get_marker()
    assert ax.get_ylabel() == "measured K (N m/rad)"


def test_vectors_that_do_not_match_and_too_many_groups_are_refused():
    one = np.ones(2)
    with pytest.raises(InputError, match="different numbers"):
        plot_predicted_against_measured(one, np.ones(3), one, one, ["a", "b"])
    five = np.ones(5)
    with pytest.raises(InputError, match="5 groups"):
        plot_predicted_against_measured(five, five, five, five, list("abcde"))


# Tables


def test_a_table_shows_every_cell_in_its_column():
    blocks = [
        TableBlock("first", (DrawnRow("R", ("1", "2"), strong=True), DrawnRow("E", ("3", "4")))),
        TableBlock("second", (DrawnRow("R", ("5", "6")),)),
    ]
    ax = plot_table(("left", "right"), blocks)
    texts = {t.get_text(): t for t in ax.texts}
    assert set(texts) == {"left", "right", "first", "second", "R", "E", *"123456"}
    for column, cells in (("left", "135"), ("right", "246")):
        x = texts[column].get_position()[0]
        assert all(texts[c].get_position()[0] == x for c in cells)
    for row in ("12", "34", "56"):
        assert texts[row[0]].get_position()[1] == texts[row[1]].get_position()[1]
    assert texts["1"].get_fontweight() == "bold"
    assert texts["3"].get_fontweight() == "normal"


def test_a_row_of_another_length_is_refused():
    with pytest.raises(InputError, match="first, R: 1 cells"):
        plot_table(("a", "b"), [TableBlock("first", (DrawnRow("R", ("1",)),))])
