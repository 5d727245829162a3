"""What `inspect` returns: contents, checks and verdict as text, table and mapping."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from armimpedance.arrays import FrozenRecord
from armimpedance.findings import Finding
from armimpedance.report import counted

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class Inspection(FrozenRecord):
    """What `inspect` found.

    Attributes
    ----------
    contents : str
        What the recording holds, in lines.
    checks : tuple of Finding
        In a fixed order, those that are missing among them.
    """

    contents: str
    checks: tuple[Finding, ...]

    def of_verdict(self, verdict: str) -> tuple[Finding, ...]:
        """The findings of one verdict, such as "missing"."""
        return tuple(check for check in self.checks if check.verdict == verdict)

    @property
    def usable(self) -> bool:
        """Whether no check stops an analysis."""
        return not self.of_verdict("unusable")

    @property
    def verdict(self) -> str:
        """One sentence: whether the recording can be used."""
        if stops := self.of_verdict("unusable"):
            name = f"{stops[0].name}: " if stops[0].name else ""
            return f"cannot be used: {name}{stops[0].message}"
        warnings = len(self.of_verdict("warning"))
        return "Usable" + (f", with {counted(warnings, 'warning')}" if warnings else "")

    def to_frame(self) -> pd.DataFrame:
        """A table of the findings: check, verdict, message."""
        import pandas as pd

        rows = [(check.name, check.verdict, check.message) for check in self.checks]
        return pd.DataFrame(rows, columns=["check", "verdict", "message"])

    def to_dict(self) -> dict[str, Any]:
        """Contents, verdict and findings, as texts."""
        checks = [check.to_dict() for check in self.checks]
        return {"contents": self.contents, "usable": self.usable, "checks": checks}

    def __str__(self) -> str:
        lines = [self.contents, "\nChecks", *(f"  {check}" for check in self.checks)]
        return "\n".join([*lines, f"\n{self.verdict}"] if self.usable else lines)

    def __repr__(self) -> str:
        told = [str(check) for check in self.checks if check.verdict in ("warning", "unusable")]
        more = [f"and {len(told) - 8} further findings"] if len(told) > 8 else []
        return "\n".join([*self.contents.split("\n", 2)[:2], *told[:8], *more, self.verdict])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{check.verdict}</td><td>{escape(check.name)}</td>"
            f"<td>{escape(check.message)}</td></tr>"
            for check in self.checks
        )
        contents = f"<pre>{escape(self.contents)}</pre>"
        return f"{contents}<table>{rows}</table><p>{escape(self.verdict)}</p>"
