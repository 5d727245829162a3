"""Plots of one joint: measured and model compliance over frequency, impedance over time, EMG
laws."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.elbow_result import ElbowFit, VaryingImpedance
from armimpedance.joint.elbow.emg.law_result import EmgLaw, LinearLaw
from armimpedance.joint.elbow.frequency_response import (
    FrequencyResponse,
    frequency_response,
    model_compliance,
)
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.show.plots import (
    OKABE_ITO,
    ONE_COLUMN_IN,
    TWO_COLUMNS_IN,
    label_axes,
    new_axes,
    new_figure,
    panel_letters,
    print_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_ROW_IN = 1.8
#: Below this coherence a gain is noise.
_LEAST_COHERENCE = 0.3
#: Points per decade of frequency that can be distinguished in a plot.
_BINS_PER_DECADE: Final = 24
#: Independent averages of a half-overlapping Hann segment: 1 / (1 + 2 (1/6)^2).
_INDEPENDENT: Final = 0.947
_LABELS = {"K": "K (N m/rad)", "B": "B (N m s/rad)", "G": "reflex G (N m s/rad)"}


def plot_varying(
    varying: VaryingImpedance,
    name: Literal["B", "K", "G"],
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
    name : {"B", "K", "G"}
        G: the reflex's gain, if there is a reflex.
    trial : int
        Row of the result's trials, from 0.
    truth : (time (S,), value (S,)), optional
        The true course, drawn below, in black.
    color, label : str
    ax : Axes, optional
        Axes to draw on; by default new ones.

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
    source: Any = varying.reflex if name == "G" else varying
    time, value, band = varying.time_s[points], getattr(source, name), varying.band(name)
    with print_style():
        ax = new_axes(TWO_COLUMNS_IN, _ROW_IN) if ax is None else ax
        if truth is not None:
            ax.plot(*truth, color="black", lw=1.4, label="true")
        ax.fill_between(time, *band[points].T, color=color, alpha=0.22, lw=0)
        ax.plot(time, value[points], color=color, lw=1.1, label=label)
        ax.margins(x=0.01)
        label_axes(ax, "time (s)" if varying.over == "time_s" else varying.over, _LABELS[name])
    return ax


def plot_varying_both(varying: VaryingImpedance, trial: int = 0) -> Figure:
    """Draw K above B of one trial, and below them a reflex's gain if there is one.

    Parameters
    ----------
    varying : VaryingImpedance
        B and K over time, from `joint.elbow.show.elbow_over_time`.
    trial : int
        Row of the result's trials, from 0.

    Returns
    -------
    Figure
        The figure, with K in the first panel and B in the second.

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
    names: tuple[Literal["K", "B", "G"], ...] = ("K", "B", "G")
    names = names if varying.reflex is not None else names[:2]
    figure = new_figure(TWO_COLUMNS_IN, len(names) * _ROW_IN)
    with print_style():
        panels = list(figure.subplots(len(names), sharex=True))
    for name, ax in zip(names, panels, strict=True):
        plot_varying(varying, name, trial=trial, ax=ax)
    for ax in panels[:-1]:
        ax.set_xlabel("")
    with print_style():
        title = f"{varying.method}, trial {varying.trials[trial]}, 95 % bands"
        panels[0].set_title(title, loc="left")
        panel_letters(panels)
    return figure


def plot_frequency_response(samples: JointSamples, fit: ElbowFit) -> Figure:
    """Draw the compliance over frequency, measured without a model and predicted by I, B and K.

    Panels show gain and phase with 95 % intervals, and coherence; gain and phase are not drawn if
    the coherence is low. Neighbouring frequencies are averaged if they are denser than the plot can
    show. The model is dashed beyond the band that was fitted. Where measurement and model differ,
    the joint is not of second order: a reflex, a soft strap, a delay between the channels.

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
    >>> from armimpedance.joint.elbow import from_recording
    >>> from manipulandum_sim.elbow import simulate_bench
    >>> recording, _ = simulate_bench(0.07, 1.2, 20.0, duration_s=12.0, snr_db=40.0)
    >>> figure = ai.plot_frequency_response(from_recording(recording), ai.elbow(recording))
    >>> figure.axes[-1].get_xlabel()
    'frequency (Hz)'
    """
    measured = frequency_response(samples)
    shown = averaged(measured, fit.parameters.values)
    band = float(fit.details.get("band_hz", measured.frequency_hz[-1]))
    figure = new_figure(TWO_COLUMNS_IN, 3 * _ROW_IN)
    with print_style():
        gain, phase, coherence = figure.subplots(3, sharex=True, height_ratios=(3, 2, 1.4))
        _draw_measured(gain, phase, shown)
        _draw_model(gain, phase, shown, band, fit)
        coherence.semilogx(measured.frequency_hz, measured.coherence, color="0.6", lw=0.6)
        coherence.axhline(_LEAST_COHERENCE, color="black", lw=0.6, ls=":")
        for ax in (gain, phase, coherence):
            ax.axvline(band, color="black", lw=0.8, ls=":", zorder=0)
        coherence.set_ylim(0, 1.05)
        coherence.set_xlim(measured.frequency_hz[0], _last_shown(shown, band))
        coherence.xaxis.set_major_formatter("{x:g}")
        gain.yaxis.set_major_formatter("{x:g}")
        phase.yaxis.set_major_locator(degree_ticks())
        gain.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.2)
        panel_letters([gain, phase, coherence])
        label_axes(gain, " ", "gain (rad/(N m))")
        label_axes(phase, " ", "phase (deg)")
        label_axes(coherence, "frequency (Hz)", "coherence")
        figure.align_ylabels([gain, phase, coherence])
    return figure


@dataclass(frozen=True)
class AveragedResponse(FrozenRecord):
    """A frequency response as it is drawn.

    `frequency_hz`, `gain`, `phase_deg`, `coherence` (p,): the phase lies within half a turn of the
    model's.
    `error` (p,): relative standard error of the gain, equal to that of the phase in rad.
    """

    frequency_hz: Annotated[FloatArray, "p"]
    gain: Annotated[FloatArray, "p"]
    phase_deg: Annotated[FloatArray, "p"]
    coherence: Annotated[FloatArray, "p"]
    error: Annotated[FloatArray, "p"]


def averaged(measured: FrequencyResponse, parameters: FloatArray) -> AveragedResponse:
    """Mean compliance over bins of equal width in the logarithm, with its standard error.

    The error of gain and phase is ``sqrt((1 - c) / (2 c n))``, c the coherence, n independent
    averages (Bendat and Piersol, Random Data). Bins of too little coherence are left out.

    `parameters` (3,): I, B, K of the model that resolves the phase's full turns.
    """
    f = measured.frequency_hz
    bins = np.floor(_BINS_PER_DECADE * np.log10(f)).astype(int)
    rows = []
    for number in np.unique(bins):
        used = np.flatnonzero((bins == number) & (measured.coherence > _LEAST_COHERENCE))
        # Among many frequencies without signal, some are coherent by chance.
        if 2 * len(used) < (bins == number).sum() or len(used) == 0:
            continue
        c = float(measured.coherence[used].mean())
        # Relative to the model within the bin, so that the mean is that at the bin's middle.
        middle = float(np.exp(np.log(f[used]).mean()))
        at_middle = model_compliance(np.array([middle]), parameters)[0]
        relative = measured.compliance[used] / model_compliance(f[used], parameters)
        mean = relative.mean()
        # Hann windows correlate neighbours: about two thirds of the frequencies are independent.
        n = _INDEPENDENT * measured.segments * max(1.0, len(used) / 1.5)
        phase = np.degrees(np.angle(mean) + np.angle(at_middle))
        # Rounding may give a coherence above 1.
        error = np.sqrt(max(0.0, 1 - c) / (2 * c * n))
        rows.append((middle, abs(mean * at_middle), phase, c, error))
    return AveragedResponse(*np.array(rows, dtype=float).reshape(-1, 5).T)


def _draw_measured(gain: Axes, phase: Axes, shown: AveragedResponse) -> None:
    look: dict[str, Any] = {"fmt": "o", "color": OKABE_ITO["blue"], "ms": 2.2}
    look |= {"elinewidth": 0.7, "zorder": 3}
    half = 1.96 * shown.error
    low, high = shown.gain * (1 - np.exp(-half)), shown.gain * (np.exp(half) - 1)
    label = "measured, 95 % interval"
    gain.errorbar(shown.frequency_hz, shown.gain, (low, high), label=label, **look)
    # A phase with an interval wider than a quarter turn is not determined.
    determined = half < np.pi / 4
    phase.errorbar(
        shown.frequency_hz[determined],
        shown.phase_deg[determined],
        np.degrees(half[determined]),
        **look,
    )
    gain.set(xscale="log", yscale="log")
    phase.set(xscale="log")


def _draw_model(
    gain: Axes, phase: Axes, shown: AveragedResponse, band: float, fit: ElbowFit
) -> None:
    """Draw the model: solid in the fitted band, dashed beyond it."""
    name = f"I, B, K of method {fit.method}"
    line: dict[str, Any] = {"color": OKABE_ITO["vermillion"], "lw": 1.2}
    ends = (shown.frequency_hz[0], band, max(_last_shown(shown, band), 1.01 * band))
    for low, high, style, label in (
        (ends[0], ends[1], "-", name),
        (ends[1], ends[2], (0, (4, 2)), "beyond the fitted band"),
    ):
        f = np.geomspace(low, high, 200)
        model = model_compliance(f, fit.parameters.values)
        gain.plot(f, np.abs(model), ls=style, label=label, **line)
        phase.plot(f, np.degrees(np.angle(model)), ls=style, **line)


def _last_shown(shown: AveragedResponse, band: float) -> float:
    """Last frequency of the picture: a little beyond what was fitted and measured."""
    return 1.15 * max(band, float(shown.frequency_hz[-1]))


def degree_ticks() -> Any:
    """Locator of ticks at 45 or 90 degrees."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=5, steps=[1, 4.5, 9, 10])


def plot_law(
    law: LinearLaw, value: FloatArray, sd: FloatArray, amplitude: FloatArray, ax: Axes | None = None
) -> Axes:
    """Draw measured values over those that the law predicts from the EMG, with 95 % error bars.

    `amplitude` (L, m).
    `value`, `sd` (L,): measured value of each trial, and its standard error.
    """
    predicted = law.predict(amplitude).value
    with print_style():
        ax = new_axes(ONE_COLUMN_IN, ONE_COLUMN_IN) if ax is None else ax
        low, high = min(predicted.min(), value.min()), max(predicted.max(), value.max())
        ax.plot([low, high], [low, high], color="0.6", lw=0.8, label="equal")
        ax.errorbar(
            predicted, value, 1.96 * sd, fmt="o", ms=3, color=OKABE_ITO["blue"], elinewidth=0.7
        )
        ax.set_title(f"{law.symbol} over EMG, R² {law.r2:.2f}", loc="left")
        name = _LABELS[law.symbol]
        label_axes(ax, f"{name}, from EMG", f"{name}, measured")
    return ax


def plot_emg_law(law: EmgLaw) -> Figure:
    """Draw the law of K and, if there is one, of B, side by side.

    Parameters
    ----------
    law : EmgLaw
        With its points, as returned by `joint.elbow.show.emg_law`.

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
    for ax, linear in zip(axes, law.laws, strict=True):
        value, sd = getattr(points, linear.symbol), getattr(points, f"sd_{linear.symbol}")
        plot_law(linear, value, sd, points.amplitude, ax)
    return figure
