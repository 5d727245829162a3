"""Models of joint impedance in pictures: over posture, over activation, against measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.arm import TwoLinkArm
from armimpedance.arrays import BoolArray, FloatArray
from armimpedance.errors import InputError
from armimpedance.muscles import ActivationModel, HandPrediction, PostureModel, at_hand
from armimpedance.plots.ellipse_fields import (
    EllipseField,
    Predicted,
    mean_axis_deg,
    measured_field,
    predicted_field,
    turned_near,
)
from armimpedance.plots.maps import plot_map
from armimpedance.plots.style import (
    OKABE_ITO,
    TWO_COLUMNS_IN,
    label_axes,
    new_axes,
    new_figure,
    print_style,
)
from armimpedance.plots.surfaces import MeasuredPoints, Surface, plot_surface
from armimpedance.records import ImpedanceEstimate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
_GROUP_LOOKS: Final = (("o", "blue"), ("s", "vermillion"), ("^", "green"), ("D", "purple"))


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
        titles = ("(a) size", "(b) orientation", "(c) shape")
        for column, (name, title) in enumerate(zip(PARAMETERS, titles, strict=True)):
            own = None if points is None else points[name]
            upper = plot_surface(surfaces[name], own, grid[0, column])
            upper.set_zlabel("")
            upper.set_title(title)
            plot_map(surfaces[name], own, grid[1, column])
            if column:
                grid[1, column].set_ylabel("")
    return grid


def plot_predicted_against_measured(
    predicted: ArrayLike,
    measured: ArrayLike,
    predicted_half: ArrayLike,
    measured_half: ArrayLike,
    groups: Sequence[str],
    ax: Axes | None = None,
    *,
    label: str = "",
) -> Axes:
    """Draw measured values over predicted ones, with 95 % intervals of both and the identity line.

    Parameters
    ----------
    predicted, measured : (P,)
        Values in one unit.
    predicted_half, measured_half : (P,)
        Half-widths of the intervals.
    groups : (P,) sequence of str
        Experiments, told apart by shape and colour; at most four.
    ax : Axes, optional
        Drawn into a new figure without it.
    label : str
        What it is, with its unit.

    Returns
    -------
    Axes
        The axes drawn into.

    Raises
    ------
    InputError
        Vectors of different lengths, or more than four groups.

    Examples
    --------
    >>> from armimpedance.plots import plot_predicted_against_measured
    >>> half, groups = [0.5, 0.5], ["force", "force"]
    >>> ax = plot_predicted_against_measured([10, 20], [11, 19], half, half, groups, label="K")
    >>> ax.get_xlabel()
    'predicted K'
    """
    x, y, x_half, y_half = (
        np.asarray(v, dtype=float) for v in (predicted, measured, predicted_half, measured_half)
    )
    names = list(dict.fromkeys(groups))
    if not x.shape == y.shape == x_half.shape == y_half.shape == (len(groups),):
        raise InputError("predicted and measured values of different numbers", expected="as many")
    if len(names) > len(_GROUP_LOOKS):
        raise InputError(f"{len(names)} groups", expected=f"at most {len(_GROUP_LOOKS)}")
    with print_style():
        ax = new_axes() if ax is None else ax
        ends = [
            min((x - x_half).min(), (y - y_half).min()),
            max((x + x_half).max(), (y + y_half).max()),
        ]
        margin = 0.04 * (ends[1] - ends[0])
        limits = (ends[0] - margin, ends[1] + margin)
        ax.plot(limits, limits, color="0.6", linewidth=0.8, zorder=0, label="identity")
        for name, look in zip(names, _GROUP_LOOKS, strict=False):
            own = np.array([group == name for group in groups])
            _draw_group(ax, x[own], y[own], x_half[own], y_half[own], look, name)
        ax.set(xlim=limits, ylim=limits)
        ax.set_aspect("equal")
        label_axes(ax, f"predicted {label}", f"measured {label}")
    return ax


def _draw_group(
    ax: Axes,
    x: FloatArray,
    y: FloatArray,
    x_half: FloatArray,
    y_half: FloatArray,
    look: tuple[str, str],
    name: str,
) -> None:
    """Points of one experiment with bars along both axes; its look is a marker and a colour."""
    ax.errorbar(
        x,
        y,
        xerr=x_half,
        yerr=y_half,
        fmt=look[0],
        color=OKABE_ITO[look[1]],
        mfc="white",
        markersize=3.5,
        mew=0.8,
        elinewidth=0.7,
        label=name,
    )


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
