"""Ten seconds of live stiffness from raw EMG against the truth, with an electrode that is pulled.

python benchmarks/live/trace.py docs/gallery/live_trace.svg
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from measure import PERSON, POSTURES, STUDY, fitted, levels, raw_emg, true_stiffness

from armimpedance.hand.show import one_legend
from armimpedance.muscles.live import Live
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style

#: The muscle whose electrode is off, and when (s).
PULLED, OFF_S, ON_S = 2, 6.0, 7.0
NAMES = ("xx", "xy", "yy")
STEP = 20


def course() -> dict[str, np.ndarray]:
    """A hand that moves and a co-contraction that comes and goes."""
    model, known, t = fitted(0), levels(), np.arange(10_000) / 1000
    live = Live(model, PERSON, levels=known)
    middle = STUDY.truths[POSTURES].posture.mean(axis=0)
    turn = 2 * np.pi * 0.1 * t[:, None] + [0.0, np.pi / 2]
    q = middle + 0.15 * np.sin(turn)
    level = 0.2 + 0.5 / (1 + np.exp(-8 * np.sin(2 * np.pi * 0.2 * t)))
    alpha = level[:, None] * model.highest
    raw = raw_emg(alpha, known, 5)
    raw[int(OFF_S * 1000) : int(ON_S * 1000), PULLED] = 0.0
    said = [live.update(x, q=at, time_s=s) for x, at, s in zip(raw, q, t, strict=True)]
    shown = slice(200, None, STEP)
    packed = np.triu_indices(2)
    return {
        "t": t[shown],
        "true": true_stiffness(q[shown], alpha[shown])[:, *packed],
        "K": np.array([one.stiffness[packed] for one in said[shown]]),
        "half": np.array([one.half_width() for one in said[shown]]),
        "flagged": np.array([bool(one.flags) for one in said[shown]]),
    }


def draw(found: dict[str, np.ndarray], path: Path) -> None:
    """One panel an element."""
    import matplotlib as mpl

    with print_style():
        mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "live"})
        axes = new_figure(TWO_COLUMNS_IN, 2.4).subplots(1, 3)
        for e, ax in enumerate(axes):
            K, half, blue = found["K"][:, e], found["half"][:, e], OKABE_ITO["blue"]
            ax.fill_between(found["t"], K - half, K + half, color=blue, alpha=0.25, linewidth=0)
            ax.plot(found["t"], K, color=blue, linewidth=0.8, label="live, 95 % band")
            ax.plot(found["t"], found["true"][:, e], color="k", linewidth=0.8, label="truth")
            ax.fill_between(
                *(found["t"], 0, 1),
                where=found["flagged"],
                transform=ax.get_xaxis_transform(),
                color="0.85",
                linewidth=0,
                zorder=0,
                label="flagged",
            )
            ax.set(xlabel="time (s)", title=f"K{NAMES[e]} (N/m)")
        one_legend(axes[0].figure, [axes[0]], columns=3)
        axes[0].figure.savefig(path, metadata={"Date": None})


if __name__ == "__main__":
    draw(course(), Path(sys.argv[1]))
