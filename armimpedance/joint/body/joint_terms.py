"""Columns for what a joint adds of its own: springs, dampers, friction, offsets, motors.

``tau = Y phi + sum k (q - q_r) + K (q - q_r)^2 + h qd + f sign(qd) + I qdd + c`` on the joint's own
row; tau is the torque of motors or muscles, zero where the joint is passive. The quadratic term is
about q_r (the source prints ``K q^2``, which is even about zero).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import Skeleton
from armimpedance.numerics.signals import filtered_sign, lowpass

TermKind = Literal["stiffness", "quadratic", "viscosity", "friction", "inertia", "offset"]
SYMBOLS: Final = {
    "stiffness": "k",
    "quadratic": "K",
    "viscosity": "h",
    "friction": "f",
    "inertia": "I",
    "offset": "c",
}
UNITS: Final = {
    "stiffness": "N m/rad",
    "quadratic": "N m/rad^2",
    "viscosity": "N m s/rad",
    "friction": "N m",
    "inertia": "kg m^2",
    "offset": "N m",
}


@dataclass(frozen=True)
class JointTerm:
    """One further column.

    Attributes
    ----------
    kind : {"stiffness", "quadratic", "viscosity", "friction", "inertia", "offset"}
    coordinate : str
        The hinge on whose row it stands.
    rest_rad : float
        q_r, for stiffness and the quadratic term. An offset beside the stiffness frees it.
    """

    kind: TermKind
    coordinate: str
    rest_rad: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in SYMBOLS:
            raise InputError(
                f"no joint term {self.kind!r}", expected=f"one of {', '.join(SYMBOLS)}"
            )

    @property
    def name(self) -> str:
        """``k_right_elbow_flexion`` and so on."""
        return f"{SYMBOLS[self.kind]}_{self.coordinate}"

    @property
    def unit(self) -> str:
        """SI."""
        return UNITS[self.kind]


def passive_terms(
    coordinates: Sequence[str], rest_rad: Sequence[float], *, quadratic: bool = False
) -> tuple[JointTerm, ...]:
    """``k, h, f`` and, if asked, K of passive joints with known rest angles.

    Raises
    ------
    InputError
        Not one rest angle per joint.
    """
    if len(coordinates) != len(rest_rad):
        raise InputError(f"{len(rest_rad)} rest angles for {len(coordinates)} joints")
    kinds: tuple[TermKind, ...] = ("stiffness", "viscosity", "friction")
    kinds += ("quadratic",) if quadratic else ()
    pairs = zip(coordinates, rest_rad, strict=True)
    return tuple(JointTerm(kind, c, rest) for c, rest in pairs for kind in kinds)


def robot_terms(
    skeleton: Skeleton,
    kinds: Sequence[TermKind] = ("viscosity", "friction", "inertia", "offset"),
) -> tuple[JointTerm, ...]:
    """The same terms on every hinge of a robot: viscous, Coulomb, motor's inertia, offset."""
    hinges = [c for c in skeleton.coordinates if c not in skeleton.root_coordinates]
    return tuple(JointTerm(kind, c) for c in hinges for kind in kinds)


def term_columns(
    terms: Sequence[JointTerm],
    skeleton: Skeleton,
    raw: FloatArray,
    motion: tuple[FloatArray, FloatArray, FloatArray],
    sample_rate_hz: float,
    cutoff_hz: float | None,
) -> FloatArray:
    """Values (S, t) of the columns, each through the same zero-phase filter once.

    Parameters
    ----------
    raw : (S, n)
        Coordinates as recorded: a function of them that is not linear is filtered afterwards.
    motion : three (S, n)
        Coordinates after the filter, and their derivatives.
    """
    q, qd, qdd = motion
    columns = np.empty((len(q), len(terms)))
    for i, term in enumerate(terms):
        j = skeleton.coordinate(term.coordinate)
        if term.kind == "stiffness":
            columns[:, i] = q[:, j] - term.rest_rad
        elif term.kind == "viscosity":
            columns[:, i] = qd[:, j]
        elif term.kind == "inertia":
            columns[:, i] = qdd[:, j]
        elif term.kind == "offset":
            columns[:, i] = 1.0
        elif term.kind == "friction":
            columns[:, i] = filtered_sign(qd[:, j], cutoff_hz, sample_rate_hz)
        else:
            bent = (raw[:, j] - term.rest_rad) ** 2
            columns[:, i] = lowpass(bent, cutoff_hz, sample_rate_hz, axis=0)
    return columns
