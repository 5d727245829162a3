"""Causes of a filmed swing that differs from the model: its clock, the limb's mass, the file's
axes.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.special import chdtri

from armimpedance.core.errors import ArmImpedanceError
from armimpedance.joint.relaxed.doubts.cause import LEVEL, SEEN, Cause, Inquiry
from armimpedance.joint.relaxed.doubts.evidence import WEIGHT_COLUMNS, WhiteFit, swing_evidence
from armimpedance.joint.relaxed.samples import PassiveSamples

#: Relative sd of weight's moment over inertia of forearm and hand, between tables.
TABLE_RATIO_SD: Final = 0.08
#: Least gravity over inertia that a wrong clock can explain: a stated rate .6 times too high.
_LEAST_RATIO: Final = 0.4


def clock_and_mass(inquiry: Inquiry) -> list[Cause]:
    """Gravity against inertia: an error of the film's clock, or of the place of the limb's mass.

    Both have the same effect on the motion; the spread of tables of limbs decides between them.
    """
    fit, alone, gain = inquiry.ask([WEIGHT_COLUMNS[2]])
    more, error = float(fit.values[-1]), float(np.sqrt(fit.covariance[-1, -1]))
    ratio = max(1 + more, 0.0)
    gain = gain if ratio > _LEAST_RATIO else 0.0
    # a film whose stated rate is r times too high shows accelerations r^2 times too large
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
    with_table = gain - (more / TABLE_RATIO_SD) ** 2
    fits, price = (fit, alone), inquiry.price
    rate, share = f"a rate {50 * SEEN * error:.2g} % off", f"{100 * SEEN * error:.2g} %"
    fine = "gravity pulls as the skeleton's inertia and the frames' times tell"
    return [
        Cause("time", gain, 1, price, time, fine, rate, *fits),
        Cause("inertia", with_table, 1, price, mass, fine, share, *fits),
    ]


def axes_of_file(samples: PassiveSamples, inquiry: Inquiry) -> Cause:
    """The weight along another axis than z, with the skeleton's mass."""
    tried = {up: inquiry.ask(known=_turned_weight(up)) for up in ("x", "-x", "y", "-y", "-z")}
    up = max(tried, key=lambda result: tried[result][2])
    if tried[up][2] > chdtri(1, LEVEL):
        # these rows are linearised about motion with gravity along z: fit other axes separately
        own = {up: _pointing(samples, inquiry, up) for up, result in tried.items() if result[2] > 0}
        tried = {up: result for up, result in own.items() if result is not None} or tried
        up = max(tried, key=lambda result: tried[result][2])
    fit, alone, gain = tried[up]
    return Cause(
        "up axis",
        gain,
        1,
        inquiry.price,
        f"the limb swings as if {up} pointed up, and not z as the file was read: name the axes "
        "that point forward, left and up where the file is converted (--axes); k is then "
        f"{fit.values[0]:.3g} N m/rad",
        "the limb's weight pulls along -z",
        "a quarter of a turn",
        fit,
        alone,
    )


def _turned_weight(up: str) -> dict[str, float]:
    """Sizes of the weight's columns that remove it along z and add it along another axis."""
    sizes = dict.fromkeys(WEIGHT_COLUMNS, 0.0)
    sizes[WEIGHT_COLUMNS["xyz".index(up[-1])]] = -1.0 if up.startswith("-") else 1.0
    sizes[WEIGHT_COLUMNS[2]] -= 1.0
    return sizes


def _pointing(
    samples: PassiveSamples, inquiry: Inquiry, up: str
) -> tuple[WhiteFit, WhiteFit, float] | None:
    """Fits of a limb whose weight pulls along another axis, and the gain; None if the fit fails."""
    try:
        evidence = swing_evidence(samples.pointing(up), inquiry.terms)
    except ArmImpedanceError:
        return None
    fit, alone = (evidence.fit(inquiry.terms.columns, slow=slow) for slow in (True, False))
    return fit, alone, inquiry.base.deviance - fit.deviance


def _part(whole: float, ratio: float) -> float:
    return float(whole / ratio) if ratio > 0 else float("nan")
