"""The table of estimators for returning disturbances: one record, one file each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from armimpedance.conventions import Kind
from armimpedance.errors import InputError
from armimpedance.impedance import exact, likelihood, paper, weighted
from armimpedance.impedance.prepared import Prepared
from armimpedance.records import Window


@dataclass(frozen=True)
class Method:
    """An estimator.

    Attributes
    ----------
    name : str
    assumes : str
        What must hold for the estimate to be right, in one sentence.
    reference : str
    prepare : function
        From the raw windows of one group to what is solved.
    """

    name: str
    assumes: str
    reference: str
    prepare: Callable[[Window, Kind], Prepared]


METHODS = {
    method.name: method
    for method in (
        Method(
            "exact",
            "the limb's virtual position drifts at a constant velocity at most; the hand may "
            "end anywhere, still or moving",
            "both-sided correction of Tsuji (1997), eqs. (22)-(26); docs/estimate.md",
            exact.prepare,
        ),
        Method(
            "paper",
            "displacement, velocity and acceleration are all zero again at the end; a servo of "
            "finite stiffness breaks this and K with it",
            "Tsuji (1997), eqs. (27)-(29)",
            paper.prepare,
        ),
        Method(
            "weighted",
            "noise is alike in all trials of a group; otherwise as exact",
            "feasible generalised least squares, compensated for the position's noise as in "
            "W. A. Fuller, Measurement Error Models (1987); docs/estimate.md",
            weighted.prepare,
        ),
        Method(
            "likelihood",
            "motions of a group differ only by the position sensor's noise: a robot much stiffer "
            "than the limb is unsteady",
            "errors-in-variables likelihood, R. Pintelon & J. Schoukens, System Identification: A "
            "Frequency Domain Approach (Wiley)",
            likelihood.prepare,
        ),
    )
}

DEFAULT_METHOD = "weighted"


def method_named(name: str) -> Method:
    """Look up a method.

    Raises
    ------
    InputError
        If there is none of that name; lists those that there are.
    """
    if name not in METHODS:
        raise InputError(f"unknown method {name!r}", expected=f"one of {', '.join(METHODS)}")
    return METHODS[name]
