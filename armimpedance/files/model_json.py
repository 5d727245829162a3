"""MODEL.json: a fitted model of joint impedance, written and read back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from armimpedance.errors import InputError
from armimpedance.files.fit_json import write_json
from armimpedance.json_text import read_json
from armimpedance.muscles import MODEL_KINDS, FittedModel, kind_of

FORMAT: Final = "armimpedance-model"
VERSION: Final = 1


def write_model(model: FittedModel, path: str | Path) -> None:
    """Write the fit's summary (the fields of FIT.json), its quality, and the model itself.

    Parameters
    ----------
    model : FittedModel
    path : path
    """
    content = {
        "format": FORMAT,
        "version": VERSION,
        "kind": kind_of(model).name,
        **model.to_dict(),
        "model": model.as_plain(),
    }
    write_json(content, path)


def read_model(path: str | Path) -> FittedModel:
    """The model of a file that `write_model` wrote.

    Parameters
    ----------
    path : path

    Returns
    -------
    FittedModel
        Of the class of its kind.

    Raises
    ------
    InputError
        The file cannot be read, or holds no model of this version.
    """
    content = _content(Path(path))
    kind = content.get("kind")
    if kind not in MODEL_KINDS:
        known = " or ".join(MODEL_KINDS)
        raise InputError(f"kind {kind!r}", file=path, column="kind", expected=known)
    plain = content.get("model")
    if not isinstance(plain, Mapping):
        raise InputError("no model", file=path, column="model", expected="an object")
    try:
        return MODEL_KINDS[kind].type.from_plain(plain)
    except InputError as error:
        raise InputError(
            error.problem, file=path, column=error.column, expected=error.expected
        ) from error


def _content(path: Path) -> Mapping[str, Any]:
    what = "a MODEL.json of armimpedance fit"
    content = read_json(path, what)
    if content.get("format") != FORMAT:
        raise InputError("not a model", file=path, column="format", expected=f"{what}: {FORMAT}")
    if content.get("version") != VERSION:
        raise InputError(
            f"version {content.get('version')!r}",
            file=path,
            column="version",
            expected=f"{VERSION}",
        )
    return content
