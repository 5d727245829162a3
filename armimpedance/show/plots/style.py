"""One look for all figures: readable in print, told apart by the colour-blind, the same every time.

Nothing here changes matplotlib's global settings, and no figure is registered with pyplot, so that
none has to be closed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.outputs import staged_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Places of axes that are found once per figure and come out the same, to the bit.

#: Decimals of places in the figure; a hundred-thousandth of a pixel.
_DECIMALS: Final = 9


@contextmanager
def settled(figure: Figure, dpi: float) -> Iterator[None]:
    """Inside the block the axes stay where the layout puts them on paper of this resolution.

    Matplotlib would lay a figure out anew, and draw it twice, for each format. Each format now
    shows the same places, whichever others are written.

    `figure`: left as it is where it has no layout.
    `dpi`: dots per inch at which letters are measured.
    """
    engine = figure.get_layout_engine()
    if engine is None or not figure.axes:
        yield
        return
    before = [(ax, ax.get_position(original=True)) for ax in figure.axes if ax.get_in_layout()]
    # matplotlib, too, leaves the axes where they are where there is no room for them
    with _on_paper(figure, dpi), suppress(ValueError):
        engine.execute(figure)
    for ax, _ in before:
        # The solver leaves last bits that depend on what was drawn before, and an SVG names its
        # clipping boxes after all bits.
        _place(ax, np.round(ax.get_position(original=True).bounds, _DECIMALS))
    # the name "none" would leave an engine that does nothing, and the figure be drawn twice for it
    figure.set_layout_engine(None)
    try:
        yield
    finally:
        figure.set_layout_engine(engine)
        # from where the layout begins depends where it ends, a little
        for ax, place in before:
            _place(ax, place.bounds)


@contextmanager
def _on_paper(figure: Figure, dpi: float) -> Iterator[None]:
    """A canvas of its own: a window that shows the figure must not change its size."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas: Any = figure.canvas
    before = figure.dpi
    FigureCanvasAgg(figure)
    figure.set_dpi(dpi)
    try:
        yield
    finally:
        figure.set_dpi(before)
        figure.set_canvas(canvas)


def _place(ax: Axes, bounds: Sequence[float]) -> None:
    ax.set_position(tuple(bounds))  # type: ignore[arg-type]
    # an axes that is placed by hand leaves the layout
    ax.set_in_layout(True)


#: The palette of M. Okabe and K. Ito, "Color Universal Design" (2008),
#: https://jfly.uni-koeln.de/color/, without its yellow, which is too light for lines on white.
OKABE_ITO: Final = MappingProxyType(
    {
        "black": "#000000",
        "blue": "#0072B2",
        "vermillion": "#D55E00",
        "green": "#009E73",
        "purple": "#CC79A7",
        "orange": "#E69F00",
        "sky": "#56B4E9",
    }
)

#: Told apart without any colour, in the order of Tsuji (1997), Fig. 8: solid, dashed, alternate
#: long and short dashes; dotted is for models.
LINE_STYLES: Final = ("-", (0, (5, 2)), (0, (7, 2, 2, 2)), (0, (3, 1.5)), (0, (7, 2, 2, 2, 2, 2)))
MODEL_LINE_STYLE: Final = (0, (1, 1.5))

#: Width of one and of two columns of print: 8.5 cm and 17.5 cm, in inches.
ONE_COLUMN_IN: Final = 8.5 / 2.54
TWO_COLUMNS_IN: Final = 17.5 / 2.54
#: No letter is smaller in print, points.
LEAST_POINTS: Final = 7.0


@dataclass(frozen=True)
class Style:
    """Scale factors of a figure, its letters and its lines, relative to print."""

    size: float = 1.0
    letters: float = 1.0
    lines: float = 1.0


#: For a slide two columns become as wide as the slide's text, letters some 13 points.
STYLES: Final = MappingProxyType({"print": Style(), "talk": Style(1.45, 1.65, 1.7)})
_STYLE: Final[ContextVar[Style]] = ContextVar("style", default=STYLES["print"])

_SETTINGS: Final[Any] = MappingProxyType(
    {
        "font.family": "sans-serif",
        "font.sans-serif": ["DejaVu Sans"],
        "font.size": 8.0,
        "axes.titlesize": 9.0,
        "axes.labelsize": 8.0,
        "xtick.labelsize": 8.0,
        "ytick.labelsize": 8.0,
        "legend.fontsize": 8.0,
        "legend.frameon": False,
        "axes.linewidth": 0.8,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.formatter.useoffset": False,
        "xtick.major.width": 0.8,
        "ytick.major.width": 0.8,
        # Names of conditions, files and muscles are text; a $ in one is a $.
        "text.parse_math": False,
        "lines.linewidth": 1.2,
        "lines.markersize": 4.0,
        "figure.facecolor": "white",
        "savefig.facecolor": "white",
        "savefig.dpi": 300.0,
        "savefig.bbox": None,
        "pdf.fonttype": 42,
        "svg.fonttype": "path",
        # Element names in the SVG follow from its content and this word, not from chance.
        "svg.hashsalt": "armimpedance",
    }
)

#: What would otherwise carry the time or the version into the file.
_METADATA: Final[Mapping[str, dict[str, Any]]] = MappingProxyType(
    {
        "png": {"Software": None},
        "svg": {"Date": None, "Creator": "armimpedance"},
        "pdf": {"CreationDate": None, "Creator": "armimpedance", "Producer": None},
    }
)


@contextmanager
def print_style() -> Iterator[None]:
    """Matplotlib's settings for print inside the block; outside they are as they were."""
    import matplotlib as mpl

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_SETTINGS)
        style = _STYLE.get()
        for name, value in _SETTINGS.items():
            if name.endswith("size"):
                mpl.rcParams[name] = style.letters * value
            elif name.endswith("width"):
                mpl.rcParams[name] = style.lines * value
        yield


@contextmanager
def drawn_for(style: str) -> Iterator[None]:
    """Figures made inside the block are for print, or for a talk: larger, with larger letters.

    Parameters
    ----------
    style : {"print", "talk"}

    Raises
    ------
    InputError
        No such style.

    Returns
    -------
    context manager
    """
    if style not in STYLES:
        raise InputError(f"no style {style!r}", expected=" or ".join(STYLES))
    token = _STYLE.set(STYLES[style])
    try:
        yield
    finally:
        _STYLE.reset(token)


def new_figure(width_in: float = ONE_COLUMN_IN, height_in: float = ONE_COLUMN_IN) -> Figure:
    """An empty figure of this size in print, without a window.

    Parameters
    ----------
    width_in : float
        The width, inches.
    height_in : float
        The height, inches.

    Returns
    -------
    Figure
        The figure, still without axes.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with print_style():
        size = _STYLE.get().size
        figure = Figure(figsize=(size * width_in, size * height_in), layout="constrained")
        FigureCanvasAgg(figure)
    return figure


def new_axes(width_in: float = ONE_COLUMN_IN, height_in: float = ONE_COLUMN_IN) -> Axes:
    """The only axes of a new figure of this size."""
    with print_style():
        axes: Axes = new_figure(width_in, height_in).add_subplot()
    return axes


def unit_text(unit: str) -> str:
    """A unit as print has it: ``kg m²`` of ``kg m^2``."""
    return unit.replace("^2", "²")


_LOWERED: Final = str.maketrans("0123456789es", "₀₁₂₃₄₅₆₇₈₉ₑₛ")


def element_text(name: str) -> str:
    """An element as print has it: ``K₁₂`` of ``K_12``, ``Kₛₑ`` of ``K_se``."""
    symbol, _, index = name.partition("_")
    if len(symbol) != 1 or not index or index.strip("0123456789es"):
        return name
    return f"{symbol}{index.translate(_LOWERED)}"


def label_axes(ax: Axes, x: str, y: str) -> None:
    """Label both axes, where the caller has not done so already."""
    if not ax.get_xlabel():
        ax.set_xlabel(x)
    if not ax.get_ylabel():
        ax.set_ylabel(y)


def save(
    figure: Figure, path_stem: str | Path, formats: Sequence[str] = ("png", "svg")
) -> list[Path]:
    """Write the figure as ``path_stem.png`` (300 dpi) and ``.svg``, on request as ``.pdf``.

    The same figure gives the same bytes: no time and no version stands in the files. A file is
    written under a temporary name and renamed.

    Parameters
    ----------
    figure : Figure
        The figure to write.
    path_stem : path
        The path of the files without their ending.
    formats : sequence of {"png", "svg", "pdf"}
        The formats, one file each.

    Returns
    -------
    list of Path
        The files that were written, in the order of the formats.

    Raises
    ------
    InputError
        For a format that is none of png, svg, pdf.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import armimpedance as ai
    >>> figure = ai.plot_ellipse([[400.0, 50.0], [50.0, 200.0]]).figure
    >>> with TemporaryDirectory() as folder:
    ...     written = ai.save(figure, Path(folder) / "stiffness")
    >>> [path.name for path in written]
    ['stiffness.png', 'stiffness.svg']
    """
    for name in formats:
        if name not in _METADATA:
            raise InputError(f"unknown figure format {name!r}", expected="png, svg or pdf")
    written = [Path(f"{path_stem}.{name}") for name in formats]
    with print_style(), settled(figure, _SETTINGS["savefig.dpi"]):
        for name, path in zip(formats, written, strict=True):
            with staged_file(path) as staged:
                figure.savefig(staged, format=name, metadata=_METADATA[name])
    return written
