"""Muscle lengths as an anatomical arm has them, and what a subject's may differ by.

Lengths are polynomials of the scaled angles; a correction adds polynomials to the LENGTH, so that
moment arms and curvature stay those of one length. From stiffness alone only ``sqrt(f_i) d_i`` can
be told: what settles the rest is a prior, each correction having a moment arm of a stated part of
the anatomical one as its standard deviation.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, IntArray
from armimpedance.limb.arm import MuscularArm, PolynomialPaths, fit_paths, monomial_exponents
from armimpedance.muscles.models.packed import elements
from armimpedance.muscles.models.workspace import AngleScaling

#: Postures of the box, per joint, at which the anatomical arm is looked at.
_GRID = 9
#: ... of more than two joints.
_COARSE = 5
#: A moment arm is as uncertain as one of at least this part of the muscle's largest.
_LEAST_SIZE = 0.5
#: A joint with a smaller moment arm (m) everywhere is not spanned.
_NO_ARM_M = 1e-6
#: Order of the polynomials that stand for an anatomical arm of any form.
_ARM_ORDER = 3


@dataclass(frozen=True)
class CorrectedLengths(FrozenRecord):
    """``L_i = L_i0 + sum of z times the corrections of muscle i``, z of prior N(0, 1).

    `muscles` (m,) tuple of str.
    `exponents` (T, n) int: powers of the scaled angles.
    `base` (m, T): the anatomical lengths, m.
    `muscle` (C,) int: number of the muscle that each correction belongs to.
    `change` (C, T): change of that muscle's length by one standard deviation of the correction, m.
    `box` (n, 2): joint angles (rad) that become -1 and 1.
    `rms`: how far the polynomials are from the anatomical moment arms, m.
    `labels` (C,) tuple of str: ``arm_brachialis_e1``: muscle, joint or joints, order.
    """

    muscles: Annotated[tuple[str, ...], "m"]
    exponents: Annotated[IntArray, "t n"]
    base: Annotated[FloatArray, "m t"]
    muscle: Annotated[IntArray, "c"]
    change: Annotated[FloatArray, "c t"]
    box: Annotated[FloatArray, "n 2"]
    rms: float
    labels: tuple[str, ...] = ()

    @property
    def scaling(self) -> AngleScaling:
        """The scaling of the joint angles."""
        return AngleScaling(self.box)

    def coefficients(self, z: FloatArray) -> FloatArray:
        """Coefficients of the corrected lengths, (m, T)."""
        corrected = self.base.copy()
        np.add.at(corrected, self.muscle, z[:, None] * self.change)
        return corrected

    def paths(self, z: FloatArray) -> PolynomialPaths:
        """The corrected paths."""
        return PolynomialPaths(self.muscles, self.exponents, self.coefficients(z), self.box)

    def derivatives(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gradients (P, n, T) and packed second derivatives (P, E, T) of each term at q (P, n)."""
        names = tuple(f"term {t}" for t in range(len(self.exponents)))
        terms = PolynomialPaths(names, self.exponents, np.eye(len(names)), self.box)
        i, j = elements(len(self.box))
        second = terms.curvature(q)[..., i, j]
        return terms.moment_arms(q).transpose(0, 2, 1), second.transpose(0, 2, 1)


def corrected_lengths(
    arm: MuscularArm, q: FloatArray, *, order: int, prior_part: float
) -> CorrectedLengths:
    """Corrections of order `order` to an arm's moment arms, over its range and all of q (P, n).

    `arm`: arm whose muscle paths are taken over as polynomials.
    `q` (P, n): measured postures, rad.
    `order`: L of the moment arms' corrections, from 0.
    `prior_part`: standard deviation of a correction's moment arm over the anatomical one.
    """
    low = np.minimum(arm.angle_range[:, 0], q.min(axis=0))
    high = np.maximum(arm.angle_range[:, 1], q.max(axis=0))
    box = np.stack([low, high], axis=1)
    n = arm.paths.joints
    inside = AngleScaling(np.asarray(arm.angle_range)).grid(_GRID if n == 2 else _COARSE)
    G = arm.paths.moment_arms(inside)
    spans: BoolArray = np.asarray((np.abs(G) > _NO_ARM_M).any(axis=0))
    highest = max(order, _ARM_ORDER)
    fitted = fit_paths(arm.paths.muscles, inside, G, highest, spans, box=box)
    exponents = monomial_exponents(n, highest + 1)
    size = np.sqrt((G**2).mean(axis=0))
    # a muscle that passes close by one joint may pass on its other side
    size = np.maximum(size, _LEAST_SIZE * size.max(axis=1, keepdims=True))
    half = (box[:, 1] - box[:, 0]) / 2
    muscle: list[int] = []
    change: list[FloatArray] = []
    labels: list[str] = []
    for i in range(len(spans)):
        terms = _corrections(spans[i], size[i] * half, exponents, order)
        muscle += [i] * len(terms)
        change += [prior_part * term for term in terms.values()]
        labels += [f"arm_{arm.paths.muscles[i]}_{kind}" for kind in terms]
    return CorrectedLengths(
        muscles=arm.paths.muscles,
        exponents=exponents,
        base=fitted.paths.coefficients,
        muscle=np.array(muscle, dtype=np.int64),
        change=np.array(change).reshape(-1, len(exponents)),
        box=box,
        rms=float(np.sqrt((fitted.rms**2).mean())),
        labels=tuple(labels),
    )


def _corrections(
    spans: np.ndarray, swing: FloatArray, exponents: IntArray, order: int
) -> dict[str, FloatArray]:
    """Length terms (T,) of one muscle whose arms are as large as the anatomical ones, by name.

    `spans` (n,) bool.
    `swing` (n,): anatomical moment arm times half the range of the angle, m.
    """
    corrections = {}
    n = len(spans)
    names = "se" if n == 2 else [f"q{j}_" for j in range(1, n + 1)]
    for joint in np.flatnonzero(spans):
        for k in range(order + 1):
            # the arm changes as the Legendre polynomial P_k of the angle: its integral, the length
            legendre = (
                np.polynomial.Legendre.basis(k).integ().convert(kind=np.polynomial.Polynomial)
            )
            term = np.zeros(len(exponents))
            for power, value in enumerate(legendre.coef[1:], start=1):
                at = (exponents == power * np.eye(n, dtype=np.int64)[joint]).all(axis=1)
                term[at] = swing[joint] * value
            corrections[f"{names[joint]}{k}"] = term
    for one, other in combinations(np.flatnonzero(spans), 2):
        for a in range(1, order + 1):
            for b in range(1, order + 2 - a):
                powers = np.zeros(n, dtype=np.int64)
                powers[[one, other]] = a, b
                both = (exponents == powers).all(axis=1)
                size = np.sqrt(swing[one] * swing[other]) / max(a, b)
                corrections[f"{names[one]}{a}{names[other]}{b}"] = np.where(both, size, 0.0)
    return corrections
