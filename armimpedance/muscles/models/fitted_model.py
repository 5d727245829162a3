"""What the models over posture, over activation and over both have in common."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from html import escape
from typing import TYPE_CHECKING, Any, TypeVar, cast

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.plain import from_plain, to_plain
from armimpedance.muscles.models.quality import ElementQuality
from armimpedance.numerics.regression import FitSummary

if TYPE_CHECKING:
    import pandas as pd

Model = TypeVar("Model", bound="FittedModel")


class FittedModel(FrozenRecord):
    """A model of joint stiffness and viscosity with what its fit is worth.

    Attributes
    ----------
    dof : float
        Degrees of freedom of the t distribution for intervals; inf = normal.
    quality : tuple of ElementQuality
        How well each element of K and B is fitted.
    summary : FitSummary
        Method, size, condition and parameters of the fit.
    """

    dof: float
    quality: tuple[ElementQuality, ...]
    summary: FitSummary

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.dof > 0:
            raise InputError(f"{self.dof} degrees of freedom", expected="more than 0")

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings of the fit."""
        return self.summary.warnings

    def with_warning(self: Model, warning: str) -> Model:
        """The same model with one warning more."""
        summary = replace(self.summary, warnings=(*self.summary.warnings, warning))
        return cast(Model, replace(cast(Any, self), summary=summary))

    def to_frame(self) -> pd.DataFrame:
        """One row a parameter: value, standard error, 95 % limits, unit."""
        return self.summary.to_frame()

    def to_dict(self) -> dict[str, Any]:
        """What MODEL.json says of the fit: its summary and the quality of each element."""
        return {**self.summary.to_dict(), "quality": [asdict(q) for q in self.quality]}

    def as_plain(self) -> dict[str, Any]:
        """Lists, numbers and texts from which `from_plain` makes the same model again."""
        plain: dict[str, Any] = to_plain(self)
        return plain

    @classmethod
    def from_plain(cls: type[Model], plain: Mapping[str, Any]) -> Model:
        """The model that `as_plain` wrote.

        Raises
        ------
        InputError
            A field is missing, unknown or not what it should be.
        """
        return from_plain(cls, plain)

    def _head(self) -> str:
        count = len(self.summary.warnings)
        warned = f", {count} warning{'s' * (count > 1)}" if count else ""
        return f"{self.summary.method}, {self.summary.n} numbers{warned}"

    def __repr__(self) -> str:
        lines = [
            f"{q.element}: R {q.r:.3f}, of rows left out {q.leave_one_out_r:.3f}, "
            f"of noise {q.null_r:.3f}"
            for q in self.quality
        ]
        return "\n".join([self._head(), *lines])

    def _repr_html_(self) -> str:
        import pandas as pd

        table = pd.DataFrame([asdict(q) for q in self.quality]).set_index("element")
        return f"<p>{escape(self._head())}</p>{table.to_html(float_format='{:.4g}'.format)}"
