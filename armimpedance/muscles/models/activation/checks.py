"""What rows must be for an activation model, and where a fitted one cannot be a muscle's."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.limb.arm import MuscularArm
from armimpedance.muscles.models.activation.design import powers
from armimpedance.muscles.models.activation.equations import ActivationEquations
from armimpedance.muscles.models.hand_rows import HandRows
from armimpedance.muscles.models.quality import ElementQuality
from armimpedance.muscles.models.rows import JointRows

#: Joint angles (rad) within this of their median are one posture: moment arms change by some per
#: cent over .1 rad, less than they are known.
ONE_POSTURE_RAD = 0.05
#: Stiffness of an arm's joint lies between these (median of shoulder and elbow, N m/rad): a relaxed
#: elbow has .4 and more, an arm that holds a load some hundreds.
PLAUSIBLE = (0.05, 2000.0)
#: Points of the measured range at which a muscle's curve is looked at.
_POINTS = 101


def check_activation(rows: JointRows | HandRows, arm: MuscularArm, *, torque: bool) -> FloatArray:
    """Activations (P, m) of the arm's muscles.

    Raises
    ------
    InputError
        No activation, another number of muscles than the arm, no torque where it is asked for.
    """
    muscles = arm.paths.muscles
    if rows.activation is None:
        raise InputError("rows without activation", expected=f"columns alpha_1..{len(muscles)}")
    if rows.activation.shape[1] != len(muscles):
        raise InputError(
            f"activations of {rows.activation.shape[1]} muscles",
            expected=f"{len(muscles)}, those of the arm {arm.name}: {', '.join(muscles)}",
        )
    if rows.activation_sd is not None and rows.activation_sd.shape != rows.activation.shape:
        raise InputError(f"activation_sd of shape {rows.activation_sd.shape}")
    if rows.activation_sd is not None and (rows.activation_sd < 0).any():
        raise InputError("a negative activation_sd", expected="0 or more")
    if torque and rows.torque is None:
        raise InputError(
            "torque asked for, but the rows have none", expected="rows with tau = J^T F"
        )
    return rows.activation


def check_rows(rows: JointRows, arm: MuscularArm, *, torque: bool) -> tuple[FloatArray, FloatArray]:
    """Activations (P, m) and the one posture (2,), the mean of all rows.

    Raises
    ------
    InputError
        The same cases as in `check_activation`, or several postures.
    """
    rows.require_planar()
    activation = check_activation(rows, arm, torque=torque)
    median = np.median(rows.joint_angles, axis=0)
    off = np.abs(rows.joint_angles - median).max(axis=1)
    if (off > ONE_POSTURE_RAD).any():
        named = [rows.labels[i] for i in np.flatnonzero(off > ONE_POSTURE_RAD)]
        shown = ", ".join(named[:5]) + (f" and {len(named) - 5} more" if len(named) > 5 else "")
        raise InputError(
            f"more than one posture: {shown} up to {off.max():.2g} rad from the others",
            expected=f"rows within {ONE_POSTURE_RAD} rad",
        )
    return activation, rows.joint_angles.mean(axis=0)


def plausible_size(K: FloatArray) -> Finding:
    """Whether ``ss, se, ee`` (P, 3) of the stiffness are of the size that an arm can have."""
    size = float(np.median(K[:, [0, 2]]))
    low, high = PLAUSIBLE
    if low <= size <= high:
        return Finding("units", "ok", f"K of {size:.3g} N m/rad (median) is an arm's")
    said = (
        f"K of {size:.3g} N m/rad (median of shoulder and elbow) is no arm's: the unit, or the sign"
    )
    return Finding("units", "warning", said)


def falling_muscles(
    theta: FloatArray,
    reach: FloatArray,
    muscles: tuple[str, ...],
    equations: ActivationEquations,
) -> tuple[str, ...]:
    """Warnings for muscles whose stiffness falls below what it is at their least activation.

    Whether it is then negative depends on the constant part, which the data do not tell.

    Parameters
    ----------
    theta : (3 + m N, ...)
    reach : (m, 2)
        Measured range of activation.
    """
    N = equations.order
    c = theta[3 : 3 + equations.n_active].reshape(-1, N)
    alpha = np.linspace(reach[:, 0], reach[:, 1], _POINTS)
    f = (powers(alpha, N) * c).sum(axis=-1)
    rise = f - f[0]
    size = np.abs(rise).max(axis=0)
    found = []
    for i in np.flatnonzero(rise.min(axis=0) < -1e-6 * np.maximum(size, 1e-12)):
        low = alpha[rise[:, i] < 0, i]
        found.append(
            f"{muscles[i]}: its stiffness falls with activation, by up to "
            f"{-rise[:, i].min():.3g} N/m between {low[0]:.3g} and {low[-1]:.3g}"
        )
    return tuple(found)


def unpredicted(quality: tuple[ElementQuality, ...]) -> tuple[str, ...]:
    """A warning that names elements whose left-out rows are predicted no better than noise."""
    lost = [q.element for q in quality if q.leave_one_out_r <= q.null_r]
    if not lost:
        return ()
    said = f"{', '.join(lost)}: rows left out are predicted no better than noise would be"
    return (f"{said}; is the arm the right one?",)
