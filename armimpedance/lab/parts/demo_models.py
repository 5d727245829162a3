"""The demo's models over posture and activation: fitted, written, compared with the truth."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.core.shown import with_half_width
from armimpedance.hand.ellipses import ellipse, ellipse_of
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
from armimpedance.numerics.regression import t_interval
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

    `name`, `line`: file name without ending, and what it is.
    `model`: None where these conditions do not determine it.
    `problem`: why not.
    `estimates_percent`, `model_percent`: median error of the estimates and of the model, % of the
    true K_j.
    `interval_percent`: median half-width of the model's 95 % intervals, % of the true K_j.
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
    """Errors of estimates and models against the truth, as text for the screen."""
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


# What the demo prints: estimates beside the truth, and whether the intervals hold it.

#: At most this many conditions of an experiment are printed; the files hold all.
ROWS = 8

HEAD = (
    f"{'':24s} {'error in %':>15s}   {'stiffness K (N/m)':^26s} {'true K':^10s}"
    f"{'orientation (deg)':>21s}\n"
    f"{'condition':24s} {'M':>4s} {'B':>4s} {'K':>5s}   {'major':>12s} {'minor':>13s} "
    f"{'':10s}{'estimate':>12s} {'true':>8s}"
)
LEGEND = """\
Errors are |estimate - truth| / |truth| of the symmetric part (Frobenius); K along its major and
minor axis, orientation from the line shoulder to hand, ± 95 %. The truth comes from the simulated
plant itself, differentiated numerically. Noise and servo are of the size met in laboratories."""


@dataclass(frozen=True)
class _Compared:
    """One condition: errors in % of M, B, K, and which elements' intervals hold the truth."""

    name: str
    estimate: ImpedanceEstimate
    true_stiffness: FloatArray
    errors_percent: FloatArray
    held: np.ndarray
    joint_error_percent: float
    joint_error_without_force_percent: float


def summary(studied: Mapping[str, StudiedExperiment]) -> str:
    """Tables per experiment, then what they show."""
    parts, everything = [], []
    for name, each in studied.items():
        compared = list(_compare(each))
        everything += compared
        parts.append(_table(name, compared))
    return "\n".join([*parts, "", LEGEND, "", *_verdicts(everything)]).lstrip("\n")


def _compare(each: StudiedExperiment) -> Iterator[_Compared]:
    truth = each.truth
    for hand, joint in zip(each.hand, each.joint, strict=True):
        name = hand.keys["condition"]
        row = truth.index(name)
        true = np.stack([truth.M_e[row], truth.B_e[row], truth.K_e[row]])
        estimated = np.stack([hand.inertia, hand.viscosity, hand.stiffness])
        symmetric = (estimated + estimated.transpose(0, 2, 1)) / 2
        limits = t_interval(hand.parameters, hand.sd.ravel(), hand.dof)
        covered = (limits[:, 0] <= true.ravel()) & (true.ravel() <= limits[:, 1])
        posture_error = joint.stiffness - truth.K_j[row]
        without = posture_error + _gamma(each, joint)
        size = np.linalg.norm(truth.K_j[row])
        yield _Compared(
            name,
            hand,
            truth.K_e[row],
            100 * np.linalg.norm(symmetric - true, axis=(1, 2)) / np.linalg.norm(true, axis=(1, 2)),
            covered,
            float(100 * np.linalg.norm(posture_error) / size),
            float(100 * np.linalg.norm(without) / size),
        )


def _gamma(each: StudiedExperiment, joint: ImpedanceEstimate) -> FloatArray:
    """The force term that the mapping subtracted."""
    from armimpedance.hand.levels import arm_posture_for, force_term

    posture, _ = arm_posture_for(joint, each.subject)
    return force_term(posture, joint.force if joint.force is not None else np.zeros(2))


def _table(experiment: str, compared: list[_Compared]) -> str:
    chosen = np.unique(np.linspace(0, len(compared) - 1, min(ROWS, len(compared))).astype(int))
    lines = [f"\n{experiment}: {len(compared)} conditions, {len(chosen)} shown", HEAD]
    lines += [_line(compared[i]) for i in chosen]
    return "\n".join(lines)


def _line(one: _Compared) -> str:
    m, b, k = one.errors_percent
    made = ellipse_of(one.estimate, "stiffness")
    errors = f"{one.name:24s} {m:4.1f} {b:4.1f} {k:5.1f}"
    if made is None:
        return f"{errors}  not positive definite"
    true = ellipse(one.true_stiffness, reference_angle_rad=made.reference_angle_rad)
    sizes = [with_half_width(v, h) for v, h in _axes(one.estimate)]
    low, high = np.rad2deg(made.interval()[1])
    angle = with_half_width(np.rad2deg(made.orientation_rad), (high - low) / 2)
    return (
        f"{errors}   {sizes[0]:>12s} {sizes[1]:>13s} {true.semi_major:5.0f}/{true.semi_minor:<4.0f}"
        f" {angle:>12s} {np.rad2deg(true.orientation_rad):8.1f}"
    )


def _axes(estimate: ImpedanceEstimate) -> list[tuple[float, float]]:
    from armimpedance.hand.show import principal_values

    return [
        (float(v), float(h)) for v, h in zip(*principal_values(estimate, "stiffness"), strict=True)
    ]


def _verdicts(everything: list[_Compared]) -> Iterator[str]:
    covered = np.array([one.held for one in everything])
    share = 100 * covered.mean()
    yield f"{share:.1f} % of {covered.size} elements of M, B and K lie within their 95 % intervals."
    errors = np.array([one.errors_percent for one in everything])
    m, b, k = np.median(errors, axis=0)
    yield f"Median error of M {m:.1f} %, B {b:.1f} %, K {k:.1f} %."
    loaded = [o for o in everything if o.name.startswith("force_2") or o.name.startswith("force_3")]
    if loaded:
        with_term = np.median([o.joint_error_percent for o in loaded])
        without = np.median([o.joint_error_without_force_percent for o in loaded])
        yield f"Joint stiffness, the hand bearing 20 N or more: median error {with_term:.0f} %;"
        yield f"without the force term, as the source maps it, {without:.0f} %."
