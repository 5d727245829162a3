"""What the demo prints: estimates beside the truth, and whether the intervals hold it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import ellipse, ellipse_of
from armimpedance.numerics.regression import t_interval
from armimpedance.show.text import with_half_width

if TYPE_CHECKING:
    from armimpedance_figures.tsuji1997.study import StudiedExperiment

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
        found = np.stack([hand.inertia, hand.viscosity, hand.stiffness])
        symmetric = (found + found.transpose(0, 2, 1)) / 2
        limits = t_interval(hand.parameters, hand.sd.ravel(), hand.dof)
        held = (limits[:, 0] <= true.ravel()) & (true.ravel() <= limits[:, 1])
        posture_error = joint.stiffness - truth.K_j[row]
        without = posture_error + _gamma(each, joint)
        size = np.linalg.norm(truth.K_j[row])
        yield _Compared(
            name,
            hand,
            truth.K_e[row],
            100 * np.linalg.norm(symmetric - true, axis=(1, 2)) / np.linalg.norm(true, axis=(1, 2)),
            held,
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
    held = np.array([one.held for one in everything])
    share = 100 * held.mean()
    yield f"{share:.1f} % of {held.size} elements of M, B and K lie within their 95 % intervals."
    errors = np.array([one.errors_percent for one in everything])
    m, b, k = np.median(errors, axis=0)
    yield f"Median error of M {m:.1f} %, B {b:.1f} %, K {k:.1f} %."
    loaded = [o for o in everything if o.name.startswith("force_2") or o.name.startswith("force_3")]
    if loaded:
        with_term = np.median([o.joint_error_percent for o in loaded])
        without = np.median([o.joint_error_without_force_percent for o in loaded])
        yield f"Joint stiffness, the hand bearing 20 N or more: median error {with_term:.0f} %;"
        yield f"without the force term, as the source maps it, {without:.0f} %."
