"""Models of joint impedance in pictures: over posture, over activation, against measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.limb.arm import TwoLinkArm
from armimpedance.muscles.models import ActivationModel, HandPrediction, PostureModel, at_hand
from armimpedance.muscles.show.maps_plot import (
    EllipseField,
    Predicted,
    mean_axis_deg,
    measured_field,
    plot_map,
    predicted_field,
    turned_near,
)
from armimpedance.show.plots import (
    TWO_COLUMNS_IN,
    MeasuredPoints,
    Surface,
    new_figure,
    plot_surface,
    print_style,
)

#: Of an ellipse: what is drawn, in this order.
PARAMETERS: Final = ("size", "orientation_deg", "shape")
_LABELS: Final = MappingProxyType(
    {
        "stiffness": ("size (10⁴ N²/m²)", "orientation (deg)", "shape (minor/major)"),
        "viscosity": ("size (N² s²/m²)", "orientation (deg)", "shape (minor/major)"),
    }
)
_FACTOR: Final = MappingProxyType({"stiffness": 1e-4, "viscosity": 1.0})
#: Part of the measured range by which a surface goes beyond it.
_ROOM: Final = 0.06


def posture_surfaces(
    model: PostureModel, arm: TwoLinkArm, which: Predicted, *, count: int = 49
) -> dict[str, Surface]:
    """Size, orientation and shape of the hand's ellipses over both joint angles (deg).

    Parameters
    ----------
    model : PostureModel
    arm : TwoLinkArm
        The arm of the subject.
    which : {"stiffness", "viscosity"}
    count : int
        Points along each angle.

    Returns
    -------
    mapping of str to Surface
        By the names `PARAMETERS`.
    """
    corners = model.scaling.angles([[-1 - _ROOM] * 2, [1 + _ROOM] * 2])
    s, e = (np.linspace(low, high, count) for low, high in corners.T)
    q = np.stack(np.meshgrid(s, e), axis=-1).reshape(-1, 2)
    hand = at_hand(model.predict(q), arm)
    labels = ("shoulder (deg)", "elbow (deg)")
    hull = np.rad2deg(model.scaling.angles(model.region.vertices))
    return _surfaces(hand, which, np.rad2deg(s), np.rad2deg(e), labels, hull)


def posture_points(
    model: PostureModel,
    arm: TwoLinkArm,
    estimates: Sequence[ImpedanceEstimate],
    which: Predicted,
) -> dict[str, MeasuredPoints]:
    """The measured ellipses of the hand, each beside what the model says of its posture.

    Parameters
    ----------
    model : PostureModel
    arm : TwoLinkArm
        The arm of the subject.
    estimates : sequence of ImpedanceEstimate
        Estimates at the hand, with joint angles.
    which : {"stiffness", "viscosity"}

    Returns
    -------
    mapping of str to MeasuredPoints
        By the names `PARAMETERS`.

    Raises
    ------
    InputError
        An estimate of another level, or without joint angles.
    """
    measured = _scaled(measured_field(estimates, which), which)
    if any(e.joint_angles is None for e in estimates):
        raise InputError("an estimate without joint angles", expected="a known posture")
    q = np.array([e.joint_angles for e in estimates])
    predicted = _scaled(predicted_field(at_hand(model.predict(q), arm), which), which)
    centre = mean_axis_deg(measured["orientation_deg"])
    for field in (measured, predicted):
        field["orientation_deg"] = turned_near(field["orientation_deg"], centre)
    s, e = np.rad2deg(q).T
    return {name: MeasuredPoints(s, e, measured[name], predicted[name]) for name in PARAMETERS}


def activation_surfaces(
    model: ActivationModel,
    arm: TwoLinkArm,
    which: Predicted,
    *,
    along_x: Sequence[int],
    along_y: Sequence[int],
    others: float,
    reach: ArrayLike,
    labels: tuple[str, str],
    count: int = 49,
) -> dict[str, Surface]:
    """Size, orientation and shape of the hand's ellipses over two activations in %.

    Parameters
    ----------
    model : ActivationModel
    arm : TwoLinkArm
    which : {"stiffness", "viscosity"}
    along_x, along_y : sequence of int
        Muscles (from 0) that share each of the two activations.
    others : float
        Activation of all other muscles, 0..1.
    reach : (2,)
        Largest activation along x and y, 0..1.
    labels : (str, str)
        Labels of the axes.
    count : int
        Points along each axis.

    Returns
    -------
    mapping of str to Surface
        By the names `PARAMETERS`.
    """
    x_end, y_end = np.asarray(reach, dtype=float)
    x, y = np.linspace(0, x_end, count), np.linspace(0, y_end, count)
    over = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    alpha = np.full((len(over), len(model.muscles)), others)
    alpha[:, list(along_x)] = over[:, :1]
    alpha[:, list(along_y)] = over[:, 1:]
    hand = at_hand(model.predict(alpha), arm)
    return _surfaces(hand, which, 100 * x, 100 * y, labels)


def plot_ellipse_surfaces(
    surfaces: Mapping[str, Surface],
    points: Mapping[str, MeasuredPoints] | None = None,
    axes: Any | None = None,
) -> Any:
    """Size, orientation and shape side by side: surfaces above, maps below.

    Parameters
    ----------
    surfaces : mapping of str to Surface
        Of `PARAMETERS`.
    points : mapping of str to MeasuredPoints, optional
    axes : (2, 3) array of Axes, optional
        The upper ones three-dimensional.

    Returns
    -------
    axes : (2, 3) array of Axes
    """
    with print_style():
        grid = _new_grid() if axes is None else np.asarray(axes)
        for column, (name, letter) in enumerate(zip(PARAMETERS, "abc", strict=True)):
            own = None if points is None else points[name]
            upper = plot_surface(surfaces[name], own, grid[0, column])
            upper.set_zlabel("")
            # its own place is taken by the next panel
            upper.set_title(f"({letter}) {surfaces[name].label}")
            plot_map(surfaces[name], own, grid[1, column])
            if column:
                grid[1, column].set_ylabel("")
        if points is not None:
            handles, labels = grid[0, 0].get_legend_handles_labels()
            grid[0, 0].figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return grid


def half_width_surface(
    hand: HandPrediction,
    x: FloatArray,
    y: FloatArray,
    labels: tuple[str, str],
    outline: FloatArray | None = None,
) -> Surface:
    """Half the 95 % interval of the predicted stiffness ellipse's size, in % of it, over a grid.

    Parameters
    ----------
    hand : HandPrediction
        At the points of the grid, row by row.
    x, y : (n,) and (m,), or both (m, n)
    labels : (str, str)
    outline : (V, 2), optional
        The polygon outside of which all is extrapolated.

    Returns
    -------
    Surface
    """
    shape = x.shape if x.ndim == 2 else (len(y), len(x))
    half = 100 * predicted_field(hand, "stiffness").size_half_width.reshape(shape)
    outside = hand.joint.extrapolated.reshape(shape)
    return Surface(x, y, half, outside, *labels, "95 % interval of the size (± %)", outline)


def _surfaces(
    hand: HandPrediction,
    which: Predicted,
    x: FloatArray,
    y: FloatArray,
    labels: tuple[str, str],
    outline: FloatArray | None = None,
) -> dict[str, Surface]:
    values = _scaled(predicted_field(hand, which), which)
    outside: BoolArray = hand.joint.extrapolated
    inside = values["orientation_deg"][~outside]
    centre = mean_axis_deg(inside if inside.size else values["orientation_deg"])
    values["orientation_deg"] = turned_near(values["orientation_deg"], centre)
    shape = (len(y), len(x))
    return {
        name: Surface(
            x, y, values[name].reshape(shape), outside.reshape(shape), *labels, label, outline
        )
        for name, label in zip(PARAMETERS, _LABELS[which], strict=True)
    }


def _scaled(field: EllipseField, which: Predicted) -> dict[str, FloatArray]:
    """The parameters in the units of the labels."""
    values = {name: np.array(getattr(field, name)) for name in PARAMETERS}
    values["size"] = _FACTOR[which] * values["size"]
    return values


def _new_grid() -> Any:
    figure = new_figure(TWO_COLUMNS_IN, 5.3)
    engine: Any = figure.get_layout_engine()
    engine.set(hspace=0.09)
    grid = np.empty((2, 3), dtype=object)
    spec = figure.add_gridspec(2, 3, height_ratios=(1.0, 1.1))
    for column in range(3):
        grid[0, column] = figure.add_subplot(spec[0, column], projection="3d")
        grid[1, column] = figure.add_subplot(spec[1, column])
    return grid
