"""Check that inertia and stiffness of a joint or hand are possible; a wrong unit makes them not."""

from __future__ import annotations

from typing import Final, Literal, NamedTuple

import numpy as np

from armimpedance.core.errors import EstimationError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.findings import Finding

#: Standard errors by which a number must lie outside the limits.
SURE: Final = 3.0


class _Size(NamedTuple):
    """Possible range of a quantity at any human joint, in its unit."""

    unit: str
    low: float
    high: float


Quantity = Literal["inertia", "stiffness at rest"]

#: Inertia about a joint from a wrist to a hip; a relaxed elbow's stiffness is .5 to 3 N m/rad.
SIZES: Final[dict[Quantity, _Size]] = {
    "inertia": _Size("kg m^2", 3e-4, 10.0),
    "stiffness at rest": _Size("N m/rad", 0.0, 300.0),
}


#: Range about the value expected from a person's size: bodies differ by 20 to 40 %, and a cuff and
#: a handle add inertia.
BY_SIZE: Final = (1 / 4, 8.0)


def check_joint_size(
    quantity: Quantity, value: float, sd: float, expected: float | None = None
) -> Finding:
    """Check that a fitted number is possible for a human joint.

    An error smaller than the distance to the limits is not detected: ``smallest`` states the
    smallest factor that would be.

    Parameters
    ----------
    quantity : {"inertia", "stiffness at rest"}
    value : float
        kg m^2 or N m/rad.
    sd : float
        Its standard error.
    expected : float, optional
        The value expected from the person's size; the limits are then a few times less and more.

    Returns
    -------
    Finding
        "units".

    Examples
    --------
    >>> from armimpedance.numerics.criticism import check_joint_size
    >>> check_joint_size("inertia", 70.0, 1.0).verdict
    'warning'
    """
    size, whose = SIZES[quantity], "of no joint of a person"
    if expected is not None:
        low, high = (part * expected for part in BY_SIZE)
        size = _Size(size.unit, float(f"{low:.2g}"), float(f"{high:.2g}"))
        whose = f"of no limb of this person, where some {expected:.2g} are likely"
    text = f"{quantity} {value:.3g} {size.unit}"
    if size.low <= value + SURE * sd and value - SURE * sd <= size.high:
        inside = min(max(value, size.low), size.high)
        away = [size.high / inside] if inside else []
        away += [inside / size.low] if size.low else []
        return Finding("units", "ok", text, f"a factor of {_short(min(away))}" if away else "")
    limits = f"{size.low:g} to {size.high:g}" if size.low else f"below {size.high:g}"
    return Finding(
        "units",
        "warning",
        f"{text} is that {whose} ({limits}): torque in N m and angle in rad are expected; check "
        "the units (kgf m, mNm, degrees), and the mass and the length that were stated",
    )


#: Limits of the mean inertia along the axes per body mass. For the hand of seated adults it is .02
#: to .03 (simulated arms after Winter, every posture); with forces in kgf it is a tenth of that.
PER_BODY_MASS: Final = (0.006, 0.1)
#: Limits if the body's mass is not known, kg: from a child's arm to a very large person's.
HAND_INERTIA: Final = (0.22, 10.0)


def check_hand_size(mean: float, error: float, mass_kg: float | None) -> Finding:
    """Check that a fitted inertia is possible for a human hand.

    Parameters
    ----------
    mean : float
        Mean of the inertia over the axes, kg.
    error : float
        Its standard error.
    mass_kg : float or None
        Mass of the person's body, if it is stated.

    Returns
    -------
    Finding
        "units"; unusable if it is not possible.

    Examples
    --------
    >>> from armimpedance.numerics.criticism import check_hand_size
    >>> check_hand_size(1300.0, 10.0, 65.0).verdict
    'unusable'
    """
    low, high = HAND_INERTIA
    whose = "any limb's"
    if mass_kg is not None:
        low, high = (mass_kg * share for share in PER_BODY_MASS)
        whose = f"that of a hand of a body of {mass_kg:g} kg"
    text = f"mean inertia {mean:.3g} kg, {whose} {low:.2g} to {high:.2g}"
    if low <= mean + SURE * error and mean - SURE * error <= high:
        factor = max(mean / low, high / mean)
        return Finding("units", "ok", text, smallest=f"a factor of {factor:.2g}")
    hint = "N and m are expected: check the units of force and position"
    return Finding("units", "unusable", f"{text}: {hint}")


def refuse_size(one: ImpedanceEstimate, mass_kg: float | None) -> None:
    """Refuse an estimate whose inertia must be in another unit than stated.

    Parameters
    ----------
    one : ImpedanceEstimate
    mass_kg : float or None
        Mass of the person's body, if it is stated.

    Raises
    ------
    EstimationError
        No human hand or joint has such an inertia.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from armimpedance.numerics.criticism import refuse_size
    >>> from manipulandum_sim.hand import simulate
    >>> hand = ai.estimate(simulate("cocontraction", seed=1, conditions=["cocontraction_20"])[0])
    >>> refuse_size(hand.estimates[0], 65.0)
    """
    inertias, sd = np.diag(one.inertia), np.diag(one.sd[0])
    if one.level == "hand":
        largest = float(np.sqrt(np.diag(one.covariance)[: one.k**2].max()))
        _refuse(check_hand_size(float(inertias.mean()), largest, mass_kg))
        return
    for inertia, error in zip(inertias, sd, strict=True):
        refuse_joint_size(float(inertia), float(error))


def refuse_joint_size(inertia: float, sd: float) -> None:
    """Refuse a joint whose inertia must be in another unit than stated.

    Parameters
    ----------
    inertia : float
        kg m^2.
    sd : float
        Its standard error.

    Raises
    ------
    EstimationError
        No human joint has such an inertia.

    Examples
    --------
    >>> from armimpedance.numerics.criticism import refuse_joint_size
    >>> refuse_joint_size(0.07, 0.001)
    """
    _refuse(check_joint_size("inertia", inertia, sd))


def _refuse(size: Finding) -> None:
    if size.verdict != "ok":
        raise EstimationError(size.sentence)


def _short(factor: float) -> str:
    """Text of a factor with two digits and no exponent."""
    return f"{factor:.0f}" if factor >= 10 else f"{factor:.2g}"
