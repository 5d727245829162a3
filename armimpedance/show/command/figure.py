"""The option ``--figure``: drawn for print or a talk, the caption beside it or below."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any


def draw_picture(
    arguments: argparse.Namespace,
    draw: Callable[[], Any],
    caption: str,
    suffix: str = "",
) -> None:
    """Draw and write what ``--figure`` asks for, if it does, and say where.

    Parameters
    ----------
    arguments : Namespace
        With the options of `outputs.add_figure`.
    draw : function
        Gives a figure or axes; called only where a figure is asked for.
    caption : str
    suffix : str
        Added to the name, where a command draws more than one picture.
    """
    if arguments.figure is None:
        return
    from armimpedance.show.plots import drawn_for, save_with_caption

    path = arguments.figure.with_name(f"{arguments.figure.stem}{suffix}{arguments.figure.suffix}")
    with drawn_for(arguments.style):
        drawn = draw()
        figure = drawn if hasattr(drawn, "savefig") else drawn.get_figure(root=True)
        formats, stem = (path.suffix[1:],), path.with_suffix("")
        save_with_caption(figure, stem, formats, caption, baked=arguments.caption)
    print(f"figure written to {path}")
