"""Figures are the same every time, and drawing one leaves no trace."""

import pkgutil
import subprocess
import sys

import numpy as np
import pytest

import armimpedance
from armimpedance.core.errors import InputError
from armimpedance.hand.show import plot_ellipses, plot_ellipses_over_levels
from armimpedance.hand.show.intervals_plot import plot_intervals
from armimpedance.hand.still.show.plot import plot_response
from armimpedance.show.plots.style import new_axes, print_style, save


@pytest.mark.study
def test_importing_the_plots_does_not_import_matplotlib():
    """Every module that draws, in the kit and in the topics."""
    found = pkgutil.walk_packages(armimpedance.__path__, "armimpedance.")
    # `room` holds what matplotlib itself draws, and is imported when something is drawn
    names = [m.name for m in found if "plot" in m.name and not m.name.endswith(".plots.room")]
    assert len(names) > 10
    code = f"import {', '.join(names)}, sys; print('matplotlib' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.stdout.strip() == "False", run.stderr


@pytest.mark.study
def test_the_same_input_gives_the_same_bytes(tmp_path, make_estimate):
    def draw(stem):
        ax = plot_ellipses([make_estimate(), make_estimate(0.2)])
        return save(ax.figure, stem, ("png", "svg", "pdf"))

    for a, b in zip(draw(tmp_path / "a"), draw(tmp_path / "b"), strict=True):
        assert a.suffix == b.suffix
        assert a.read_bytes() == b.read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "a.pdf", "a.png", "a.svg", "b.pdf", "b.png", "b.svg",
    ]  # fmt: skip


def test_no_time_stands_in_a_vector_file(tmp_path):
    svg, pdf = save(new_axes().figure, tmp_path / "a", ("svg", "pdf"))
    assert b"dc:date" not in svg.read_bytes()
    assert b"CreationDate" not in pdf.read_bytes()


def test_png_has_300_dots_to_the_inch(tmp_path):
    (png,) = save(new_axes(3.5, 2.0).figure, tmp_path / "a", ["png"])
    width, height = np.frombuffer(png.read_bytes()[16:24], dtype=">u4")
    assert (width, height) == (1050, 600)


def test_a_name_with_a_dot_is_kept_and_other_formats_are_refused(tmp_path):
    (png,) = save(new_axes().figure, tmp_path / "fig.1", ["png"])
    assert png.name == "fig.1.png"
    with pytest.raises(InputError, match="bmp"):
        save(new_axes().figure, tmp_path / "a", ["bmp"])


def test_drawing_leaves_settings_and_open_figures_alone(tmp_path, make_estimate, response):
    import matplotlib as mpl
    from matplotlib import pyplot as plt

    with mpl.rc_context({"lines.linewidth": 7.0, "font.size": 5.0}):
        before, open_before = dict(mpl.rcParams), plt.get_fignums()
        ax = plot_ellipses_over_levels([make_estimate()])
        assert ax.lines[0].get_linewidth() < 2
        save(ax.figure, tmp_path / "a")
        plot_response(response, response.force, 0)
        plot_intervals([make_estimate()])
        assert dict(mpl.rcParams) == before
        assert plt.get_fignums() == open_before


def test_no_text_is_smaller_than_eight_points(make_estimate):
    from matplotlib.text import Text

    ax = plot_ellipses([make_estimate(), make_estimate(0.2)])
    with print_style():
        ax.figure.draw_without_rendering()
    sizes = [t.get_fontsize() for t in ax.figure.findobj(Text) if t.get_text()]
    assert len(sizes) > 5
    assert min(sizes) >= 8


def test_the_legend_and_labels_lie_inside_the_figure(make_estimate):
    ax = plot_ellipses([make_estimate(), make_estimate(0.2)])
    with print_style():
        ax.figure.draw_without_rendering()
    box = ax.get_tightbbox()
    width, height = ax.figure.bbox.size
    assert box.x0 >= 0
    assert box.y0 >= 0
    assert box.x1 <= width
    assert box.y1 <= height
