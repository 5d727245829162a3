"""Moment arms over posture and muscles' stiffness over activation, as `predict` writes them."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from armimpedance.core.errors import InputError

if TYPE_CHECKING:
    from armimpedance.core.arrays import FloatArray

JOINTS = ("shoulder", "elbow")
#: Joints of an arm in space and others are numbered.
NUMBERED = ("1", "2", "3", "4", "5", "6", "7")
#: An angle this far beyond the range is still inside (rounding in a file).
_EDGE_RAD = 1e-6


def moment_arm_rows(args: argparse.Namespace) -> tuple[list[dict[str, Any]], int]:
    """Moment arms at postures, OpenSim's sign: ``r = -dL/dq``, m.

    Parameters
    ----------
    args : Namespace
        `model`: an arm's name, its table, or a model of muscles; `postures`; `joint`.

    Returns
    -------
    rows : list of mappings
        Angles and ``r_<joint>_<muscle>_m``; for one joint the muscles alone, as OpenSim's analysis.
    outside : int
        Postures that the arm is not known at.

    Raises
    ------
    InputError
        A file cannot be read, or the model holds no moment arms of single muscles.
    """
    import numpy as np

    from armimpedance.muscles.models import angle_columns
    from armimpedance.muscles.show.prediction_csv import read_postures

    q = read_postures(args.postures)
    muscles, lengthening, limits = _moment_arms(args.model, q)
    n = q.shape[1]
    joints = JOINTS if n == len(JOINTS) else NUMBERED[:n]
    if args.joint is not None and args.joint not in joints:
        problem = f"--joint {args.joint} of an arm of {n} joints"
        raise InputError(problem, expected=" or ".join(joints))
    arms = -lengthening
    beyond = np.maximum(limits[:, 0] - q, q - limits[:, 1]).max(axis=1)
    outside = [float(angle) > _EDGE_RAD for angle in beyond]
    if args.joint is not None:
        column = joints.index(args.joint)
        rows = [dict(zip(muscles, row, strict=True)) for row in arms[..., column].tolist()]
        return rows, sum(outside)
    names = [f"r_{joint}_{muscle}_m" for joint in joints for muscle in muscles]
    rows = [
        {
            **dict(zip(angle_columns(n), angles.tolist(), strict=True)),
            **dict(zip(names, row.T.ravel().tolist(), strict=True)),
            "extrapolated": int(far),
        }
        for angles, row, far in zip(q, arms, outside, strict=True)
    ]
    return rows, sum(outside)


def _moment_arms(source: Path, q: FloatArray) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Muscles, ``dL/dq`` (P, m, 2), and the range (2, 2) of each angle that it holds for, rad."""
    from armimpedance.limb.arm import arm_named
    from armimpedance.muscles.models import MuscleModel, read_model

    def checked(joints: int) -> None:
        if q.shape[1] != joints:
            problem = f"postures of {q.shape[1]} joints"
            raise InputError(problem, expected=f"{joints}, as {source.name}")

    if source.suffix != ".json":
        arm = arm_named(str(source))
        checked(arm.paths.joints)
        return arm.paths.muscles, arm.paths.moment_arms(q), arm.angle_range
    model = read_model(source)
    if not isinstance(model, MuscleModel):
        expected = "a model of the kind muscles, an arm's name or a table of moment arms"
        raise InputError("no moment arms of single muscles", file=source, expected=expected)
    checked(len(model.box))
    return model.muscles, model.paths.moment_arms(q), model.box


def muscle_rows(args: argparse.Namespace) -> list[dict[str, Any]]:
    """Stiffness of each muscle at activations, N/m.

    Parameters
    ----------
    args : Namespace
        `model`: a fitted model of single muscles; `activations`.

    Returns
    -------
    list of mappings
        ``alpha_i``, then ``K_<muscle>_N_per_m``; with ``sd_`` where the model tells it. A model of
        one posture tells what activation adds, then they are ``dK_<muscle>_N_per_m``.

    Raises
    ------
    InputError
        A file cannot be read, or the model has no single muscles.
    """
    from armimpedance.muscles.models import ActivationModel, MuscleModel, read_model
    from armimpedance.muscles.show.prediction_csv import read_activations

    model = read_model(args.model)
    if not isinstance(model, ActivationModel | MuscleModel):
        expected = "a model of the kind activation or muscles"
        raise InputError("no single muscles", file=args.model, expected=expected)
    alpha = read_activations(args.activations, len(model.muscles))
    symbol = "dK" if isinstance(model, ActivationModel) else "K"
    names = [f"{symbol}_{muscle}_N_per_m" for muscle in model.muscles]
    columns = dict(zip(names, model.muscle_stiffness(alpha).T, strict=True))
    if isinstance(model, ActivationModel):
        sds = model.muscle_stiffness_sd(alpha).T
        columns |= {f"sd_{name}": sd for name, sd in zip(names, sds, strict=True)}
    known = {f"alpha_{i}": a for i, a in enumerate(alpha.T, start=1)} | columns
    return [{name: float(values[p]) for name, values in known.items()} for p in range(len(alpha))]
