"""MODEL.json: a fitted model of joint impedance, written and read back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.json_text import finite, read_json
from armimpedance.muscles.models.fitted_model import FittedModel
from armimpedance.muscles.models.kinds import MODEL_KINDS, kind_of
from armimpedance.show.files import write_json

FORMAT: Final = "armimpedance-model"
VERSION: Final = 1
CHECKSUM: Final = "model_sha256"


def write_model(model: FittedModel, path: str | Path) -> None:
    """Write the fit's summary (the fields of FIT.json), its quality, and the model itself.

    Parameters
    ----------
    model : FittedModel
        The fitted model.
    path : path
        MODEL.json.
    """
    plain = finite(model.as_plain())
    content = {
        "format": FORMAT,
        "version": VERSION,
        "kind": kind_of(model).name,
        **model.to_dict(),
        "model": plain,
        CHECKSUM: checksum(plain),
    }
    write_json(content, path)


def read_model(path: str | Path) -> FittedModel:
    """The model of a file that `write_model` wrote.

    Parameters
    ----------
    path : path
        MODEL.json of ``armimpedance fit`` or of `write_model`.

    Returns
    -------
    FittedModel
        Of the class of its kind.

    Raises
    ------
    InputError
        The file cannot be read, or holds no model of this version.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from armimpedance.muscles.models import read_model, write_model
    >>> from armimpedance.muscles.models import JointRows, fit_posture_model
    >>> K = [[[15.0, 6.0], [6.0, 16.0]], [[16.0, 6.0], [6.0, 15.0]]]
    >>> model = fit_posture_model(JointRows([[0.5, 1.2], [1.1, 1.7]], K, K), order=0)
    >>> with TemporaryDirectory() as folder:
    ...     write_model(model, Path(folder) / "model.json")
    ...     again = read_model(Path(folder) / "model.json")
    >>> again.order
    0
    """
    content = _content(Path(path))
    kind = content.get("kind")
    if kind not in MODEL_KINDS:
        kinds = " or ".join(MODEL_KINDS)
        raise InputError(f"kind {kind!r}", file=path, column="kind", expected=kinds)
    plain = content.get("model")
    if not isinstance(plain, Mapping):
        raise InputError("no model", file=path, column="model", expected="an object")
    # Files of earlier versions have none.
    if content.get(CHECKSUM, checksum(plain)) != checksum(plain):
        problem = "the model's numbers are not those that were fitted"
        expected = "the file as `armimpedance fit` wrote it"
        raise InputError(problem, file=path, column=CHECKSUM, expected=expected)
    try:
        return MODEL_KINDS[str(kind)].type.from_plain(plain)
    except InputError as error:
        raise InputError(
            error.problem, file=path, column=error.column, expected=error.expected
        ) from error


def checksum(plain: Any) -> str:
    """A checksum of a model's numbers, whatever the white space of its file.

    Returns: SHA-256, in hexadecimal digits.
    """
    text = json.dumps(plain, sort_keys=True, separators=(",", ":"))
    return sha256(text.encode()).hexdigest()


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
