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

#: Colours of this package and of the peers, distinct for the colour-blind (Okabe and Ito).
OURS, PEER = "#0072B2", "#D55E00"
#: Of the growth's curves, in the order of the table.
CURVES = ("#0072B2", "#56B4E9", "#009E73", "#999999", "#D55E00", "#E69F00", "#CC79A7", "#000000")
MARKS = "os^vD*Ph"


def _colour(name: str) -> str:
    return OURS if name.startswith("armimpedance") else PEER


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
        ax.grid(axis="x", color="0.9")
        ax.set_axisbelow(True)
    axes[1].legend(loc="lower left", fontsize=8, frameon=True)


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
    style = {"color": CURVES[number % len(CURVES)], "marker": MARKS[number % len(MARKS)]}
    ax.plot(list(done), list(done.values()), ms=4, lw=1.2, label=name, **style)


def growth(results: dict) -> plt.Figure:
    """Time and memory of the hand and of the clean joint over the number of trials."""
    figure, axes = plt.subplots(2, 2, figsize=(8.2, 6.6), layout="constrained")
    for row, (rig, what) in zip(
        axes, (("hand", "pushes of a hand"), ("joint", "records of a joint")), strict=True
    ):
        part = results["rigs"][rig]
        # nearly the default's curve
        shown = [p.name for p in PEERS if rig in p.rigs and not p.name.endswith("definite")]
        for number, name in enumerate(n for n in shown if n in part["rows"]):
            _curve(row[0], part["rows"][name], name, "processor_s", number)
            _curve(row[1], part["rows"][name], name, "peak_mb", number)
        row[0].set(ylabel="processor time, s")
        row[1].set(ylabel="peak memory, MB")
        for ax in row:
            ax.set(xscale="log", yscale="log", xlabel=what)
            ax.grid(color="0.9")
        row[0].legend(fontsize=6.5, frameon=True, loc="upper left")
    return figure


def main(results: str, out: str) -> None:
    """Two figures as SVG."""
    mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "peers", "font.size": 9})
    found = json.loads(Path(results).read_text())
    for name, figure in (("accuracy", accuracy(found)), ("growth", growth(found))):
        figure.savefig(Path(out) / f"peers_{name}.svg", metadata={"Date": None})


if __name__ == "__main__":
    main(*sys.argv[1:])
