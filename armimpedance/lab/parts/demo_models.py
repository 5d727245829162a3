"""The demo's models over posture and activation: fitted, written, compared with the truth."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.limb.arm import arm_named
from armimpedance.muscles.models import (
    FittedModel,
    JointPrediction,
    JointRows,
    fit_activation_model,
    fit_muscle_model,
    fit_posture_model,
    joint_rows,
    matrix,
)
from armimpedance.show.text import aligned_table

if TYPE_CHECKING:
    from armimpedance_figures.tsuji1997.study import StudiedExperiment

#: Postures from which order 2, with its 15 coefficients and standard errors, is fitted.
ENOUGH_FOR_ORDER_2 = 15

_LEGEND = (
    "Medians over the conditions that the model was fitted to, Frobenius norms in % of the true "
    "K_j: error of the estimates, error of the model, half-width of the model's 95 % intervals. A "
    "model pools conditions; what it errs by is much the same in all of them, for it has few "
    "coefficients."
)


@dataclass(frozen=True)
class DemoModel:
    """A model and how it compares with the simulated truth.

    Attributes
    ----------
    name, line : str
        File name without ending, and what it is.
    model : FittedModel or None
        None where these conditions do not determine it.
    problem : str
        Why not.
    estimates_percent, model_percent : float
        Median error of the estimates and of the model, % of the true K_j.
    interval_percent : float
        Median half-width of the model's 95 % intervals, % of the true K_j.
    """

    name: str
    line: str
    model: FittedModel | None = None
    problem: str = ""
    estimates_percent: float = float("nan")
    model_percent: float = float("nan")
    interval_percent: float = float("nan")


def fit_models(studied: Mapping[str, StudiedExperiment]) -> list[DemoModel]:
    """Over posture (experiment 1), over activation (2 and 3), over both (all three)."""
    postures, active = [studied["postures"]], [studied["cocontraction"], studied["force"]]
    order = 2 if len(postures[0].joint) >= ENOUGH_FOR_ORDER_2 else 1
    arm = arm_named("planar6")

    def over_posture(rows: JointRows) -> tuple[Any, JointPrediction]:
        model = fit_posture_model(rows, order=order)
        return model, model.predict(rows.joint_angles)

    def over_activation(rows: JointRows) -> tuple[Any, JointPrediction]:
        model = fit_activation_model(rows, arm, order=1, torque=True)
        return model, model.predict(np.asarray(rows.activation))

    def over_both(rows: JointRows) -> tuple[Any, JointPrediction]:
        model = fit_muscle_model(rows, arm, torque=True)
        return model, model.predict(rows.joint_angles, np.asarray(rows.activation))

    return [
        _judged("posture", f"moment arms, L = {order}, experiment 1", postures, over_posture),
        _judged(
            "activation", "activation, N = 1, torque, experiments 2, 3", active, over_activation
        ),
        _judged("muscles", "posture and activation, all three", postures + active, over_both),
    ]


def _judged(name: str, line: str, studied: Sequence[StudiedExperiment], fit: Any) -> DemoModel:
    rows = joint_rows([e for each in studied for e in each.joint])
    try:
        model, predicted = fit(rows)
    except ArmImpedanceError as error:
        return DemoModel(name, line, problem=str(error))
    true = np.concatenate([_true_stiffness(each) for each in studied])
    half = matrix(predicted.half_width("stiffness"))
    return DemoModel(
        name=name,
        line=line,
        model=model,
        estimates_percent=_median_error(rows.stiffness, true),
        model_percent=_median_error(predicted.stiffness_matrices, true),
        interval_percent=_median_error(true + half, true),
    )


def _true_stiffness(each: StudiedExperiment) -> FloatArray:
    rows = [each.truth.index(str(e.keys["condition"])) for e in each.joint]
    return np.asarray(each.truth.K_j[rows])


def _median_error(given: FloatArray, true: FloatArray) -> float:
    error = np.linalg.norm(given - true, axis=(1, 2)) / np.linalg.norm(true, axis=(1, 2))
    return float(100 * np.median(error))


def models_text(models: Sequence[DemoModel]) -> str:
    """How far estimates and models are from the truth, for the screen."""
    header = ["models of joint stiffness", "estimates, %", "model, %", "95 %, ± %"]
    rows = [
        [m.line, *map(_percent, (m.estimates_percent, m.model_percent, m.interval_percent))]
        for m in models
        if m.model is not None
    ]
    left_out = [f"{m.line}: left out, {m.problem}" for m in models if m.model is None]
    return "\n\n".join([aligned_table(header, rows), textwrap.fill(_LEGEND, 100), *left_out])


def _percent(value: float) -> str:
    return f"{value:.1f}"
