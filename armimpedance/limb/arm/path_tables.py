"""Arms of published models that come with the package: lengths as polynomials, in tables."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib.resources import files
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.limb.arm.polynomial_paths import PolynomialPaths


@dataclass(frozen=True)
class PathTable(FrozenRecord):
    """The muscles of a table ``arm/muscles/NAME.csv``.

    Attributes
    ----------
    paths : PolynomialPaths
    max_tension : (m,)
        N.
    """

    paths: PolynomialPaths
    max_tension: Annotated[FloatArray, "m"]


def path_table(name: str, angles: tuple[str, ...], box: ArrayLike) -> PathTable:
    """Read a table of the package: a row for each muscle and term.

    Parameters
    ----------
    name : str
    angles : (n,) tuple of str
        The table has the power of each as ``{angle}_power``.
    box : (n, 2)
        Angles that are scaled to -1 and 1, rad.
    """
    with (files("armimpedance.limb.arm") / "muscles" / f"{name}.csv").open(
        encoding="utf-8"
    ) as stream:
        terms = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    powers = [tuple(int(term[f"{angle}_power"]) for angle in angles) for term in terms]
    muscles = tuple(dict.fromkeys(term["muscle"] for term in terms))
    every = sorted(set(powers))
    coefficients = np.zeros((len(muscles), len(every)))
    tension = np.zeros(len(muscles))
    for term, power in zip(terms, powers, strict=True):
        row = muscles.index(term["muscle"])
        coefficients[row, every.index(power)] = float(term["length_m"])
        tension[row] = float(term["max_tension_N"])
    paths = PolynomialPaths(muscles, np.array(every), coefficients, np.array(box, dtype=float))
    return PathTable(paths, tension)


def with_joints_locked(paths: PolynomialPaths, free: int) -> PolynomialPaths:
    """The same muscles over the first joints alone, the others locked at zero angles.

    Parameters
    ----------
    paths : PolynomialPaths
    free : int
        Number of joints that are left.

    Returns
    -------
    PolynomialPaths
        Without the muscles that span none of them.
    """
    middle, half = paths.box.mean(axis=1), np.diff(paths.box, axis=1)[:, 0] / 2
    # a term's locked factors are a number: u^e at the scaled angle u of zero
    at_zero = np.prod((-middle[free:] / half[free:]) ** paths.exponents[:, free:], axis=1)
    left, where = np.unique(paths.exponents[:, :free], axis=0, return_inverse=True)
    summed = np.zeros((len(paths.muscles), len(left)))
    np.add.at(summed.T, where.ravel(), (paths.coefficients * at_zero).T)
    moving = left.any(axis=1)
    spans = (summed[:, moving] != 0).any(axis=1)
    names = tuple(np.array(paths.muscles)[spans].tolist())
    return PolynomialPaths(names, left[moving], summed[np.ix_(spans, moving)], paths.box[:free])
