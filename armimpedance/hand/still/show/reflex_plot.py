"""Plots of the evidence for a reflex: stiffness over the window's end, likelihood over delay."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import UNITS
from armimpedance.core.errors import InputError
from armimpedance.hand.show.ellipse_plot_parts import one_legend
from armimpedance.hand.still.reflex_verdict import ReflexVerdict
from armimpedance.numerics.regression import t_factor
from armimpedance.show.plots import (
    LINE_STYLES,
    OKABE_ITO,
    TWO_COLUMNS_IN,
    label_axes,
    new_axes,
    new_figure,
    panel_letters,
    print_style,
    unit_text,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Groups in one figure, those with the most evidence first.
MOST_GROUPS = 6
_ROW_IN = 2.4
#: More groups than this are drawn two in a row, in lower rows.
_MOST_BELOW = 2
_LOW_ROW_IN = 1.55
_BAND_ALPHA = 0.2
#: Windows whose band is wider than this share of the largest stiffness are not drawn.
_WIDEST = 0.75
#: The axis of log ratios covers at least these limits: values within them are no evidence.
_LEAST_RATIOS = (-3.0, 5.0)
_COLORS = ("blue", "vermillion", "green")


def plot_reflex(verdicts: Sequence[ReflexVerdict], axes: Any = None) -> Any:
    """Draw both views of each group, one row each; with many groups those with the smallest p.

    Parameters
    ----------
    verdicts : sequence of ReflexVerdict
        With window ends.
    axes : (n, 2) array of Axes, optional
        Where to draw, one row for each verdict; without it a new figure is made.

    Returns
    -------
    axes : (n, 2) array of Axes
        The window ends on the left and the profile over the delay on the right.

    Raises
    ------
    InputError
        Without verdicts, or one without window ends.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> axes = ai.plot_reflex(ai.reflex(recording))
    >>> axes.shape
    (1, 2)
    """
    if not verdicts:
        raise InputError("no verdicts to draw", expected="one or more")
    chosen = sorted(verdicts, key=lambda v: v.p_value)[:MOST_GROUPS]
    if len(verdicts) <= MOST_GROUPS:
        chosen = list(verdicts)
    with print_style():
        if axes is None:
            axes = _new_grid(len(chosen))
        for verdict, (left, right) in zip(chosen, axes, strict=True):
            plot_window_ends(verdict, left)
            plot_delay_profile(verdict, right)
            left.set_title(_title(verdict), loc="left", parse_math=False)
            if len(chosen) > _MOST_BELOW:
                right.set_title("", loc="right")
                both = f"{_title(verdict)}\n{_p_words(verdict)}"
                left.set_title(both, loc="left", parse_math=False)
        _tidy(axes)
    return axes


def _new_grid(groups: int) -> Any:
    """Axes (groups, 2); more than two groups share rows in pairs, so that the figure stays low."""
    if groups <= _MOST_BELOW:
        figure = new_figure(TWO_COLUMNS_IN, 0.6 + _ROW_IN * groups)
        return figure.subplots(groups, 2, squeeze=False, width_ratios=(3, 2))
    rows = -(-groups // 2)
    figure = new_figure(TWO_COLUMNS_IN, 0.6 + _LOW_ROW_IN * rows)
    grid = figure.subplots(rows, 4, squeeze=False, width_ratios=(3, 2, 3, 2), sharex="col")
    cells = grid.reshape(2 * rows, 2)
    for ax in cells[groups:].ravel():
        ax.remove()
    return cells[:groups]


def _tidy(axes: Any) -> None:
    """Add one legend for all groups and letters, and label the axes at the end of each column."""
    figure = axes[0, 0].figure
    low = len(axes) > _MOST_BELOW
    for number, (left, right) in enumerate(axes):
        last = number + (2 if low else 1) >= len(axes)
        for ax in (left, right):
            ax.tick_params(labelbottom=last)
            if not last:
                ax.set_xlabel("")
        if low:
            unit = left.get_ylabel().rpartition("(")[2]
            left.set_ylabel(f"K ({unit}" if number % 2 == 0 else "")
            right.set_ylabel("log ratio")
            if last:
                left.set_xlabel("window's end (ms)")
                right.set_xlabel("delay (ms)")
    one_legend(figure, list(axes[:, 0]))
    panel_letters(list(axes.flat))


def plot_window_ends(verdict: ReflexVerdict, ax: Axes | None = None) -> Axes:
    """Draw principal values of K over the end of the window, with 95 % bands.

    If a reflex was detected, the intrinsic K is dashed and the interval of the delay shaded. Lines
    are dotted up to 70 ms, where the spline's error at the onset may exceed the band.

    Raises InputError: if the verdict has no window ends.
    """
    ends = verdict.ends
    if ends is None:
        raise InputError("a verdict without window ends", expected="reflex_guard(..., ends=True)")
    factor = t_factor(verdict.dof)
    principal = [_principal(K, C) for K, C in zip(ends.stiffness, ends.covariance, strict=True)]
    values = np.array([v for v, _ in principal])
    half = factor * np.array([sd for _, sd in principal])
    shown = half.max(axis=1) <= _WIDEST * values[-1].max()
    shown |= np.arange(len(shown)) == len(shown) - 1
    end = 1e3 * ends.end_s[shown]
    with print_style():
        ax = new_axes(0.6 * TWO_COLUMNS_IN, _ROW_IN) if ax is None else ax
        for axis, style in zip(range(values.shape[1]), _COLORS, strict=False):
            value, width = values[shown, axis], half[shown, axis]
            color = OKABE_ITO[style]
            ax.fill_between(end, value - width, value + width, color=color, alpha=_BAND_ALPHA, lw=0)
            name = ("largest", "smallest")[axis] if values.shape[1] == 2 else f"value {axis + 1}"
            first = int((~ends.usable[shown]).sum())
            marks: dict[str, Any] = {"marker": "o", "markersize": 2.5, "color": color}
            ax.plot(end[: first + 1], value[: first + 1], linestyle=":", **marks)
            ax.plot(end[first:], value[first:], linestyle="-", label=name, **marks)
        if verdict.outcome == "contaminated":
            _draw_delay(ax, verdict)
            own = np.linalg.eigvalsh((verdict.intrinsic + verdict.intrinsic.T) / 2)[::-1]
            for number, value in enumerate(own):
                label = "intrinsic" if number == 0 else None
                ax.axhline(value, color="black", linestyle=LINE_STYLES[1], lw=0.8, label=label)
        ax.set_ylim(bottom=min(0.0, float((values - half)[shown].min())))
        label_axes(ax, "window ends after onset (ms)", _stiffness_label(verdict))
        ax.legend(loc="upper right", ncols=4, borderaxespad=0.0, columnspacing=1.0)
        ax.set_ylim(top=1.18 * float((values + half)[shown].max()))
    return ax


def plot_delay_profile(verdict: ReflexVerdict, ax: Axes | None = None) -> Axes:
    """Draw the log-likelihood ratio of a reflex over its delay, and the interval of the delay."""
    profile = verdict.profile
    with print_style():
        ax = new_axes(0.4 * TWO_COLUMNS_IN, _ROW_IN) if ax is None else ax
        style = "-" if len(profile.delay_s) > 1 else "o"
        ax.axhline(0.0, color="0.6", lw=0.8)
        ax.plot(1e3 * profile.delay_s, profile.log_ratio, style, color=OKABE_ITO["blue"])
        if verdict.outcome == "contaminated":
            _draw_delay(ax, verdict)
        ax.set_title(_p_words(verdict), loc="right")
        low, high = profile.log_ratio.min(), profile.log_ratio.max()
        ax.set_ylim(min(_LEAST_RATIOS[0], 1.05 * low), max(_LEAST_RATIOS[1], 1.05 * high))
        label_axes(ax, "delay of the reflex (ms)", "log-likelihood ratio")
    return ax


def _draw_delay(ax: Axes, verdict: ReflexVerdict) -> None:
    low, high = 1e3 * verdict.delay_low_s, 1e3 * verdict.delay_high_s
    if high > low:
        ax.axvspan(low, high, color=OKABE_ITO["orange"], alpha=_BAND_ALPHA, lw=0)
    ax.axvline(1e3 * verdict.delay_s, color=OKABE_ITO["orange"], lw=0.8, label="delay")


def _p_words(verdict: ReflexVerdict) -> str:
    words = {"none": "no sign", "contaminated": "reflex", "unknown": "cannot be told"}
    return f"{words[verdict.outcome]}, p = {verdict.p_value:.2g}"


def _title(verdict: ReflexVerdict) -> str:
    return ", ".join(str(value) for value in verdict.keys.values()) or "all trials"


def _stiffness_label(verdict: ReflexVerdict) -> str:
    several = len(verdict.intrinsic) > 1
    return f"{'principal ' if several else ''}stiffness ({unit_text(UNITS[verdict.kind]['K'])})"


def _principal(K: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues of the symmetric part, the largest first, and their standard errors."""
    values, vectors = np.linalg.eigh((K + K.T) / 2)
    slopes = np.einsum("in,jn->nij", vectors, vectors).reshape(len(K), -1)
    variance = np.einsum("na,ab,nb->n", slopes, covariance, slopes)
    return values[::-1], np.sqrt(variance)[::-1]
