"""Data of the interactive page: models, the person's arm, measured estimates."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, cast

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import MATRICES, group_name
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.records import ImpedanceEstimate, Subject
from armimpedance.hand.levels import kinematic_arm
from armimpedance.hand.levels.show import to_hand, to_joint
from armimpedance.limb.arm import TwoLinkArm
from armimpedance.muscles.models import (
    ActivationModel,
    FittedModel,
    MuscleModel,
    PostureModel,
    Region,
    kind_of,
    triple,
)
from armimpedance.numerics.regression import t_factor
from armimpedance.recordings import read_subject


def model_data(model: FittedModel, title: str) -> dict[str, Any]:
    """A model as plain values, its covariances as lower triangles.

    `title`: what the page calls it.
    Raises InputError: the model is of a kind that the page cannot compute.
    """
    kind = kind_of(model).name
    if kind not in _KINDS:
        raise InputError(f"a {kind} model cannot be explored", expected=" or ".join(_KINDS))
    return {
        "kind": kind,
        "title": title,
        "t": t_factor(model.dof),
        "warnings": list(model.warnings),
        "muscles": [],
        **_KINDS[kind](model),
    }


def lower_triangle(covariance: ArrayLike) -> list[float]:
    """The lower triangle of a symmetric matrix (n, n), row by row."""
    C = np.asarray(covariance, dtype=float)
    rows: list[float] = ((C + C.T) / 2)[np.tril_indices(len(C))].tolist()
    return rows


def _posture(model: PostureModel) -> dict[str, Any]:
    degree = 2 * model.order
    return {
        "box": model.scaling.box.tolist(),
        # the monomials' powers, the lowest degree first, as the model has them
        "exponents": [[d - i, i] for d in range(degree + 1) for i in range(d + 1)],
        "region": _region(model.region),
        **{
            name: {
                "coefficients": made.coefficients.tolist(),
                "covariance": lower_triangle(made.covariance),
            }
            for name, made in (("stiffness", model.stiffness), ("viscosity", model.viscosity))
        },
    }


def _activation(model: ActivationModel) -> dict[str, Any]:
    symmetric = ("stiffness_covariance", "viscosity_covariance", "muscle_covariance", "leverage")
    plain = ("patterns", "viscous_patterns", "stiffness", "viscosity", "joint_angles")
    return {
        "muscles": list(model.muscles),
        "order": model.order,
        "range": model.activation_range.tolist(),
        "leverage_limit": model.leverage_limit,
        **{name: getattr(model, name).tolist() for name in plain},
        **{name: lower_triangle(getattr(model, name)) for name in symmetric},
    }


def _muscles(model: MuscleModel) -> dict[str, Any]:
    plain = ("box", "exponents", "base", "muscle", "change", "highest", "values")
    return {
        "muscles": list(model.muscles),
        "order": model.order,
        "range": [[0.0, high] for high in model.highest.tolist()],
        "curvature": model.curvature,
        "stiffness_per_tension": model.stiffness_per_tension,
        "region": _region(Region(model.measured)),
        **{name: getattr(model, name).tolist() for name in plain},
        "covariance": lower_triangle(model.covariance),
    }


def _region(region: Region) -> dict[str, Any]:
    return {"vertices": region.vertices.tolist(), "tolerance": region.tolerance}


_KINDS: Final = cast(
    dict[str, Callable[[FittedModel], dict[str, Any]]],
    {"moment-arms": _posture, "activation": _activation, "muscles": _muscles},
)

# Whose arm the page shows: a recording's, a stated one, or the one that results betray.

#: Lengths whose hand is this far from where it was measured, m, are not those of the rows.
_APART_M = 0.01
#: Angles whose two directions are nearer to each other do not tell the segments apart.
_WORST_CONDITION = 100.0


@dataclass(frozen=True)
class Owner:
    """Whose arm it is: what `to_joint` asks a recording for, without its samples.

    `said`: where its lengths come from, in words.
    """

    subject: Subject
    said: str = ""
    muscles: tuple[str, ...] | None = None
    gravity_m_s2: tuple[float, ...] | None = None

    @property
    def arm(self) -> TwoLinkArm:
        """The two-link arm, with its gravity."""
        return kinematic_arm(self.subject, self.gravity_m_s2)


def lengths_of(rows: Sequence[ImpedanceEstimate]) -> tuple[float, float] | None:
    """Upper arm and forearm with hand, m, from measured hand positions and joint angles.

    Returns: (float, float) or None: None where too little is said, or no lengths put the hand where
    it was measured.
    """
    known = [
        (row.joint_angles, row.position - row.shoulder_m)
        for row in rows
        if row.joint_angles is not None
        and len(row.joint_angles) == 2
        and row.position is not None
        and row.shoulder_m is not None
        and len(row.position) == 2
    ]
    if not known:
        return None
    q, hand = (np.array(column) for column in zip(*known, strict=True))
    angles = np.stack([q[:, 0], q.sum(axis=1)], axis=-1)
    # X (P, 2) = [cos qs, cos (qs + qe); sin qs, sin (qs + qe)] (P, 2, 2) l (2,)
    A = np.stack([np.cos(angles), np.sin(angles)], axis=1).reshape(-1, 2)
    lengths, _, rank, singular = np.linalg.lstsq(A, hand.ravel(), rcond=None)
    apart = np.abs(A @ lengths - hand.ravel()).max()
    if (
        rank < 2
        or singular[0] > _WORST_CONDITION * singular[1]
        or apart > _APART_M
        or lengths.min() <= 0
    ):
        return None
    return float(lengths[0]), float(lengths[1])


def owner_of(
    rows: Sequence[ImpedanceEstimate],
    recording: str | os.PathLike[str] | Subject | Owner | None,
    upper_arm_m: float | None,
    forearm_hand_m: float | None,
) -> Owner:
    """Whose arm it is: of the recording, with stated lengths, else as the rows tell.

    Raises InputError: the recording cannot be read, or the lengths are not known.
    """
    owner = _recorded(recording)
    who = owner.subject
    if upper_arm_m is not None or forearm_hand_m is not None:
        who = _with_lengths(who, upper_arm_m, forearm_hand_m)
        owner = replace(owner, subject=who, said="as stated")
    if who.height_m is not None or None not in (who.upper_arm_m, who.forearm_hand_m):
        return owner
    lengths = lengths_of(rows)
    if lengths is None:
        raise InputError(
            "the arm's lengths are not known",
            expected="--recording SESSION, or --upper-arm-m and --forearm-hand-m",
        )
    person = _with_lengths(
        replace(who, upper_arm_m=lengths[0], forearm_hand_m=lengths[1]),
        who.upper_arm_m,
        who.forearm_hand_m,
    )
    return replace(owner, subject=person, said="found from hand positions and joint angles")


def _recorded(recording: str | os.PathLike[str] | Subject | Owner | None) -> Owner:
    if isinstance(recording, Owner):
        return recording
    if recording is None:
        return Owner(Subject())
    if isinstance(recording, Subject):
        return Owner(recording, "those of the subject")
    subject = read_subject(recording)
    source = "those of the recording's subject"
    return Owner(subject.subject, source, subject.muscles, subject.gravity_m_s2)


def _with_lengths(who: Subject, upper_arm_m: float | None, forearm_hand_m: float | None) -> Subject:
    """The subject with each of these lengths that is given."""
    upper = who.upper_arm_m if upper_arm_m is None else upper_arm_m
    forearm = who.forearm_hand_m if forearm_hand_m is None else forearm_hand_m
    return replace(who, upper_arm_m=upper, forearm_hand_m=forearm)


# Measured estimates as the page shows them, at the hand and at the joints.

#: Significant digits of measured values: they are shown, not computed with.
_DIGITS = 8
#: Row-major elements (4,) to ss, the mean of se and es, ee.
_FOLD = np.array([[1, 0, 0, 0], [0, 0.5, 0.5, 0], [0, 0, 0, 1]])


def measured_data(
    rows: Sequence[ImpedanceEstimate], owner: Owner
) -> tuple[list[dict[str, Any]], list[str]]:
    """Each estimate at the hand and at the joints, and what is to be said of them.

    `rows`: at the hand or the joints of a two-link arm; others are left out, and said so.
    Raises InputError: None of the rows can be shown.
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
    sentences = [f"{one['name']}: {text}" for one in data if (text := one.pop("said"))]
    if sentences:
        more = f" (and {len(sentences) - 1} more)" if len(sentences) > 1 else ""
        notes.append(f"{sentences[0]}{more}")
    return data, notes


def _row(row: ImpedanceEstimate, owner: Owner) -> dict[str, Any]:
    hand: ImpedanceEstimate
    joint: ImpedanceEstimate
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
    note = next((w for w in joint.warnings if w.startswith(("lengths", "shoulder"))), "")
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
        "said": note,
    }


def _matrices(estimate: ImpedanceEstimate) -> dict[str, Any]:
    matrices = {}
    for i, (name, (symbol, _)) in enumerate(MATRICES.items()):
        covariance = estimate.covariance[4 * i : 4 * i + 4, 4 * i : 4 * i + 4]
        matrices[symbol] = {
            "value": _rounded(triple(getattr(estimate, name))),
            "covariance": _rounded(np.array(lower_triangle(_FOLD @ covariance @ _FOLD.T))),
        }
    return matrices


def _rounded(values: FloatArray) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in np.asarray(values).tolist()]
