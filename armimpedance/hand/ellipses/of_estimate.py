"""The ellipse of an estimate: at the hand counted from the line shoulder -> hand."""

from __future__ import annotations

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses.geometry import Ellipse, NotPositiveDefiniteError, Which, ellipse


def ellipse_of(
    estimate: ImpedanceEstimate, which: Which, *, with_handle: bool = False
) -> Ellipse | None:
    """The ellipse of an estimate's stiffness, viscosity or inertia.

    At the hand the orientation counts from the line shoulder -> hand (from +x where the hand's
    position is not known; `reference_angle_rad` of the result tells), at the joints from the
    first joint's axis.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        Estimate with two axes, at the hand or at the joints.
    which : {"inertia", "viscosity", "stiffness"}
        Matrix whose ellipse is wanted.
    with_handle : bool
        Take the inertia as measured, with the mass between sensor and hand.

    Returns
    -------
    Ellipse or None
        The ellipse with the estimate's covariance. None for an estimate with other than two axes,
        or where the matrix' symmetric part is not positive definite.

    Raises
    ------
    InputError
        Unknown `which`.

    Examples
    --------
    >>> from armimpedance.hand.still.show import estimate
    >>> from armimpedance.hand.ellipses import ellipse_of
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> stiffness = ellipse_of(estimate(recording)[0], "stiffness")
    >>> stiffness.semi_major > stiffness.semi_minor > 0
    True
    """
    blocks = {"inertia": 0, "viscosity": 1, "stiffness": 2}
    if which not in blocks:
        raise InputError(f"no such matrix: {which!r}", expected=", ".join(blocks))
    if estimate.k != 2:
        return None
    name = "inertia_with_handle" if with_handle and which == "inertia" else which
    block = slice(4 * blocks[which], 4 * blocks[which] + 4)
    try:
        return ellipse(
            getattr(estimate, name),
            reference_angle_rad=_reference_angle(estimate),
            covariance=estimate.covariance[block, block],
            dof=estimate.dof,
        )
    except NotPositiveDefiniteError:
        return None


def _reference_angle(estimate: ImpedanceEstimate) -> float:
    if estimate.level != "hand" or estimate.position is None:
        return 0.0
    shoulder = np.zeros(2) if estimate.shoulder_m is None else estimate.shoulder_m
    line = estimate.position[:2] - shoulder[:2]
    return float(np.arctan2(line[1], line[0]))
