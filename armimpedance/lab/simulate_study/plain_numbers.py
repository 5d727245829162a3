"""Fitted numbers with standard errors, and nothing made of them, as rows; how they are drawn."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.lab.simulate_study.rig import COLUMNS, Numbers, Shortcut
from armimpedance.numerics.regression import t_factor, t_interval


class Fitted(NamedTuple):
    """Values and standard errors (Q,), degrees of freedom, and the truth (Q,)."""

    values: FloatArray
    sd: FloatArray
    dof: float
    truth: FloatArray


def extras_of(quantities: int) -> int:
    """How many numbers of a session are drawn: values, logarithms of their errors and of dof."""
    return 2 * quantities + 1


def numbers_of(fits: Iterable[Callable[[], Fitted]], sessions: int, quantities: int) -> Numbers:
    """Every session of one condition; what fails is nan, and its reason counted.

    Parameters
    ----------
    fits : iterable of callable
        One for each session.
    sessions, quantities : int

    Returns
    -------
    Numbers
    """
    values = np.full((1, sessions, quantities, len(COLUMNS)), np.nan)
    extras = np.full((1, sessions, extras_of(quantities)), np.nan)
    problems: Counter[str] = Counter()
    for s, fit in enumerate(fits):
        try:
            found = fit()
        except ArmImpedanceError as error:
            problems[str(error)] += 1
            continue
        low, high = t_interval(found.values, found.sd, found.dof).T
        dof, unknown = np.full(quantities, found.dof), np.full(quantities, np.nan)
        columns = [found.values, low, high, found.sd, dof, found.truth, unknown]
        values[0, s] = np.column_stack(columns)
        # normal intervals stay normal: 1e300 stands for no end of degrees of freedom
        known = np.log(np.minimum(found.dof, 1e300))
        extras[0, s] = np.concatenate([found.values, np.log(found.sd), [known]])
    return Numbers(values, extras, dict(problems))


def _drawn(extras: FloatArray, truth: FloatArray, bound: FloatArray) -> FloatArray:
    """Numbers (n, Q, 7) from extras (n, 2 Q + 1)."""
    quantities = len(truth)
    value, sd = extras[:, :quantities], np.exp(extras[:, quantities:-1])
    dof = np.exp(extras[:, -1:])
    steady = bool(np.ptp(dof) <= 1e-9 * dof[0, 0])
    reach = sd * (t_factor(float(dof[0, 0])) if steady else _factors(dof))
    shape = value.shape
    wide = [np.broadcast_to(part, shape) for part in (dof, truth, bound)]
    return np.stack([value, value - reach, value + reach, sd, *wide], axis=-1)


def _factors(dof: FloatArray) -> FloatArray:
    from scipy.special import stdtrit

    return np.asarray(stdtrit(dof, 0.975))


SHORTCUT = Shortcut(_drawn)
