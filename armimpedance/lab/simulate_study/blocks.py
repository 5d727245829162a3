"""Blocks of sessions that are done: a file each, under what it was made of.

A file is a SHA-256 and what it is of: numbers, then the reasons of what failed. A file that is not
as it was written is made again.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.core.outputs import staged_file
from armimpedance.core.program import of_program, of_words
from armimpedance.lab.simulate_study.fields import Settings, Value
from armimpedance.lab.simulate_study.rig import BLOCK, COLUMNS, RIGS, Numbers, Rig, Seeds

# Cells of a study: what is simulated, and how it is estimated.


@dataclass(frozen=True)
class Cell:
    """One combination of settings.

    `chosen` tuple of (name, value): all settings of the rig, in its order.
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


#: Within the study's folder.
STORE: Final = ".store"
_FORMAT: Final = 1
_DIGEST: Final = 32
#: Reasons that are kept of a block, and how long each may be.
_MOST_REASONS: Final = 20
_LARGEST_TAIL: Final = 100_000


@dataclass(frozen=True)
class Blocks:
    """The blocks of a study.

    `out`: the study's folder.
    `program`: what analysis and simulator were when the study began: a file that changes while it
    runs shall not part it from its own blocks.
    """

    out: Path
    seed: int
    program: str = field(default_factory=partial(of_program, "armimpedance", "manipulandum_sim"))

    def prepare(self) -> None:
        """Make the folders, so that they can be told from another's."""
        (self.out / STORE).mkdir(parents=True, exist_ok=True)

    def get(self, cell: Cell, block: int, count: int) -> Numbers | None:
        """The first `count` sessions of a block; None where they are not there, or damaged."""
        path = self._path(cell, block)
        shape = (len(cell.conditions), -1, self._width(cell))
        try:
            if os.path.getsize(path) > _DIGEST + self._bytes(cell, BLOCK) + _LARGEST_TAIL:
                return None
            content = path.read_bytes()
        except OSError:
            return None
        body = content[_DIGEST:]
        if hashlib.sha256(body).digest() != content[:_DIGEST]:
            return None
        stored = body[0]
        if stored < count:
            return None
        size = self._bytes(cell, stored)
        numbers = np.frombuffer(body[1 : 1 + size], "<f8").reshape(shape)[:, :count]
        problems = json.loads(body[1 + size :]) if stored == count else {}
        quantities = len(cell.rig.quantities)
        values, extras = np.split(numbers, [quantities * len(COLUMNS)], axis=2)
        return Numbers(values.reshape(*values.shape[:2], quantities, -1), extras, problems)

    def put(self, cell: Cell, block: int, numbers: Numbers) -> None:
        """Keep a block."""
        conditions, count = numbers.values.shape[:2]
        flat = numbers.values.reshape(conditions, count, -1)
        joined = np.concatenate([flat, numbers.extras], axis=2).astype("<f8")
        kept = sorted(numbers.problems.items())[:_MOST_REASONS]
        reasons = {reason[:400]: times for reason, times in kept}
        body = bytes([count]) + joined.tobytes() + json.dumps(reasons).encode()
        path = self._path(cell, block)
        path.parent.mkdir(parents=True, exist_ok=True)
        with staged_file(path) as staged:
            staged.write_bytes(hashlib.sha256(body).digest() + body)

    def _path(self, cell: Cell, block: int) -> Path:
        made_of = [_FORMAT, self.program, self.seed, cell.rig_name, cell.chosen, cell.conditions]
        key = of_words(*made_of, block)
        return self.out / STORE / key[:2] / f"{key}.block"

    @staticmethod
    def _width(cell: Cell) -> int:
        return len(cell.rig.quantities) * len(COLUMNS) + cell.rig.extras

    def _bytes(self, cell: Cell, count: int) -> int:
        return 8 * len(cell.conditions) * count * self._width(cell)
