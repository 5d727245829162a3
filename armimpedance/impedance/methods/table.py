"""The table of estimators for returning disturbances: one record, one file each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from armimpedance.conventions import Kind
from armimpedance.errors import look_up
from armimpedance.impedance.methods import (
    definite,
    exact,
    frequency,
    instruments,
    likelihood,
    paper,
    weak_form,
    weighted,
)
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
    differs : str
        What it points to if this method alone disagrees with the default, in one clause.
    """

    name: str
    assumes: str
    reference: str
    prepare: Callable[[Window, Kind], Prepared]
    differs: str = ""


#: Methods that weigh the same equation differently agree unless the equation is wrong.
_NO_LINEAR_LIMB = "the response is not that of a linear second-order limb, as with a reflex"

METHODS = {
    method.name: method
    for method in (
        Method(
            "exact",
            "the limb's virtual position drifts at a constant velocity at most; the hand may "
            "end anywhere, still or moving",
            "both-sided correction of Tsuji (1997), eqs. (22)-(26); docs/estimate.md",
            exact.prepare,
            _NO_LINEAR_LIMB,
        ),
        Method(
            "paper",
            "displacement, velocity and acceleration are all zero again at the end; a servo of "
            "finite stiffness breaks this and K with it",
            "Tsuji (1997), eqs. (27)-(29)",
            paper.prepare,
            "the hand is not at rest where it started when the disturbance ends",
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
            f"trials of a direction do not repeat the same motion, or {_NO_LINEAR_LIMB}",
        ),
        Method(
            "instruments",
            "the commanded motion, or the other trials of a direction, tell how the hand moves; "
            "the position's noise may be of any size",
            "instrumental variables, T. Soederstroem and P. Stoica (Springer, 1983)",
            instruments.prepare,
            f"{_NO_LINEAR_LIMB}, or noise of the position is large",
        ),
        Method(
            "weak_form",
            "as exact; noise of the position is small against the motion over 0.16 s",
            "test functions orthogonal to offset and ramp; docs/estimate.md",
            weak_form.prepare,
            f"{_NO_LINEAR_LIMB}, or noise of the position is large",
        ),
        Method(
            "frequency",
            "several trials of each direction, alike but for noise; nothing needed above 15 Hz",
            "E. J. Perreault, R. F. Kirsch and A. M. Acosta, Biol. Cybern. 80 (1999), 327-337",
            frequency.prepare,
            _NO_LINEAR_LIMB,
        ),
        Method(
            "definite",
            "the limb is passive: M, B and K are symmetric without negative eigenvalues",
            "second-order cones, S. Boyd and L. Vandenberghe, Convex Optimization (2004)",
            definite.within(weighted.prepare),
            "the limb is not passive, for example because of a reflex, or trials are too few",
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
    return look_up(METHODS, name, "method")
