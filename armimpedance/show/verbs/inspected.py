"""The result of `inspect`: contents, checks and verdict as text, table and mapping."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.described import Meaning
from armimpedance.core.findings import Finding
from armimpedance.core.shown import html_table
from armimpedance.show.files import Content, Quantity, WrittenResult, number, table_content
from armimpedance.show.text import counted

if TYPE_CHECKING:
    import pandas as pd

#: Columns of what is written; the tables of many recordings stand below one another.
INSPECTED: Final = {
    "kind": Meaning("verdict, fact or check"),
    "name": Meaning("what it is called"),
    "state": Meaning("what the check says"),
    "value": Meaning("what the recording holds"),
    "unit": Meaning("unit of the value"),
    "would_have_seen": Meaning("smallest error that the check would have seen"),
    "message": Meaning("the same as a sentence"),
}
COLUMNS: Final = tuple(INSPECTED)


@dataclass(frozen=True)
class Fact:
    """One thing that a recording holds.

    `unit`: "" of a count or a text.
    """

    name: str
    value: float | int | str
    unit: str = ""


@dataclass(frozen=True, repr=False)
class Inspection(WrittenResult, FrozenRecord):
    """The findings of `inspect`.

    Attributes
    ----------
    contents : str
        What the recording holds, in lines.
    checks : tuple of Finding
        In a fixed order, those that are missing among them.
    facts : tuple of Fact
        How much it holds: what tables of many recordings set side by side.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> session, truth = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> looked = ai.inspect(session)
    >>> looked.usable
    True
    """

    DESCRIBED = INSPECTED

    contents: str
    checks: tuple[Finding, ...]
    facts: tuple[Fact, ...] = ()

    def of_verdict(self, verdict: str) -> tuple[Finding, ...]:
        """The findings of one verdict, such as "missing"."""
        return tuple(check for check in self.checks if check.verdict == verdict)

    @property
    def usable(self) -> bool:
        """True if no check stops an analysis."""
        return not self.of_verdict("unusable")

    @property
    def verdict(self) -> str:
        """One sentence: whether the recording can be used."""
        if stops := self.of_verdict("unusable"):
            name = f"{stops[0].name}: " if stops[0].name else ""
            return f"cannot be used: {name}{stops[0].message}"
        warnings = len(self.of_verdict("warning"))
        return "Usable" + (f", with {counted(warnings, 'warning')}" if warnings else "")

    @property
    def state(self) -> str:
        """The verdict in one word: "ok", "warning" or "unusable"."""
        return next((one for one in ("unusable", "warning") if self.of_verdict(one)), "ok")

    @property
    def content(self) -> Content:
        """The content of ``--out``: the verdict, the facts and one row a check.

        No path stands in it: equal recordings have equal files.
        """
        verdict = {"kind": "verdict", "state": self.state, "message": self.verdict}
        checks = [
            {
                "kind": "check",
                "name": check.name,
                "state": check.verdict,
                "would_have_seen": check.smallest,
                "message": check.message,
            }
            for check in self.checks
        ]
        rows = [verdict, *map(_fact_row, self.facts), *checks]
        objects = {"state": self.state, **self.to_dict()}
        del objects["contents"]
        return table_content(
            rows,
            COLUMNS,
            keys=("kind", "name"),
            described=self.DESCRIBED,
            quantities=lambda: [
                Quantity({"kind": "fact"}, one.name, one.name, value, unit=one.unit or "1")
                for one in self.facts
                if (value := number(one.value)) is not None
            ],
            objects=lambda: objects,
        )

    def to_frame(self) -> pd.DataFrame:
        """A table of the findings: check, verdict, message."""
        import pandas as pd

        rows = [(check.name, check.verdict, check.message) for check in self.checks]
        return pd.DataFrame(rows, columns=["check", "verdict", "message"])

    def to_dict(self) -> dict[str, Any]:
        """Contents, verdict and findings, as texts."""
        checks = [check.to_dict() for check in self.checks]
        facts = {fact.name: fact.value for fact in self.facts}
        return {
            "contents": self.contents,
            "usable": self.usable,
            "verdict": self.verdict,
            "facts": facts,
            "checks": checks,
        }

    def __str__(self) -> str:
        lines = [self.contents, "\nChecks", *(f"  {check}" for check in self.checks)]
        return "\n".join([*lines, f"\n{self.verdict}"] if self.usable else lines)

    def __repr__(self) -> str:
        serious = [str(check) for check in self.checks if check.verdict in ("warning", "unusable")]
        more = [f"and {len(serious) - 8} further findings"] if len(serious) > 8 else []
        return "\n".join([*self.contents.split("\n", 2)[:2], *serious[:8], *more, self.verdict])

    def _repr_html_(self) -> str:
        rows = [(check.verdict, check.name, check.message) for check in self.checks]
        table = html_table([("verdict", "check", "what was seen"), *rows])
        return f"<pre>{escape(self.contents)}</pre>{table}<p>{escape(self.verdict)}</p>"


def _fact_row(fact: Fact) -> dict[str, Any]:
    """A number is a value with its unit, a text a message."""
    column = "message" if isinstance(fact.value, str) else "value"
    return {"kind": "fact", "name": fact.name, column: fact.value, "unit": fact.unit}
