"""One joint: compliance over frequency against its model, impedance over time with its bands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from armimpedance.elbow import (
    ElbowFit,
    EmgLaw,
    JointSamples,
    LinearLaw,
    VaryingImpedance,
    frequency_response,
    model_compliance,
)
from armimpedance.errors import InputError
from armimpedance.plots.style import (
    OKABE_ITO,
    ONE_COLUMN_IN,
    TWO_COLUMNS_IN,
    label_axes,
    new_axes,
    new_figure,
    print_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from armimpedance.arrays import FloatArray

_ROW_IN = 1.8
#: Below it a gain is noise.
_LEAST_COHERENCE = 0.3
_LABELS = {"K": "K (Nm/rad)", "B": "B (Nm s/rad)"}


def plot_varying(
    varying: VaryingImpedance,
    name: Literal["B", "K"],
    *,
    trial: int = 0,
    truth: tuple[FloatArray, FloatArray] | None = None,
    color: str = OKABE_ITO["blue"],
    label: str = "estimated",
    ax: Axes | None = None,
) -> Axes:
    """Draw B or K of one trial over time with its pointwise 95 % band.

    Parameters
    ----------
    varying : VaryingImpedance
    name : {"B", "K"}
    trial : int
        Row of the result's trials, from 0.
    truth : (time (S,), value (S,)), optional
        The true course, drawn below, in black.
    color, label : str
    ax : Axes, optional
        New ones are made if none are given.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        No such trial.
    """
    if not 0 <= trial < len(varying.trials):
        raise InputError(f"no trial {trial}", expected=f"0 to {len(varying.trials) - 1}")
    points = varying.points_of(trial)
    time, value, band = varying.time_s[points], getattr(varying, name), varying.band(name)
    with print_style():
        ax = new_axes(TWO_COLUMNS_IN, _ROW_IN) if ax is None else ax
        if truth is not None:
            ax.plot(*truth, color="black", lw=1.4, label="true")
        ax.fill_between(time, *band[points].T, color=color, alpha=0.22, lw=0)
        ax.plot(time, value[points], color=color, lw=1.1, label=label)
        ax.margins(x=0.01)
        label_axes(ax, "time (s)", _LABELS[name])
    return ax


def plot_varying_both(varying: VaryingImpedance, trial: int = 0) -> Figure:
    """Draw K above B, of one trial.

    Parameters
    ----------
    varying : VaryingImpedance
        B and K over time, as `analyses.elbow_over_time` makes them.
    trial : int
        Row of the result's trials, from 0.

    Returns
    -------
    Figure
        The figure, with K in the upper panel and B in the lower.

    Raises
    ------
    InputError
        No such trial.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.elbow import simulate_bench
    >>> recording, _ = simulate_bench(0.07, 1.2, 20.0, duration_s=6.0, snr_db=40.0)
    >>> course = ai.elbow_over_time(recording, method="windows")
    >>> figure = ai.plot_varying_both(course)
    >>> figure.axes[-1].get_xlabel()
    'time (s)'
    """
    figure = new_figure(TWO_COLUMNS_IN, 2 * _ROW_IN)
    with print_style():
        upper, lower = figure.subplots(2, sharex=True)
    plot_varying(varying, "K", trial=trial, ax=upper)
    plot_varying(varying, "B", trial=trial, ax=lower)
    upper.set_xlabel("")
    with print_style():
        title = f"{varying.method}, trial {varying.trials[trial]}, 95 % bands"
        upper.set_title(title, loc="left", fontsize=9)
    return figure


def plot_frequency_response(samples: JointSamples, fit: ElbowFit) -> Figure:
    """Compliance over frequency, measured without a model and as I, B and K predict it.

    Gain, phase and coherence, one below the other; without coherence nothing was measured, and no
    gain is drawn. Where the two part, a second-order joint does not hold: a reflex, a soft strap, a
    delay between the channels.

    Parameters
    ----------
    samples : JointSamples
        Torque and angle as recorded.
    fit : ElbowFit
        The fit whose I, B and K are drawn.

    Returns
    -------
    Figure
        The figure, with the panels of gain, phase and coherence.

    Raises
    ------
    InputError
        No trial is long enough for a spectrum.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from armimpedance.elbow import from_recording
    >>> from manipulandum_sim.elbow import simulate_bench
    >>> recording, _ = simulate_bench(0.07, 1.2, 20.0, duration_s=12.0, snr_db=40.0)
    >>> figure = ai.plot_frequency_response(from_recording(recording), ai.elbow(recording))
    >>> figure.axes[-1].get_xlabel()
    'frequency (Hz)'
    """
    measured = frequency_response(samples)
    f, model = measured.frequency_hz, model_compliance(measured.frequency_hz, fit.parameters.values)
    figure = new_figure(TWO_COLUMNS_IN, 3 * _ROW_IN)
    look = {"color": OKABE_ITO["blue"], "marker": ".", "ms": 2.5, "lw": 0.6, "label": "measured"}
    with print_style():
        gain, phase, coherence = figure.subplots(3, sharex=True, height_ratios=(3, 2, 1.4))
        shown = np.where(measured.coherence > _LEAST_COHERENCE, measured.compliance, np.nan)
        gain.loglog(f, np.abs(shown), **look)
        phase.semilogx(f, np.degrees(np.angle(shown)), **look)
        coherence.semilogx(f, measured.coherence, **look)
        name = f"I, B, K of method {fit.method}"
        line = {"color": OKABE_ITO["vermillion"], "lw": 1.4, "label": name}
        gain.loglog(f, np.abs(model), **line)
        phase.semilogx(f, np.degrees(np.angle(model)), **line)
        coherence.set_ylim(0, 1.05)
        coherence.xaxis.set_major_formatter("{x:g}")
        gain.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.2)
    label_axes(gain, " ", "gain (rad/Nm)")
    label_axes(phase, " ", "phase (deg)")
    label_axes(coherence, "frequency (Hz)", "coherence")
    return figure


def plot_law(
    law: LinearLaw, value: FloatArray, sd: FloatArray, amplitude: FloatArray, ax: Axes | None = None
) -> Axes:
    """Measured values over those that the law gives for the same EMG, with 95 % error bars.

    Parameters
    ----------
    law : LinearLaw
    value, sd : (L,)
        Measured value of each trial, and its standard error.
    amplitude : (L, m)
    ax : Axes, optional
    """
    predicted = law.predict(amplitude).value
    with print_style():
        ax = new_axes(ONE_COLUMN_IN, ONE_COLUMN_IN) if ax is None else ax
        low, high = min(predicted.min(), value.min()), max(predicted.max(), value.max())
        ax.plot([low, high], [low, high], color="0.6", lw=0.8, label="equal")
        ax.errorbar(
            predicted, value, 1.96 * sd, fmt="o", ms=3, color=OKABE_ITO["blue"], elinewidth=0.7
        )
        ax.set_title(f"{law.symbol} over EMG, R$^2$ {law.r2:.2f}", loc="left")
        name = _LABELS[law.symbol]
        label_axes(ax, f"{name}, from EMG", f"{name}, measured")
    return ax


def plot_emg_law(law: EmgLaw) -> Figure:
    """Draw the law of K and, where there is one, of B, side by side.

    Parameters
    ----------
    law : EmgLaw
        With its points, as `analyses.emg_law` makes it.

    Returns
    -------
    Figure
        The figure, with a panel for each law.

    Raises
    ------
    InputError
        The law does not hold its points.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.elbow import simulate_elbow
    >>> recording, _ = simulate_elbow("cocontraction", repetitions=1, duration_s=6.0)
    >>> figure = ai.plot_emg_law(ai.emg_law(recording))
    >>> len(figure.axes)
    2
    """
    points = law.points
    if points is None:
        raise InputError("a law without its points", expected="one of a recording")
    width = TWO_COLUMNS_IN if len(law.laws) > 1 else ONE_COLUMN_IN
    figure = new_figure(width, ONE_COLUMN_IN)
    with print_style():
        axes = figure.subplots(1, len(law.laws), squeeze=False)[0]
    for ax, one in zip(axes, law.laws, strict=True):
        value, sd = getattr(points, one.symbol), getattr(points, f"sd_{one.symbol}")
        plot_law(one, value, sd, points.amplitude, ax)
    return figure
