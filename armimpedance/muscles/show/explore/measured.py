"""Measured estimates as the page shows them, at the hand and at the joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import MATRICES, group_name
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.levels.show import to_hand, to_joint
from armimpedance.muscles.models import triple
from armimpedance.muscles.show.explore.models import lower_triangle
from armimpedance.muscles.show.explore.whose_arm import Owner
from armimpedance.numerics.regression import t_factor

#: Significant digits of measured values: they are shown, not computed with.
_DIGITS = 8
#: Row-major elements (4,) to ss, the mean of se and es, ee.
_FOLD = np.array([[1, 0, 0, 0], [0, 0.5, 0.5, 0], [0, 0, 0, 1]])


def measured_data(
    rows: Sequence[ImpedanceEstimate], owner: Owner
) -> tuple[list[dict[str, Any]], list[str]]:
    """Each estimate at the hand and at the joints, and what is to be said of them.

    Parameters
    ----------
    rows : sequence of ImpedanceEstimate
        At the hand or the joints of a two-link arm; others are left out, and said so.
    owner : Owner

    Returns
    -------
    data : list of dict
    notes : list of str

    Raises
    ------
    InputError
        None of the rows can be shown.
    """
    data, notes, refused = [], [], []
    for row in rows:
        try:
            data.append(_row(row, owner))
        except ArmImpedanceError as error:
            refused.append(f"{group_name(row.keys)}: {error}")
    if refused and not data:
        raise InputError(
            f"no estimate can be shown; {refused[0]}", expected="rows of the hand or the joints"
        )
    if refused:
        notes.append(f"{len(refused)} of {len(rows)} estimates are left out; {refused[0]}")
    said = [f"{one['name']}: {text}" for one in data if (text := one.pop("said"))]
    if said:
        more = f" (and {len(said) - 1} more)" if len(said) > 1 else ""
        notes.append(f"{said[0]}{more}")
    return data, notes


def _row(row: ImpedanceEstimate, owner: Owner) -> dict[str, Any]:
    if row.level == "muscle" or row.k != 2:
        raise InputError(f"level {row.level} with {row.k} axes", expected="hand or joints in plane")
    # only the subject, the muscles and the gravity of a recording are asked for
    whose = cast(Any, owner)
    if row.level == "hand":
        [hand], [joint] = [row], to_joint([row], recording=whose)
    else:
        [hand], [joint] = to_hand([row], recording=whose), [row]
    if joint.joint_angles is None:
        raise InputError("no joint angles", expected="q_shoulder_rad, q_elbow_rad")
    said = next((w for w in joint.warnings if w.startswith(("lengths", "shoulder"))), "")
    return {
        "name": group_name(row.keys),
        "q": joint.joint_angles.tolist(),
        "force": _rounded(np.zeros(2) if row.force is None else row.force),
        "force_known": row.force is not None,
        "alpha": None if row.activation is None else _rounded(row.activation),
        "muscles": list(row.muscles or owner.muscles or ()),
        "t": t_factor(row.dof),
        "hand": _matrices(hand),
        "joint": _matrices(joint),
        "warnings": len(row.warnings),
        "said": said,
    }


def _matrices(estimate: ImpedanceEstimate) -> dict[str, Any]:
    found = {}
    for i, (name, (symbol, _)) in enumerate(MATRICES.items()):
        covariance = estimate.covariance[4 * i : 4 * i + 4, 4 * i : 4 * i + 4]
        found[symbol] = {
            "value": _rounded(triple(getattr(estimate, name))),
            "covariance": _rounded(np.array(lower_triangle(_FOLD @ covariance @ _FOLD.T))),
        }
    return found


def _rounded(values: FloatArray) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in np.asarray(values).tolist()]
