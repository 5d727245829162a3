"""Can a person's joint be of this size? What it is not betrays a unit: mNm, kgf m, degrees."""

from __future__ import annotations

from typing import Final, Literal, NamedTuple

from armimpedance.core.findings import Finding

#: Standard errors by which a number must lie outside.
SURE: Final = 3.0


class _Size(NamedTuple):
    """What a number can be at any joint of a person, in its unit."""

    unit: str
    low: float
    high: float


Quantity = Literal["inertia", "stiffness at rest"]

#: Inertia about a joint from a wrist to a hip; a relaxed elbow's stiffness is .5 to 3 N m/rad.
SIZES: Final[dict[Quantity, _Size]] = {
    "inertia": _Size("kg m^2", 3e-4, 10.0),
    "stiffness at rest": _Size("N m/rad", 0.0, 300.0),
}


#: What a person's size leaves open: bodies differ by a fifth or two, a cuff and a handle add.
BY_SIZE: Final = (1 / 4, 8.0)


def check_joint_size(
    quantity: Quantity, value: float, sd: float, expected: float | None = None
) -> Finding:
    """Whether a fitted number can be that of a person's joint.

    A violation by less than the distance to the limits is not seen: ``smallest`` says which factor
    would have been.

    Parameters
    ----------
    quantity : {"inertia", "stiffness at rest"}
    value : float
        kg m^2 or N m/rad.
    sd : float
        Its standard error.
    expected : float, optional
        What the person's size makes likely; the limits are then a few times less and more.

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
    told = f"{quantity} {value:.3g} {size.unit}"
    if size.low <= value + SURE * sd and value - SURE * sd <= size.high:
        inside = min(max(value, size.low), size.high)
        away = [size.high / inside] if inside else []
        away += [inside / size.low] if size.low else []
        return Finding("units", "ok", told, f"a factor of {_short(min(away))}" if away else "")
    limits = f"{size.low:g} to {size.high:g}" if size.low else f"below {size.high:g}"
    return Finding(
        "units",
        "warning",
        f"{told} is that {whose} ({limits}): torque in N m and angle in rad are expected; check "
        "the units (kgf m, mNm, degrees), and the mass and the length that were stated",
    )


def _short(factor: float) -> str:
    """Two digits, and no exponent."""
    return f"{factor:.0f}" if factor >= 10 else f"{factor:.2g}"
