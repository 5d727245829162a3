"""MODEL.json: a fitted model of joint impedance, written and read back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Final, Protocol

from armimpedance.errors import InputError
from armimpedance.files.fit_json import write_json
from armimpedance.json_text import read_json
from armimpedance.muscles import ElementQuality
from armimpedance.regression import FitSummary

FORMAT: Final = "armimpedance-model"
VERSION: Final = 1


class Model(Protocol):
    """What every model can tell of itself."""

    @property
    def quality(self) -> tuple[ElementQuality, ...]:
        """Of each element."""

    @property
    def summary(self) -> FitSummary:
        """Method, size, condition, parameters."""

    def as_plain(self) -> dict[str, Any]:
        """Lists and numbers from which the model can be made again."""


@dataclass(frozen=True)
class ModelKind:
    """A kind of model: where its type lives. The module is imported when it is needed."""

    module: str
    type_name: str

    @property
    def type(self) -> Any:
        """The model's class."""
        return getattr(import_module(self.module), self.type_name)


#: What `fit KIND` writes and `predict` reads; a new kind of model is one line here.
MODEL_KINDS: Final = {
    "moment-arms": ModelKind("armimpedance.muscles.posture.model", "PostureModel"),
    "activation": ModelKind("armimpedance.muscles.activation.model", "ActivationModel"),
    "muscles": ModelKind("armimpedance.muscles.combined.model", "MuscleModel"),
}


def write_model(model: Model, path: str | Path, **more: Any) -> None:
    """Write the fit's summary (the fields of FIT.json), its quality, and the model itself."""
    content = {
        "format": FORMAT,
        "version": VERSION,
        "kind": _kind_of(model),
        **model.summary.to_dict(),
        "quality": [asdict(q) for q in model.quality],
        **more,
        "model": model.as_plain(),
    }
    write_json(content, path)


def _kind_of(model: Model) -> str:
    for name, kind in MODEL_KINDS.items():
        if type(model).__name__ == kind.type_name:
            return name
    raise TypeError(f"{type(model).__name__} is no kind of model")


def read_model(path: str | Path) -> tuple[str, Any]:
    """The kind and the model of a file that `write_model` wrote.

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
    make: Callable[[Mapping[str, Any]], Any] = MODEL_KINDS[kind].type.from_plain
    try:
        return kind, make(plain)
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
