"""Alternative laws of damping and dry friction, as torques along a motion.

The model has ``h qd + f sign(qd)``. A joint may be damped by the square of its velocity. Dry
friction may be larger at rest than in motion (``1 + s exp(-|qd| / v_s)`` times the sign: R.
Stribeck, Z. VDI 46 (1902) 1341-1348, 1432-1438, 1463-1470), or begin as a spring that yields
(``z' = qd - |qd| z / z_s``, ``z / z_s`` in place of the sign: P. R. Dahl, The Aerospace
Corporation, TOR-0158(3107-18)-1 (1968)), as relaxed muscle does over its first degrees (M.
Lakie, K. S. Campbell, J. Appl. Physiol. 126 (2019) 1790-1799).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray

#: Tried velocities v_s (rad/s), below which a joint sticks.
STICKING_RAD_S: Final = (0.03, 0.045, 0.065, 0.09, 0.13, 0.18, 0.25, 0.36, 0.5)
#: Tried angles z_s (rad), over which a bristle bends before it slides.
BRISTLE_RAD: Final = (0.01, 0.014, 0.02, 0.028, 0.04, 0.056, 0.08, 0.11, 0.16, 0.22, 0.32)
#: A joint that is much slower than this at the beginning of a trial is at rest, rad/s.
_AT_REST_RAD_S: Final = 0.1


@dataclass(frozen=True)
class FrictionLaw:
    """A torque that the model lacks: its columns, and its description in a sentence.

    Two columns describe a law between two neighbouring tried ones; its size is their sum.
    """

    columns: tuple[str, ...]
    says: str


def _laws(kind: str, sizes: Sequence[float], says: str) -> tuple[FrictionLaw, ...]:
    """Laws of these sizes, and those between two neighbours."""
    single = [FrictionLaw((f"{kind} {size:g}",), says.format(f"{size:g}")) for size in sizes]
    between = [
        FrictionLaw((f"{kind} {low:g}", f"{kind} {high:g}"), says.format(f"{low:g} to {high:g}"))
        for low, high in pairwise(sizes)
    ]
    return (*single, *between)


DRAG: Final = FrictionLaw(("drag",), "a part of it grows with the square of the velocity")
COULOMB: Final = FrictionLaw(("dry",), "there is some, of the same size at every velocity")
STICKING: Final = _laws(
    "sticking",
    STICKING_RAD_S,
    "it is larger at rest, by what is gone at {} rad/s: the joint sticks",
)
BRISTLES: Final = _laws(
    "bristle",
    BRISTLE_RAD,
    "it begins as a spring that yields after {} rad: the joint sticks, as relaxed muscle does "
    "after a rest",
)
#: All columns, in the order of `friction_columns`.
FRICTION_COLUMNS: Final = tuple(
    law.columns[0] for law in (DRAG, COULOMB, *STICKING, *BRISTLES) if len(law.columns) == 1
)


def friction_columns(qd: FloatArray, sign: FloatArray, step_s: float) -> FloatArray:
    """Torques (S, ..., F) of unit size along velocities and their signs (S, ...)."""
    speed = np.abs(qd)
    sticking = [sign * np.exp(-speed / v) for v in STICKING_RAD_S]
    # difference of a bristle's torque from f sign(qd)
    bristles = np.moveaxis(_bent(qd, step_s) - sign[..., None], -1, 0)
    return np.stack([speed * qd, sign, *sticking, *bristles], axis=-1)


def _bent(qd: FloatArray, step_s: float) -> FloatArray:
    """Deflections ``z / z_s`` (S, ..., Z) of bristles, exact between samples of qd.

    A joint that is released from rest starts unbent, one that already moves starts bent.
    """
    decay = np.exp(-np.abs(qd)[..., None] * step_s / np.array(BRISTLE_RAD))
    end = np.sign(qd)[..., None]
    bent = np.zeros(decay.shape)
    bent[0] = (qd[0] / (np.abs(qd[0]) + _AT_REST_RAD_S))[..., None]
    for i in range(len(qd) - 1):
        bent[i + 1] = end[i] + (bent[i] - end[i]) * decay[i]
    return bent
