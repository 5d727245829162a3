"""Where models over posture and over activation extrapolate, and how sure they are elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.limb.arm import TwoLinkArm, arm_named, arm_of
from armimpedance.muscles.models import (
    ActivationModel,
    HandPrediction,
    PostureModel,
    at_hand,
    fit_activation_model,
    fit_posture_model,
)
from armimpedance.muscles.show import half_width_surface, plot_map
from armimpedance.show.plots import TWO_COLUMNS_IN, Surface, new_figure, print_style
from armimpedance_figures.source_figure import SourceFigure, design, script
from armimpedance_figures.tsuji1997.over_activation import MOMENT_ARMS
from armimpedance_figures.tsuji1997.rows import rows_of
from armimpedance_figures.tsuji1997.study import StudiedExperiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Borders of the colours, % of the size.
LEVELS = (0, 2, 4, 6, 8, 10, 15, 20, 30)
#: Elbow angles (rad) nearer to straight or folded are not drawn: the hand's stiffness has no end.
ELBOW_RAD = (0.35, 2.6)
SHOULDER_RAD = (-0.35, 2.1)
#: Points along each side of both maps.
COUNT = 81
#: Beyond the measured co-contraction and force, as a part of them.
BEYOND = 0.4


@dataclass(frozen=True)
class Extrapolation:
    """A model over posture, one over activation, and the lines on which activation was measured.

    Attributes
    ----------
    posture : PostureModel
        The highest order that the postures allow.
    activation : ActivationModel
    levels, at_level : (C,), (C, m)
        Co-contraction as a part of the MVC, and the activations measured.
    forces, at_force : (F,), (F, m)
        Hand force along y, N, and the activations measured.
    """

    studied: tuple[StudiedExperiment, ...]
    arm: TwoLinkArm
    posture: PostureModel
    activation: ActivationModel
    levels: FloatArray
    at_level: FloatArray
    forces: FloatArray
    at_force: FloatArray


def fit(*studied: StudiedExperiment) -> Extrapolation:
    """From experiments 1, 2 and 3 of one subject."""
    postures, cocontraction, force = studied
    levels, at_level = _line(cocontraction, "target_activation")
    forces, at_force = _line(force, "target_force_y_N", "target_force_x_N")
    # no force is the co-contraction experiment's rest
    first = int(np.searchsorted(forces, 0.0))
    forces = np.insert(forces, first, 0.0)
    at_force = np.insert(at_force, first, at_level[0], axis=0)
    return Extrapolation(
        studied,
        arm_of(postures.subject),
        _posture_model(postures),
        fit_activation_model(rows_of(cocontraction, force), arm_named(MOMENT_ARMS), order=1),
        *(levels, at_level, forces, at_force),
    )


def _posture_model(studied: StudiedExperiment) -> PostureModel:
    rows = rows_of(studied)
    for order in (2, 1):
        try:
            return fit_posture_model(rows, order=order)
        except ArmImpedanceError:
            continue
    return fit_posture_model(rows, order=0)


def _line(
    studied: StudiedExperiment, column: str, zero: str | None = None
) -> tuple[FloatArray, FloatArray]:
    """Targets and measured activations, the targets rising; only where `zero` is (nearly) none."""
    table = studied.trials.drop_duplicates("condition").set_index("condition")
    found = {
        float(table.loc[e.keys["condition"], column]): e.activation
        for e in studied.hand
        if zero is None or abs(float(table.loc[e.keys["condition"], zero])) < 1e-6
    }
    if len(found) < 2 or any(alpha is None for alpha in found.values()):
        raise InputError(f"fewer than two conditions along {column}", expected="two or more")
    targets = np.array(sorted(found))
    return targets, np.array([found[t] for t in targets])


def activation_at(fits: Extrapolation, level: FloatArray, force: FloatArray) -> FloatArray:
    """Activations (P, m) of co-contraction and hand force together, 0..1.

    Each line is interpolated between its measured conditions and goes on straight beyond them;
    what both add to rest is summed. On the lines themselves it is what was measured.
    """
    rest = _along(fits.levels, fits.at_level, np.zeros(1))
    both = _along(fits.levels, fits.at_level, level) + _along(fits.forces, fits.at_force, force)
    return np.clip(both - rest, 0.0, 1.0)


def _along(targets: FloatArray, activation: FloatArray, at: FloatArray) -> FloatArray:
    i = np.clip(np.searchsorted(targets, at) - 1, 0, len(targets) - 2)
    part = ((at - targets[i]) / (targets[i + 1] - targets[i]))[:, None]
    return np.asarray((1 - part) * activation[i] + part * activation[i + 1])


def in_workspace(fits: Extrapolation) -> Surface:
    """Half-width over hand positions (m), all that the drawn joint angles reach."""
    arm, model = fits.arm, fits.posture
    s, e = np.linspace(*SHOULDER_RAD, COUNT), np.linspace(*ELBOW_RAD, COUNT)
    q = np.stack(np.meshgrid(s, e), axis=-1).reshape(-1, 2)
    hand = at_hand(model.predict(q), arm)
    x, y = hand.hand_position.T.reshape(2, COUNT, COUNT)
    hull = model.scaling.angles(_finely(model.region.vertices))
    return half_width_surface(hand, x, y, ("x (m)", "y (m)"), arm.hand_position(hull))


def _finely(vertices: FloatArray) -> FloatArray:
    """More points on the sides of a polygon: straight in joint angles is bent at the hand."""
    part = np.linspace(0, 1, 20, endpoint=False)[:, None]
    sides = zip(vertices, np.roll(vertices, -1, axis=0), strict=True)
    return np.concatenate([(1 - part) * start + part * end for start, end in sides])


def over_activation(fits: Extrapolation) -> Surface:
    """Half-width over hand force along y (N) and co-contraction (% MVC)."""
    span = fits.forces[-1] - fits.forces[0]
    force = np.linspace(
        fits.forces[0] - BEYOND * span / 2, fits.forces[-1] + BEYOND * span / 2, COUNT
    )
    level = np.linspace(0, (1 + BEYOND) * fits.levels[-1], COUNT)
    F, c = (each.ravel() for each in np.meshgrid(force, level))
    hand = _hand_at(fits, c, F)
    labels = ("hand force along y (N)", "co-contraction (% MVC)")
    return half_width_surface(hand, force, 100 * level, labels)


def _hand_at(fits: Extrapolation, level: FloatArray, force: FloatArray) -> HandPrediction:
    alpha = activation_at(fits, level, force)
    prediction = fits.activation.predict(alpha)
    return at_hand(prediction, fits.arm, np.stack([np.zeros_like(force), force], axis=1))


def draw(fits: Extrapolation) -> Figure:
    """Workspace at the left, activations at the right, one scale of colours."""
    levels = np.array(LEVELS, dtype=float)
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 3.9)
        left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
        hands = np.array([e.position for e in fits.studied[0].hand])
        plot_map(in_workspace(fits), None, left, levels, bar=False)
        left.plot(*hands.T, "o", color="black", mfc="white", markersize=3.5, mew=0.8)
        left.plot(0, 0, "s", color="black", markersize=6, clip_on=False)
        left.annotate("shoulder", (0, 0), (7, 4), textcoords="offset points")
        left.set_aspect("equal")
        left.set_title("(a) posture, relaxed", loc="left")
        plot_map(over_activation(fits), None, right, levels, bar=False)
        marks = {"color": "black", "mfc": "white", "markersize": 3.5, "mew": 0.8, "zorder": 4}
        right.plot(0 * fits.levels, 100 * fits.levels, "o", clip_on=False, **marks)
        right.plot(fits.forces, 0 * fits.forces, "o", clip_on=False, **marks)
        right.set_title("(b) activation, nominal posture", loc="left")
        bar = figure.colorbar(
            right.collections[0], ax=[left, right], location="bottom", aspect=40, pad=0.03
        )
        bar.set_ticks(levels)
        bar.set_label("95 % interval of the size (± %)")
    return figure


def caption(fits: Extrapolation) -> str:
    """What is shown, where it may be used."""
    return (
        "Where models extrapolate, after the models of Tsuji (1997), section 5, not a figure of "
        "the source. Colour: half-width of the 95 % interval of the predicted size of the hand's "
        "stiffness ellipse, in % of the size; hatched: outside of what was measured, where the "
        "interval rests on the model being right; crosses: no ellipse; dots: measured. (a) Over "
        f"the workspace, from experiment 1 (model '{fits.posture.name}', L = "
        f"{fits.posture.order}); the border is the hull of the measured postures in joint angles, "
        "white is out of the drawn range of the joints. (b) Co-contraction and a hand force along "
        "y together, activations as measured for each alone and then added, from experiments 2 and "
        f"3 (N = {fits.activation.order}). {design(*fits.studied)}. Differs from the source, which "
        "draws its surfaces to the edge of the figure, without intervals."
    )


FIGURE = SourceFigure(
    *("where_models_extrapolate", ("postures", "cocontraction", "force"), "A", draw, caption),
    fit=fit,
)

if __name__ == "__main__":
    script(FIGURE)
