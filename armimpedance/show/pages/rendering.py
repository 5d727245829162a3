"""A page as one HTML file that asks nobody for anything.

Every text of a file is text: Jinja2 escapes what goes into the markup, and the page's script sets
texts only. Data stand once, as columns, and the script makes the rows of pictures and CSV of them.
"""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from markupsafe import Markup

from armimpedance.core.findings import MARKS
from armimpedance.core.outputs import staged_file
from armimpedance.show.pages.page import STATES, Folds, Heat, Linked, Page, Picture

if TYPE_CHECKING:
    import pandas as pd
    from jinja2 import Environment

#: Significant digits of the page's data; the files of results hold all of them.
DIGITS: Final = 7
#: Columns of more numbers than this are coded: 32767 steps to each side of zero.
LONG: Final = 2000
INT16: Final = 32767
#: The library that draws a page's linked pictures, in the order in which its parts are read.
VEGA: Final = ("vega/vega.min.js", "vega/vega-lite.min.js", "vega/vega-embed.min.js")
#: What the browser may do with the page: run what stands in it, and ask nobody.
POLICY: Final = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:"
)


def write_page(page: Page, path: str | Path) -> None:
    """Write the page as one HTML file, whole or not at all.

    Parameters
    ----------
    page : Page
    path : path
        The file; its name ends in .html.
    """
    _write(html_of(page), path)


def html_of(page: Page) -> str:
    """The page as HTML."""
    linked = [block for block in page.blocks if isinstance(block, Linked)]
    pictures = [block for block in page.blocks if isinstance(block, Picture)]
    drawn = {block.name: block.drawn for block in pictures if block.drawn is not None}
    word, mark = STATES[page.verdict.state]
    many = any(isinstance(block, Heat | Folds) for block in page.blocks)
    heat = any(isinstance(block, Heat) for block in page.blocks)
    return _rendered(
        "page.html.jinja",
        ("shared.js", "page.js", *(["many.js"] if heat else [])),
        {**page.data, **drawn},
        more_style=Markup(_asset("many.css") if many else ""),  # noqa: S704 - our own file
        page=page,
        word=word,
        mark=mark,
        marks=MARKS,
        library=_library() if linked else "",
        specs=_json({block.name: block.spec for block in linked}),
    )


def write_html(
    path: str | Path,
    template: str,
    scripts: Sequence[str],
    data: Mapping[str, pd.DataFrame],
    more: Mapping[str, Any],
    title: str,
) -> None:
    """Write a page of a template of its own, whole or not at all.

    Parameters
    ----------
    path : path
    template : str
        Its name among the assets.
    scripts : sequence of str
        The names of its scripts, in the order in which they run.
    data : mapping from a name to a DataFrame
    more : mapping
        Plain values that its script reads.
    title : str
    """
    _write(_rendered(template, scripts, data, title=title, more=_json(dict(more))), path)


def _rendered(
    template: str, scripts: Sequence[str], data: Mapping[str, pd.DataFrame], **texts: Any
) -> str:
    script = "".join(_asset(name) for name in scripts)
    page: str = (
        _environment()
        .get_template(template)
        .render(
            policy=POLICY,
            style=Markup(_asset("page.css")),  # noqa: S704 - our own file
            script=Markup(script),  # noqa: S704 - our own files
            data=_json({name: columns_of(frame) for name, frame in data.items()}),
            **texts,
        )
    )
    return page


def _write(text: str, path: str | Path) -> None:
    with staged_file(path) as staged:
        staged.write_text(text, encoding="utf-8")


def columns_of(frame: pd.DataFrame) -> dict[str, Any]:
    """Each column as a list: numbers rounded, null where there is none, all else as text.

    Returns: a column of texts that come again stands as its different texts, ``{"texts": [...]}``,
    and the number of the text of each row, ``"of": [...]``. A long column of numbers stands as
    16-bit integers in base 64, ``{"int16": "..."}``, and what one of them is worth, ``"step"``: it
    is drawn, not read.
    """
    return {str(name): _column(frame[name].to_numpy()) for name in frame.columns}


def _column(values: np.ndarray) -> Any:
    drawn = len(values) > LONG and values.dtype.kind in "if" and bool(np.isfinite(values).all())
    if not drawn:
        return _coded(_plain(values))
    largest = float(np.abs(values).max())
    whole = values.dtype.kind == "i" and largest <= INT16
    step = 1.0 if whole or not largest else largest / INT16
    coded = np.round(values / step).astype("<i2").tobytes()
    return {"int16": b64encode(coded).decode("ascii"), "step": step}


def _coded(values: list[Any]) -> Any:
    texts = list(dict.fromkeys(values))
    if 2 * len(texts) > len(values) or not all(isinstance(text, str) for text in texts):
        return values
    number = {text: i for i, text in enumerate(texts)}
    return {"texts": texts, "of": [number[value] for value in values]}


def _plain(values: np.ndarray) -> list[Any]:
    if values.dtype.kind in "iub":
        return values.tolist()
    if values.dtype.kind == "f":
        return [float(f"{v:.{DIGITS}g}") if np.isfinite(v) else None for v in values.tolist()]
    return [_scalar(value) for value in values.tolist()]


def _scalar(value: Any) -> Any:
    """A number, a text, or null for what is neither, such as a missing value."""
    if value is None or value != value or value in (float("inf"), float("-inf")):
        return None
    return value if isinstance(value, int | float) else str(value)


def _json(content: Any) -> Markup:
    """JSON that can stand inside a script element, whatever its texts hold."""
    text = json.dumps(content, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(text)  # noqa: S704 - escaped in the lines above


def _asset(name: str) -> str:
    return files("armimpedance.show.pages").joinpath("assets", name).read_text(encoding="utf-8")


@cache
def _library() -> Markup:
    """Vega and Vega-Lite as one script, so that the page needs no network.

    The files are those of their packages, `vega/LICENSES.txt` names them; their last lines, which
    name maps for a debugger, are left out: the page asks for nothing.
    """
    lines = "\n".join(map(_asset, VEGA)).splitlines()
    script = "\n".join(line for line in lines if not line.startswith("//# sourceMappingURL"))
    return Markup(script.replace("</script", "<\\/script"))  # noqa: S704 - a library's own code


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("armimpedance.show.pages", "assets"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["base64"] = lambda text: b64encode(text.encode("utf-8")).decode("ascii")
    return environment
