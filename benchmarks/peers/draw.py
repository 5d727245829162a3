"""Draw results.json: errors beside intervals, and how time and memory grow.

PYTHONPATH=. .venv/bin/python benchmarks/peers/draw.py peers/results.json docs
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from compare import NAMES
from table import PEERS

mpl.use("agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

#: Colours of this package and of the peers, distinct for the colour-blind (Okabe and Ito).
OURS, PEER = "#0072B2", "#D55E00"
#: Of the growth's curves, in the order of the table.
CURVES = (
    *("#0072B2", "#56B4E9", "#004466", "#88BBEE"),
    *("#D55E00", "#E69F00", "#994400", "#CC79A7", "#000000", "#777777"),
)
MARKS = "os^vD*PhX<"


def _colour(name: str) -> str:
    return OURS if name.startswith("armimpedance") else PEER


def _plain_numbers(axis: Axis) -> None:
    """1, 2, 5, 10 and so on along a logarithmic axis, not powers."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,g}"))
    axis.set_minor_formatter(NullFormatter())


def _errors(axes: list[Axes], part: dict, rig: str, title: str) -> None:
    """Rms errors of M, B, K and coverage, one line a peer."""
    names = list(part["accuracy"])
    y = -np.arange(len(names))
    for i, (mark, symbol) in enumerate(zip("osD", NAMES[rig], strict=True)):
        errors = [part["accuracy"][n]["rmse"][i] for n in names]
        covered = [(part["accuracy"][n]["coverage"] or [np.nan] * 3)[i] for n in names]
        for ax, values in zip(axes, (errors, covered), strict=True):
            colours = [_colour(n) for n in names]
            ax.scatter(values, y, c=colours, marker=mark, s=28, alpha=0.85)
            ax.scatter([], [], c="0.4", marker=mark, s=28, label=symbol)
    axes[0].set(xscale="log", yticks=y, title=title, xlabel="rms error, %")
    axes[0].set_yticklabels(names, fontsize=8)
    axes[1].axvline(95, color="0.6", lw=1)
    axes[1].set(xlim=(-4, 104), yticks=[], xlabel="95 % intervals that hold the truth, %")
    for ax in axes:
        # a peer without intervals leaves its line empty
        ax.set_ylim(0.6 - len(names), 0.6)
        ax.grid(axis="x", color="0.9")
        ax.set_axisbelow(True)
    _plain_numbers(axes[0].xaxis)
    axes[1].legend(
        loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=8, frameon=False
    )


def accuracy(results: dict) -> plt.Figure:
    """Hand, clean joint, joint with a reflex."""
    titles = {
        "hand": "Hand: 25 pushes a condition",
        "joint": "Joint: 10 s of random torque",
        "reflex": "The same joint with a reflex",
    }
    parts = results["rigs"]
    heights = [len(parts[rig]["accuracy"]) for rig in titles]
    figure, axes = plt.subplots(
        3, 2, figsize=(8.2, 8.4), height_ratios=heights, width_ratios=(1.4, 1), layout="constrained"
    )
    for row, (rig, title) in zip(axes, titles.items(), strict=True):
        _errors(list(row), parts[rig], rig, title)
    return figure


def _curve(ax: Axes, rows: dict, name: str, key: str, number: int) -> None:
    done = {int(n): costs[key] for n, costs in rows.items() if "reason" not in costs}
    style = {"color": CURVES[number], "marker": MARKS[number]}
    ax.plot(list(done), list(done.values()), ms=4, lw=1.2, label=name, **style)


def growth(results: dict) -> plt.Figure:
    """Time and memory of the hand and of the clean joint over the number of trials."""
    figure, axes = plt.subplots(2, 2, figsize=(9.6, 6.4), layout="constrained")
    for row, (rig, what) in zip(
        axes, (("hand", "pushes of a hand"), ("joint", "records of a joint")), strict=True
    ):
        part = results["rigs"][rig]
        # nearly the default's curve
        shown = [p for p in PEERS if rig in p.rigs and not p.name.endswith("definite")]
        # ours in blues, as many as the hand has; then the peers
        theirs = iter(range(4, len(CURVES)))
        ours = iter(range(4))
        for peer in shown:
            number, name = next(ours if peer.ours else theirs), peer.name
            _curve(row[0], part["rows"][name], name, "processor_s", number)
            _curve(row[1], part["rows"][name], name, "peak_mb", number)
        row[0].set(ylabel="processor time, s")
        row[1].set(ylabel="peak memory, MB")
        for ax in row:
            ax.set(xscale="log", yscale="log", xlabel=what)
            ax.grid(color="0.9")
            _plain_numbers(ax.yaxis)
            ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,.0f}"))
            ax.xaxis.set_minor_formatter(NullFormatter())
        row[1].legend(fontsize=7.5, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def main(results: str, out: str) -> None:
    """Two figures as SVG."""
    mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "peers", "font.size": 9})
    found = json.loads(Path(results).read_text())
    for name, figure in (("accuracy", accuracy(found)), ("growth", growth(found))):
        figure.savefig(Path(out) / f"peers_{name}.svg", metadata={"Date": None})


if __name__ == "__main__":
    main(*sys.argv[1:])
