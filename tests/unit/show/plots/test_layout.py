"""A figure is laid out once, and shows the same places in every format."""

import pytest
from matplotlib.layout_engine import ConstrainedLayoutEngine

from armimpedance.show.plots.style import new_axes, new_figure, print_style, save, settled

FORMATS = ("png", "svg", "pdf")


class Counting(ConstrainedLayoutEngine):
    """Matplotlib's own, which counts."""

    times = 0

    def execute(self, fig):
        self.times += 1
        return super().execute(fig)


def drawn():
    """Two panels, tick labels of different widths, a word beside them, and a legend above."""
    with print_style():
        figure = new_figure(5.0, 2.5)
        for ax, reach in zip(figure.subplots(1, 2), (1.0, 12345.678), strict=True):
            ax.plot([0, 1], [0, reach], label="line")
            ax.set(xlabel="x (m)", ylabel="y (N)", title="a title")
        figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center")
    return figure


def test_a_figure_is_laid_out_once_for_all_formats(tmp_path):
    figure = drawn()
    engine = Counting()
    figure.set_layout_engine(engine)
    save(figure, tmp_path / "a", FORMATS)
    assert engine.times == 1


def test_a_file_does_not_depend_on_the_others(tmp_path):
    together = save(drawn(), tmp_path / "together", FORMATS)
    for name, beside in zip(FORMATS, together, strict=True):
        (alone,) = save(drawn(), tmp_path / "alone", [name])
        assert alone.read_bytes() == beside.read_bytes(), name


def test_the_axes_stand_where_matplotlib_would_put_them_on_paper():
    ours, plain = drawn(), drawn()
    with print_style():
        plain.set_dpi(300)
        plain.draw_without_rendering()
    with print_style(), settled(ours, 300):
        for a, b in zip(ours.axes, plain.axes, strict=True):
            assert a.get_position().bounds == pytest.approx(b.get_position().bounds, abs=1e-8)


@pytest.mark.study
def test_saving_leaves_the_figure_as_it_was_and_saves_the_same_again(tmp_path):
    figure = drawn()
    before = (figure.get_layout_engine(), figure.canvas, figure.dpi, *figure.get_size_inches())
    first = [path.read_bytes() for path in save(figure, tmp_path / "a", FORMATS)]
    after = (figure.get_layout_engine(), figure.canvas, figure.dpi, *figure.get_size_inches())
    assert after == before
    assert [path.read_bytes() for path in save(figure, tmp_path / "a", FORMATS)] == first


def test_axes_placed_by_hand_stay_there(tmp_path):
    figure = drawn()
    inset = figure.add_axes((0.1, 0.2, 0.3, 1 / 3))
    inset.set_in_layout(False)
    save(figure, tmp_path / "a", ["png"])
    assert inset.get_position().bounds == pytest.approx((0.1, 0.2, 0.3, 1 / 3), abs=1e-15)
    assert not inset.get_in_layout()


@pytest.mark.study
def test_a_window_that_shows_the_figure_keeps_its_size(tmp_path):
    class Window:
        def resize(self, width, height):
            raise AssertionError(f"resized to {width} x {height}")

    figure = new_axes().figure
    figure.canvas.manager = Window()
    assert save(figure, tmp_path / "a", FORMATS)


def test_figures_without_a_layout_or_without_axes_are_saved(tmp_path):
    figure = drawn()
    figure.set_layout_engine("none")
    assert save(figure, tmp_path / "a", FORMATS)
    assert save(new_figure(), tmp_path / "b", FORMATS)
