"""Cells of a study: what is simulated, and how it is estimated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from armimpedance.core.program import of_words
from armimpedance.lab.simulate_study.fields import Settings, Value
from armimpedance.lab.simulate_study.rig import RIGS, Rig, Seeds


@dataclass(frozen=True)
class Cell:
    """One combination of settings.

    Attributes
    ----------
    rig_name : str
    chosen : tuple of (name, value)
        All settings of the rig, in its order.
    conditions : tuple of str
    """

    rig_name: str
    chosen: tuple[tuple[str, Value], ...]
    conditions: tuple[str, ...]

    @property
    def rig(self) -> Rig:
        """The rig itself."""
        return RIGS[self.rig_name]

    @property
    def settings(self) -> Settings:
        """Name -> value."""
        return dict(self.chosen)

    @property
    def shown(self) -> Mapping[str, str]:
        """Name -> value as a table shows it."""
        shown = {name: _text(value) for name, value in self.chosen}
        if "conditions" in shown:
            shown["conditions"] = " ".join(self.conditions)
        return {"rig": self.rig_name, **shown}

    @property
    def simulated(self) -> tuple[tuple[str, Value], ...]:
        """The settings that the simulation sees."""
        seen = {field.name for field in self.rig.fields if field.simulated}
        return (("rig", self.rig_name), *((n, v) for n, v in self.chosen if n in seen))

    def seeds(self, seed: int) -> Seeds:
        """Its random numbers: those of every cell with the same simulated part.

        Which conditions are asked for changes nothing in the numbers of each.
        """
        part = [(n, v) for n, v in self.simulated if n != "conditions"]
        return Seeds(seed, int(of_words(part)[:12], 16))


def _text(value: Value) -> str:
    if value is None:
        return ""
    return f"{value:g}" if isinstance(value, float) else str(value)
