"""Pictures of 1 to 40 groups: no word lies on another, on an axis, or outside the picture."""

import numpy as np
import pytest
from matplotlib.text import Text

from armimpedance.hand.comparison.groups import ComparedGroup
from armimpedance.hand.comparison.show.plot import plot_comparison
from armimpedance.hand.show import plot_ellipses, plot_intervals
from armimpedance.hand.still.show import plot_estimates
from armimpedance.show.plots import MOST_LOOKS, OKABE_ITO, look
from armimpedance.show.plots.style import new_axes, print_style

COUNTS = (1, 3, 8, 26, 40)
LAYOUTS = ("column", "row", "cluster", "place")
#: Of print, in inches.
WIDTHS = (8.5 / 2.54, 17.5 / 2.54)


def places(count, layout):
    """Where the hands of an experiment were, (n, 2) m."""
    n = np.arange(count)
    if layout == "column":
        return np.column_stack([0 * n, 0.3 + 0.12 * n * min(1, 3 / count)])
    if layout == "row":
        return np.column_stack([-0.2 + 0.1 * n * min(1, 5 / count), 0 * n + 0.4])
    if layout == "place":
        return np.tile([0.0, 0.4], (count, 1))
    side = int(np.ceil(np.sqrt(count)))
    spread = np.random.default_rng(3).normal(0, 0.004, (count, 2))
    return (
        np.column_stack([-0.2 + 0.4 * (n % side) / side, 0.3 + 0.3 * (n // side) / side]) + spread
    )


def groups(make_estimate, count, layout):
    """Ellipses that differ in size and direction, with names as long as people make them."""
    random = np.random.default_rng(1)
    for number, (x, y) in enumerate(places(count, layout)):
        turn = random.normal(0.6, 0.4)
        c, s = np.cos(turn), np.sin(turn)
        axes = np.array([[c, -s], [s, c]])
        K = axes @ np.diag(random.uniform([150, 60], [400, 150])) @ axes.T
        name = ("near", "mid", "far")[number] if count <= 3 else f"posture {number + 1} loaded"
        yield make_estimate(x, y, stiffness=K, keys={"condition": name}, joint_angles=None)


def words(figure):
    """Every word that is seen, with its box (left, bottom, right, top), and whether of a tick."""
    with print_style():
        figure.draw_without_rendering()
    renderer = figure.canvas.get_renderer()
    found, ticks, shown = [], set(), set()
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            every = axis.get_major_ticks() + axis.get_minor_ticks()
            ticks |= {label for tick in every for label in (tick.label1, tick.label2)}
            low, high = sorted(axis.get_view_interval())
            margin = 1e-9 * (high - low)
            shown |= {
                tick.label1 for tick in every if low - margin <= tick.get_loc() <= high + margin
            }
    for text in figure.findobj(Text):
        seen = text.get_visible() and text.get_text().strip()
        if seen and (text not in ticks or text in shown):
            found.append((text.get_text(), text.get_window_extent(renderer).extents, text in ticks))
    return found


def common(one, other):
    return min(one[2:] - other[:2]), min(other[2:] - one[:2])


def check(figure):
    """No two words share more than a pixel, none leaves the picture, none crosses an axis."""
    found = words(figure)
    width, height = figure.bbox.size
    for i, (text, box, tick) in enumerate(found):
        assert box[0] > -1, text
        assert box[1] > -1, text
        assert box[2] < width + 1, text
        assert box[3] < height + 1, text
        for other, second, _ in found[:i]:
            assert min(common(box, second)) < 1, f"{text!r} lies on {other!r}"
        for ax in figure.axes:
            spines = [
                ax.spines[side] for side in ("left", "bottom") if ax.spines[side].get_visible()
            ]
            for spine in spines if not tick else []:
                line = spine.get_window_extent().extents
                assert min(common(box, line)) < 1, f"{text!r} crosses an axis"


def cases():
    """Each layout with one count; all others are studies."""
    for i, layout in enumerate(LAYOUTS):
        for count in COUNTS:
            usual = count == COUNTS[i + 1] or (layout, count) == ("column", 1)
            yield pytest.param(layout, count, marks=[] if usual else [pytest.mark.study])


@pytest.mark.first_cases(3)
@pytest.mark.parametrize(("layout", "count"), list(cases()))
def test_ellipses_compared_groups_and_estimates(layout, count, make_estimate):
    estimates = list(groups(make_estimate, count, layout))
    for width in WIDTHS:
        check(plot_ellipses(estimates, ax=new_axes(width, min(width, 4.7))).figure)
    compared = [ComparedGroup(str(e.keys["condition"]), e) for e in estimates]
    check(plot_comparison(compared).figure)
    check(plot_estimates(estimates))
    if layout == "column":
        check(plot_intervals(estimates).figure)


def test_ten_groups_are_told_apart_and_in_grey_too():
    looks = [look(number) for number in range(MOST_LOOKS)]
    assert len({(one["color"], str(one["linestyle"])) for one in looks}) == MOST_LOOKS
    for i, one in enumerate(looks):
        for other in looks[:i]:
            if one["linestyle"] == other["linestyle"]:
                assert abs(lightness(one["color"]) - lightness(other["color"])) > 10
    assert {one["color"] for one in looks} <= set(OKABE_ITO.values())


def lightness(color):
    """CIE 1976 L* of an sRGB colour, as IEC 61966-2-1 has it."""
    part = np.array([int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return 116 * np.cbrt(linear @ [0.2126, 0.7152, 0.0722]) - 16


def xy(line):
    return line.get_xydata()


def test_names_stand_beside_their_own_ellipses(make_estimate):
    estimates = list(groups(make_estimate, 3, "column"))
    ax = plot_ellipses(estimates)
    found = {text: box for text, box, _ in words(ax.figure)}
    outlines = [ax.transData.transform(x) for x in map(xy, ax.lines) if len(x) > 50]
    for number, name in enumerate(("near", "mid", "far")):
        low, high = found[name][:2], found[name][2:]
        # from the box of the word to the nearest point of each outline
        apart = [np.hypot(*np.maximum(np.maximum(low - o, o - high), 0).T).min() for o in outlines]
        assert int(np.argmin(apart)) == number


def test_a_scale_is_the_same_in_two_panels(make_estimate):
    estimates = list(groups(make_estimate, 3, "row"))
    sizes = []
    for chosen in (estimates, estimates[:1]):
        ax = plot_ellipses(chosen, scale=1e-4, labels=["a", "b", "c"][: len(chosen)])
        sizes.append(np.ptp(ax.lines[0].get_xydata(), axis=0))
    np.testing.assert_allclose(*sizes, rtol=1e-12)


def test_colours_of_ones_own(make_estimate):
    estimates = list(groups(make_estimate, 3, "row"))
    ax = plot_ellipses(estimates, colors=["red", "green", "black"], show_confidence=False)
    outlines = [line for line in ax.lines if len(line.get_xdata()) > 50]
    assert [line.get_color() for line in outlines] == ["red", "green", "black"]


def test_a_band_thinner_than_its_line_is_said(make_estimate):
    exact = make_estimate(covariance=np.eye(12) * 1e-8)
    for estimate, said in ((exact, True), (make_estimate(), False)):
        ax = plot_ellipses([estimate, make_estimate(0.3, 0.5, covariance=estimate.covariance)])
        text = ax.get_legend().get_texts()[-1].get_text()
        assert ("within" in text) == said


def test_the_arm_is_drawn_once_from_its_angles(make_estimate):
    upper, fore, angles = 0.31, 0.34, np.array([0.9, 1.3])
    turned = np.cumsum(angles)
    elbow = upper * np.array([np.cos(turned[0]), np.sin(turned[0])])
    hand = elbow + fore * np.array([np.cos(turned[1]), np.sin(turned[1])])
    one = make_estimate(*hand, joint_angles=angles)
    ax = plot_ellipses([one, make_estimate(0.3, 0.5, joint_angles=None)])
    arms = [line for line in ax.lines if len(line.get_xdata()) == 3]
    assert len(arms) == 1
    np.testing.assert_allclose(arms[0].get_xydata(), [[0, 0], elbow, hand], atol=1e-12)
