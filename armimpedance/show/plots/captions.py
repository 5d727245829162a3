"""A caption beside the picture, as a journal takes it, or below the drawing where asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from armimpedance.core.outputs import staged_file
from armimpedance.show.plots.style import print_style, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CAPTION_POINTS: Final = 7.5


def save_with_caption(
    figure: Figure,
    path_stem: str | Path,
    formats: Sequence[str],
    caption: str,
    *,
    baked: bool = False,
) -> list[Path]:
    """Write the figure and its caption as ``path_stem.txt`` beside it.

    Parameters
    ----------
    figure : Figure
    path_stem : path
        The path of the files without their ending.
    formats : sequence of {"png", "svg", "pdf"}
    caption : str
        Plain text, one paragraph.
    baked : bool
        Write the caption below the drawing and not beside it.

    Returns
    -------
    list of Path
        The files that were written: the pictures, then the caption.

    Raises
    ------
    InputError
        For a format that is none of png, svg, pdf.
    """
    if baked:
        add_caption(figure, caption)
        return save(figure, path_stem, formats)
    written = save(figure, path_stem, formats)
    beside = Path(f"{path_stem}.txt")
    with staged_file(beside) as staged:
        staged.write_text(f"{caption}\n", encoding="utf-8")
    return [*written, beside]


def add_caption(figure: Figure, caption: str) -> None:
    """Grow the figure at its foot and write the caption there."""
    width, height = figure.get_size_inches()
    lines = _lines(caption, 0.98 * 72 * width)
    foot = (len(lines) + 1.6) * 1.3 * CAPTION_POINTS / 72
    with print_style():
        figure.set_size_inches(width, height + foot)
        engine = figure.get_layout_engine()
        if engine is not None:
            engine.set(rect=(0, foot / (height + foot), 1, height / (height + foot)))  # type: ignore[call-arg]
        figure.text(
            0.01,
            foot / (height + foot) * 0.93,
            "\n".join(lines),
            fontsize=CAPTION_POINTS,
            va="top",
            linespacing=1.3,
        )


def _lines(text: str, width_pt: float) -> list[str]:
    """The text broken where a line would be wider, measured letter by letter."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    measure, font = TextToPath(), FontProperties(family="DejaVu Sans", size=CAPTION_POINTS)
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        wide, _, _ = measure.get_text_width_height_descent(longer, font, ismath=False)
        if lines[-1] and wide > width_pt:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


# Letters that a caption refers to.


def panel_letters(axes: Sequence[Axes]) -> None:
    """(a), (b), ... in bold above the left upper corner of each panel.

    Parameters
    ----------
    axes : sequence of Axes
        In the order of the letters.
    """
    for number, ax in enumerate(axes):
        ax.annotate(
            f"({chr(ord('a') + number)})",
            (0.0, 1.0),
            (-2.0, 3.0),
            xycoords="axes fraction",
            textcoords="offset points",
            fontweight="bold",
            ha="right",
            va="bottom",
            annotation_clip=False,
        )
