"""What every fit that is written to a file says of itself (FIT.json, MODEL.json)."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.numerics.regression.parameters import (
    NamedParameter,
    parameter_dict,
    parameter_frame,
    parameter_html,
)

if TYPE_CHECKING:
    import pandas as pd

#: Parameters that a short text shows; a body has more than a hundred.
MOST_SHOWN: Final = 12


@dataclass(frozen=True, repr=False)
class FitSummary:
    """Method, size, condition and parameters of a fit.

    Attributes
    ----------
    method : str
    n : int
        Rows of the regression.
    cond_raw, cond_scaled : float
    rank : int
    r2, vaf : float
    parameters : tuple of NamedParameter
    warnings : tuple of str
    checks : tuple of Finding
        Every assumption of the model that was held against the data, those that hold among them.
    """

    method: str
    n: int
    cond_raw: float
    cond_scaled: float
    rank: int
    r2: float
    vaf: float
    parameters: tuple[NamedParameter, ...]
    warnings: tuple[str, ...] = ()
    checks: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        names = [(p.name, p.joint) for p in self.parameters]
        if len(set(names)) != len(names):
            raise InputError("a fit has two parameters of one name")

    def to_frame(self) -> pd.DataFrame:
        """One row a parameter: value, standard error, 95 % limits, unit."""
        return parameter_frame(self.parameters)

    def to_dict(self) -> dict[str, Any]:
        """What FIT.json holds of every fit, in the contract's order."""
        return {
            "method": self.method,
            "n": int(self.n),
            "cond_raw": float(self.cond_raw),
            "cond_scaled": float(self.cond_scaled),
            "rank": int(self.rank),
            "r2": float(self.r2),
            "vaf": float(self.vaf),
            "warnings": list(self.warnings),
            "parameters": [parameter_dict(one) for one in self.parameters],
            "checks": [one.to_dict() for one in self.checks],
        }

    def __repr__(self) -> str:
        shown = list(map(repr, self.parameters[:MOST_SHOWN]))
        left = len(self.parameters) - len(shown)
        more = [f"... and {left} more"] if left else []
        warned = [f"warning: {sentence}" for sentence in self.warnings]
        return "\n".join([f"{self.method}, R^2 {self.r2:.3f}", *shown, *more, *warned])

    def _repr_html_(self) -> str:
        warned = "".join(f"<li>{escape(sentence)}</li>" for sentence in self.warnings)
        head = f"<p>{escape(self.method)}, R<sup>2</sup> {self.r2:.3f}</p>"
        return f"{head}{parameter_html(self.parameters)}<ul>{warned}</ul>"
