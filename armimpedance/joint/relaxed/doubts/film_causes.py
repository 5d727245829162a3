"""What makes a filmed swing unlike the model: its clock, the limb's mass, the file's axes."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.special import chdtri

from armimpedance.core.errors import ArmImpedanceError
from armimpedance.joint.relaxed.doubts.cause import LEVEL, SEEN, Cause, Inquiry
from armimpedance.joint.relaxed.doubts.evidence import WEIGHT_COLUMNS, WhiteFit, swing_evidence
from armimpedance.joint.relaxed.samples import PassiveSamples

#: Sd of the weight's moment over the inertia between tables of a forearm with hand, a fraction.
TABLE_RATIO_SD: Final = 0.08
#: Gravity over inertia below which no clock is to blame: a rate told .6 times too high or more.
_LEAST_RATIO: Final = 0.4


def clock_and_mass(asked: Inquiry) -> list[Cause]:
    """Gravity against inertia: the clock of the film, or where the limb's mass sits.

    They do the same to the motion; what tables of limbs allow speaks for the one or the other.
    """
    fit, alone, gain = asked.ask([WEIGHT_COLUMNS[2]])
    more, error = float(fit.values[-1]), float(np.sqrt(fit.covariance[-1, -1]))
    ratio = max(1 + more, 0.0)
    gain = gain if ratio > _LEAST_RATIO else 0.0
    # a film whose rate is told r too high shows accelerations r^2 as large, and gravity stays
    time = (
        f"gravity pulls {ratio:.3f} +- {error:.1g} times as strongly as inertia and frames "
        f"allow: the film's rate is {100 * (np.sqrt(ratio) - 1):+.1f} % off; film a clock or a "
        f"ball that falls; with the rate mended k is {_part(fit.values[0], ratio):.3g} N m/rad"
    )
    mass = (
        f"the limb's inertia about the joint, over its weight's moment, is {_part(1.0, ratio):.3g} "
        f"+- {error:.1g} of the skeleton's, which tables give to {100 * TABLE_RATIO_SD:g} %: let "
        "the limb swing by gravity alone, or scale the segment to the person; k goes with it"
    )
    known = gain - (more / TABLE_RATIO_SD) ** 2
    fits, price = (fit, alone), asked.price
    rate, share = f"a rate {50 * SEEN * error:.2g} % off", f"{100 * SEEN * error:.2g} %"
    fine = "gravity pulls as the skeleton's inertia and the frames' times tell"
    return [
        Cause("time", gain, 1, price, time, fine, rate, *fits),
        Cause("inertia", known, 1, price, mass, fine, share, *fits),
    ]


def axes_of_file(samples: PassiveSamples, asked: Inquiry) -> Cause:
    """The weight along another axis than z, by the mass that the skeleton has."""
    tried = {up: asked.ask(known=_turned_weight(up)) for up in ("x", "-x", "y", "-y", "-z")}
    up = max(tried, key=lambda one: tried[one][2])
    if tried[up][2] > chdtri(1, LEVEL):
        # these rows are linear about the motion of a limb that z pulls: fit the others' own
        own = {up: _pointing(samples, asked, up) for up, one in tried.items() if one[2] > 0}
        tried = {up: one for up, one in own.items() if one is not None} or tried
        up = max(tried, key=lambda one: tried[one][2])
    fit, alone, gain = tried[up]
    return Cause(
        "up axis",
        gain,
        1,
        asked.price,
        f"the limb swings as if {up} pointed up, and not z as the file was read: name the axes "
        "that point forward, left and up where the file is converted (--axes); k is then "
        f"{fit.values[0]:.3g} N m/rad",
        "the limb's weight pulls along -z",
        "a quarter of a turn",
        fit,
        alone,
    )


def _turned_weight(up: str) -> dict[str, float]:
    """Sizes of the weight's columns that take it off along z and put it on along another axis."""
    sizes = dict.fromkeys(WEIGHT_COLUMNS, 0.0)
    sizes[WEIGHT_COLUMNS["xyz".index(up[-1])]] = -1.0 if up.startswith("-") else 1.0
    sizes[WEIGHT_COLUMNS[2]] -= 1.0
    return sizes


def _pointing(
    samples: PassiveSamples, asked: Inquiry, up: str
) -> tuple[WhiteFit, WhiteFit, float] | None:
    """The fits of a limb whose weight pulls along another axis, and the gain; None: none found."""
    try:
        evidence = swing_evidence(samples.pointing(up), asked.terms)
    except ArmImpedanceError:
        return None
    fit, alone = (evidence.fit(asked.terms.columns, slow=slow) for slow in (True, False))
    return fit, alone, asked.base.deviance - fit.deviance


def _part(whole: float, ratio: float) -> float:
    return float(whole / ratio) if ratio > 0 else float("nan")
