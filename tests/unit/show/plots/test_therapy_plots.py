"""The therapy robot's drawings: what is drawn is what was measured, fitted and contributed."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import Hinge, Segment, Skeleton
from armimpedance.joint.therapy.arm.movements import MovementTorques
from armimpedance.joint.therapy.arm.passive_arm import Elastic, PassiveArm
from armimpedance.joint.therapy.robot.holds import fit_holds
from armimpedance.joint.therapy.robot.steady import SteadyPart
from armimpedance.joint.therapy.robot.sweeps import fit_axis
from armimpedance.joint.therapy.robot.therapy_robot import Loads, TherapyRobot, parameter_count
from armimpedance.joint.therapy.show.plots import (
    plot_contribution,
    plot_feedback,
    plot_friction,
    plot_passive_arm,
    plot_robot_calibration,
    plot_spring,
)
from armimpedance.numerics.regression import NamedParameter
from armimpedance.show.plots.style import new_axes

AXES = ("elevation", "horizontal")
COULOMB, VISCOUS = 2.0, 0.8
SPRING = (-5.0, -12.0, 4.0)
SPEEDS_DEG_S = (0.1, 1.0, 4.0, 10.0, 30.0, 60.0)
#: Share of what the passive arm needs, by condition.
SHARES = {"passive": 0.0, "active": 0.6, "resistive": -1.5}


def sweep(rng, speed_deg_s, direction, axis=1):
    """Friction that is 40 % larger than its law at the two lowest speeds."""
    v = direction * np.deg2rad(speed_deg_s)
    q = 0.5 + v * np.linspace(-1, 1, 80)
    static = 1.4 if speed_deg_s <= 1.0 else 1.0
    load = direction * COULOMB * static + VISCOUS * v + 0.3 * (q - 0.4)
    return SteadyPart(
        "1", axis, q, np.full(80, v), load + 0.01 * rng.standard_normal(80), direction
    )


@pytest.fixture(scope="module")
def sweeps():
    rng = np.random.default_rng(4)
    parts = [sweep(rng, speed, sign) for speed in SPEEDS_DEG_S for sign in (1, -1)]
    return fit_axis(parts, spring=False)


@pytest.fixture(scope="module")
def holds():
    rng = np.random.default_rng(5)
    parts = []
    for angle in np.linspace(0.6, 2.2, 7):
        for side in (1, -1):
            load = np.polyval(SPRING[::-1], angle) + side * 2.5 + 0.02 * rng.standard_normal(20)
            parts.append(SteadyPart("1", 0, np.full(20, angle), np.zeros(20), load, side))
    return fit_holds(parts)


@pytest.fixture(scope="module")
def robot():
    zero, ball = np.zeros(3), 0.02 * np.eye(3)
    parts = (
        Segment("base", None, zero),
        Segment(
            "column", "base", zero, (Hinge("horizontal", np.array([0, 0, 1.0])),), 1, zero, ball
        ),
        Segment(
            "upper_arm",
            "column",
            zero,
            (Hinge("elevation", np.array([0, -1.0, 0])),),
            1,
            zero,
            ball,
        ),
        Segment(
            "forearm",
            "upper_arm",
            np.array([0, 0, -0.3]),
            (Hinge("elbow", np.array([0, -1.0, 0])),),
        ),
    )
    p = parameter_count(3)
    return TherapyRobot(
        name="bench",
        axes=(*AXES, "elbow"),
        skeleton=Skeleton(parts, floating=False),
        limits_rad=np.array([[0.0, 2.5], [-0.5, 2.0], [0.0, 2.0]]),
        torque_limit_Nm=np.full(3, 60.0),
        motor_inertia_kgm2=np.zeros(3),
        loads=Loads(np.zeros(p), np.zeros((p, p)), np.full(3, 1e-3)),
    )


def elastic(axis, **changes):
    given = {
        "axis": axis,
        "stiffness": 4.0,
        "offset": -1.0,
        "covariance": 4e-3 * np.eye(2),
        "dof": 4.0,
        "range_rad": np.array([0.0, 2.0]),
        "between": 1e-3 * np.eye(2),
        "noise_density": 1e-4,
        "mass_gradient": np.zeros(2),
        "robot_gradient": np.zeros((2, parameter_count(3))),
        "verdict": "k_s identified; q_0 identified",
    }
    return Elastic(**{**given, **changes})


@pytest.fixture(scope="module")
def arm():
    return PassiveArm("A", "bench", 0.3, (), (elastic("elevation"), elastic("horizontal")))


def movement(condition, name="elevation", *, trial="1", share=None, weight=8.0):
    """A steady share of what the passive arm needs, at constant speed."""
    n = 2001
    time, q = np.arange(n) / 1000, np.linspace(0.8, 1.9, n)
    own = SHARES[condition] if share is None else share
    stiff, rigid = 4.0 * q - 1.0, np.full(n, weight)
    return MovementTorques(
        trial=trial,
        condition=condition,
        movement=name,
        axis=AXES.index(name),
        axis_name=name,
        sample_rate_hz=1000.0,
        time_s=time,
        q=q,
        qd=np.full(n, 0.55),
        motor=(1 - own) * (stiff + rigid),
        robot=np.zeros(n),
        rigid_arm=rigid,
        elastic=stiff,
        robot_inertia=np.zeros(n),
        robot_gradient=np.zeros((n, parameter_count(3))),
    )


def session():
    return [
        movement(condition, name, trial=str(i))
        for condition in ("resistive", "passive", "active")
        for name in AXES
        for i in range(3)
    ]


def marked(ax, marker):
    """All points of one marker: places (N, 2) and whether they are filled."""
    lines = [line for line in ax.lines if line.get_marker() == marker]
    points = np.concatenate([np.column_stack(line.get_data()) for line in lines])
    filled = np.concatenate(
        [np.full(len(line.get_xdata()), line.get_markerfacecolor() != "none") for line in lines]
    )
    return points, filled


# The robot


def test_friction_of_both_directions_lies_on_one_course_and_unused_speeds_are_hollow(sweeps):
    ax = plot_friction(sweeps)
    for marker, torque in (
        ("^", [p.up_Nm for p in sweeps.points]),
        ("v", [-p.down_Nm for p in sweeps.points]),
    ):
        points, filled = marked(ax, marker)
        order = np.argsort(points[:, 0])
        np.testing.assert_allclose(points[order, 0], SPEEDS_DEG_S, rtol=1e-6)
        np.testing.assert_allclose(points[order, 1], torque)
        assert filled[order].tolist() == [p.used for p in sweeps.points]
        assert not filled.all()
    law = next(line for line in ax.lines if line.get_label() == "law")
    speed, torque = law.get_data()
    assert speed.min() == pytest.approx(np.rad2deg(sweeps.lowest_used_rad_s))
    np.testing.assert_allclose(torque, COULOMB + VISCOUS * np.deg2rad(speed), atol=0.02)


def test_the_static_range_is_shaded_up_to_the_lowest_speed_used(sweeps):
    (shade,) = plot_friction(sweeps).patches
    right = float(shade.get_extents().transformed(shade.axes.transData.inverted()).x1)
    assert np.rad2deg(sweeps.static_range_rad_s) < right <= np.rad2deg(sweeps.lowest_used_rad_s)


def test_a_law_that_holds_at_all_speeds_has_no_static_range():
    rng = np.random.default_rng(1)
    parts = [sweep(rng, speed, sign) for speed in SPEEDS_DEG_S[2:] for sign in (1, -1)]
    found = fit_axis(parts, spring=False)
    assert found.static_range_rad_s == 0
    assert not plot_friction(found).patches


def test_the_spring_lies_between_both_ways_of_holding(holds):
    ax = plot_spring(holds)
    below, above = marked(ax, "^")[0], marked(ax, "v")[0]
    assert (below[:, 1] - above[:, 1]).mean() == pytest.approx(5.0, abs=0.1)
    angle, law = next(line for line in ax.lines if line.get_label() == "polynomial").get_data()
    np.testing.assert_allclose(law, np.polyval(SPRING[::-1], np.deg2rad(angle)), atol=0.05)


def test_a_robot_has_a_panel_per_axis_and_one_for_its_spring(sweeps, holds, robot):
    both = (replace(sweeps, axis=0), sweeps)
    calibration = SimpleNamespace(robot=robot, axes=both, spring=holds)
    figure = plot_robot_calibration(calibration)
    titles = [ax.get_title(loc="left") for ax in figure.axes]
    assert titles == ["axis 1, elevation", "axis 2, horizontal", "spring of axis 1"]
    figure.draw_without_rendering()


# The passive arm


def calibrated(*axes):
    movements = tuple(m for m in session() if m.condition == "passive")
    rows = []
    for i, one in enumerate(axes):
        stiffness = NamedParameter("k_s", 4.0, 0.1, 0.1, "N m/rad", 10.0, i + 1)
        rest = NamedParameter("q_0", np.nan, np.nan, np.nan, "rad", joint=i + 1)
        rows.append(SimpleNamespace(axis=i, elastic=one, stiffness=stiffness, rest=rest))
    return SimpleNamespace(axes=tuple(rows), movements=movements)


def test_passive_repetitions_model_and_verdict_of_every_axis():
    verdict = "refused: the passive repetitions are too different"
    refused = elastic("horizontal", verdict=verdict, repeatable=False)
    calibration = calibrated(elastic("elevation"), refused)
    figure = plot_passive_arm(calibration)
    for i, (ax, model) in enumerate(zip(figure.axes, ("model", "refused model"), strict=True)):
        of_axis = [m for m in calibration.movements if m.axis == i]
        lines = {line.get_label(): line for line in ax.lines}
        for number, m in enumerate(of_axis, start=1):
            drawn = lines[f"repetition {number}"].get_ydata()
            inside = m.q <= calibration.axes[i].elastic.range_rad[1]
            np.testing.assert_array_equal(drawn, m.support[inside])
        np.testing.assert_array_equal(lines[model].get_ydata(), of_axis[0].arm)
        title = ax.get_title(loc="left")
        assert calibration.axes[i].elastic.verdict in title
        assert "k_s 4.00 ± 0.22 N m/rad, q_0 unknown" in title


def test_ends_at_which_the_gears_may_stick_are_not_drawn():
    narrow = elastic("elevation", range_rad=np.array([1.0, 1.7]))
    (ax,) = plot_passive_arm(calibrated(narrow)).axes
    angle = next(line for line in ax.lines if line.get_label() == "repetition 1").get_xdata()
    assert np.rad2deg(1.0) <= angle.min() < np.rad2deg(1.01)
    assert np.rad2deg(1.69) < angle.max() <= np.rad2deg(1.7)


# The contribution


@pytest.mark.parametrize(("condition", "share"), SHARES.items())
def test_a_steady_share_is_a_level_line_and_stands_in_the_title(condition, share, robot, arm):
    ax = plot_contribution(movement(condition), robot, arm)
    told = np.asarray(ax.lines[0].get_ydata())
    np.testing.assert_allclose(told[~np.isnan(told)], 100 * share, atol=1e-6)
    assert not np.isnan(told[-1])
    assert f": {100 * share + 0.0:.0f} ± " in ax.get_title(loc="left")
    low, high = ax.get_ylim()
    assert low < min(0.0, 100 * share)
    assert high > 100


def test_the_line_begins_once_it_can_be_told_and_ends_at_the_dot(robot, arm):
    """A person who also accelerates the robot, which does not stand beside the arm at the onset."""
    m = movement("active")
    inertia = 9.0 * np.cos(np.linspace(0, np.pi, len(m.q)))
    free = replace(m, robot_inertia=inertia, motor=0.4 * m.arm - 0.8 * inertia)
    ax = plot_contribution(free, robot, arm)
    told = np.asarray(ax.lines[0].get_ydata())
    assert np.isnan(told[:100]).all()
    first = np.flatnonzero(~np.isnan(told))[0]
    assert not np.isnan(told[first:]).any()
    np.testing.assert_allclose(told[first:], 60.0, atol=1e-6)
    (dot,) = ax.containers
    assert dot.lines[0].get_ydata()[0] == pytest.approx(told[-1])
    assert dot.get_label() == "share"


def like_the_robot(condition, *, share):
    """An arm whose torque has the course of the robot's own inertia torque."""
    m = movement(condition)
    course = 10.0 * np.cos(np.linspace(0, np.pi, len(m.q)))
    alike = replace(m, rigid_arm=course - m.elastic, robot_inertia=0.3 * course)
    return replace(alike, motor=(1 - share) * course)


def test_where_arm_and_robot_cannot_be_told_apart_the_projection_stands_and_says_so(robot, arm):
    figure = plot_feedback([like_the_robot("active", share=0.4)], robot, arm)
    (ax,) = figure.axes
    (dot,) = ax.containers
    assert dot.lines[0].get_ydata()[0] == pytest.approx(40, abs=1e-6)
    assert dot.lines[0].get_markerfacecolor() == "white"
    assert ": 40p ± " in ax.get_title(loc="left")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["repetition 1", "p: projection"]
    alone = plot_contribution(like_the_robot("active", share=0.4), robot, arm)
    assert alone.get_title(loc="left").endswith("% (projection)")


@pytest.mark.parametrize("alike", [False, True])
def test_what_neither_can_tell_is_grey_and_says_so(robot, arm, alike):
    """An arm that needs next to nothing; also where the share has no number at all."""
    m = movement("active")
    needed = 0.01 * np.cos(np.linspace(0, np.pi, len(m.q)))
    inertia = 30 * needed if alike else m.robot_inertia
    light = replace(m, rigid_arm=needed - m.elastic, motor=0.4 * needed, robot_inertia=inertia)
    figure = plot_feedback([light], robot, arm)
    (ax,) = figure.axes
    assert ax.get_title(loc="left").endswith("cannot be told")
    assert np.isnan(np.asarray(ax.lines[0].get_ydata())).all()
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["repetition 1", "cannot be told"]


def test_a_session_is_a_row_a_condition_and_a_column_a_movement(robot, arm):
    figure = plot_feedback(session(), robot, arm)
    titles = [ax.get_title(loc="left").partition(":")[0] for ax in figure.axes]
    wanted = [f"{name}, {c}" for c in ("passive", "active", "resistive") for name in AXES]
    assert titles == wanted
    assert all(len(ax.containers) == 3 for ax in figure.axes)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["repetition 1", "repetition 2", "repetition 3"]


def test_whole_movements_stand_right_of_their_course(robot, arm):
    figure = plot_feedback([movement("active", trial=str(i)) for i in range(4)], robot, arm)
    (ax,) = figure.axes
    places = [container.lines[0].get_xdata()[0] for container in ax.containers]
    values = [container.lines[0].get_ydata()[0] for container in ax.containers]
    assert np.all(np.diff(places) > 0)
    assert min(places) > 2.0
    assert max(places) < ax.get_xlim()[1]
    np.testing.assert_allclose(values, 60.0, atol=1e-6)


def test_a_condition_without_a_movement_leaves_its_place_empty(robot, arm):
    given = [movement("passive"), movement("passive", "horizontal"), movement("active")]
    figure = plot_feedback(given, robot, arm)
    assert [ax.axison for ax in figure.axes] == [True, True, True, False]


def test_a_refused_axis_says_why_and_can_be_insisted_on(robot, arm):
    verdict = "refused: the passive repetitions are too different"
    bad = elastic(
        "horizontal",
        verdict=verdict,
        repeatable=False,
        stiffness_identified=False,
        rest_identified=False,
    )
    other = replace(arm, elastic=(elastic("elevation"), bad))
    given = [movement("active"), movement("active", "horizontal")]
    kept, refused = plot_feedback(given, robot, other).axes
    assert len(kept.containers) == 1
    assert not refused.containers
    assert "too different" in " ".join(refused.texts[0].get_text().split())
    with pytest.raises(InputError, match="too different"):
        plot_contribution(given[1], robot, other)
    insisted = plot_feedback(given, robot, other, unrepeatable=True)
    assert all(len(ax.containers) == 1 for ax in insisted.axes)


def test_no_movements_are_refused(robot, arm):
    with pytest.raises(InputError, match="no movements"):
        plot_feedback([], robot, arm)


def test_axes_that_are_given_are_drawn_into(sweeps, holds, robot, arm):
    for draw in (
        lambda ax: plot_friction(sweeps, ax),
        lambda ax: plot_spring(holds, ax),
        lambda ax: plot_contribution(movement("active"), robot, arm, ax),
    ):
        ax = new_axes()
        assert draw(ax) is ax


def test_no_text_leaves_the_session_s_figure(robot, arm):
    figure = plot_feedback(session(), robot, arm)
    figure.draw_without_rendering()
    for ax in figure.axes:
        for text in [*ax.texts, *ax.get_xticklabels()]:
            box = text.get_window_extent()
            assert box.x0 >= -1
            assert box.x1 <= figure.bbox.x1 + 1
