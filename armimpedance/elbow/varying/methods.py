"""The table of time-varying methods: one record, one function each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

from armimpedance.elbow.varying.emg import scheduled
from armimpedance.elbow.varying.found import Found
from armimpedance.elbow.varying.smoothed import smoother
from armimpedance.elbow.varying.spline import spline
from armimpedance.elbow.varying.windows import quadratic, windows
from armimpedance.errors import look_up


@dataclass(frozen=True)
class VaryingMethod:
    """A method for B(t) and K(t) with constant I.

    Attributes
    ----------
    name : str
    says : str
        What it takes B and K for, in one line.
    needs : {"window", "amplitude", ""}
        What it takes beside the samples: a window's length, EMG amplitudes.
    reference : str
    identify : function
    """

    name: str
    says: str
    needs: Literal["window", "amplitude", ""]
    reference: str
    identify: Callable[..., Found]


VARYING_METHODS: Final = {
    method.name: method
    for method in (
        VaryingMethod(
            "windows",
            "constant inside windows of 0.5 s that overlap by half",
            "window",
            "Ruiz (2011), section 6",
            windows,
        ),
        VaryingMethod(
            "quadratic",
            "quadratic in time inside windows of 1 s, read at their centres",
            "window",
            "W. S. Cleveland, J. Am. Stat. Assoc. 74 (1979) 829-836",
            quadratic,
        ),
        VaryingMethod(
            "smoother",
            "integrated random walks, their noise levels chosen by likelihood",
            "",
            "H. E. Rauch, F. Tung, C. T. Striebel, AIAA J. 3 (1965) 1445-1450",
            smoother,
        ),
        VaryingMethod(
            "spline",
            "cubic splines, the number of knots chosen by cross-validation",
            "",
            "C. de Boor, A Practical Guide to Splines (1978)",
            spline,
        ),
        VaryingMethod(
            "emg",
            "linear in the EMG amplitudes of flexor and extensor",
            "amplitude",
            "Ruiz (2011), eq. (4)",
            scheduled,
        ),
    )
}

DEFAULT_VARYING: Final = "smoother"


def varying_method_named(name: str) -> VaryingMethod:
    """Look up a method.

    Raises
    ------
    InputError
        If there is none of that name; lists those that there are.
    """
    return look_up(VARYING_METHODS, name, "method")
