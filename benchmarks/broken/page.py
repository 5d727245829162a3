"""The pages of the docs: what can go wrong, and what you will see; drawn from the table."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
from broken.folder import pages
from matplotlib.patches import Patch

from armimpedance.core.outputs import staged_file
from armimpedance.show.plots import OKABE_ITO, new_figure, print_style

STEM: Final = "what_can_go_wrong"
#: Share -> colour and word, in the order of the bars.
SHARES: Final = {
    "refused": (OKABE_ITO["blue"], "refused: no number, and why"),
    "named": (OKABE_ITO["sky"], "named: a number, and a warning with this name"),
    "wide_or_right": ("0.85", "right or wide: the interval holds the truth"),
    "silently_wrong": (OKABE_ITO["vermillion"], "silently wrong"),
}
#: Drawing -> its commands and what is said of it.
DRAWINGS: Final = {
    "joint": ("elbow", "elbow --time-varying", "elbow --emg-law"),
    "hand": ("estimate", "reflex", "inspect", "map", "compare", "random", "movement"),
    "others": (
        "passive", "body", "therapy robot", "therapy arm", "therapy contribution",
        "fit activation", "fit moment-arms", "convert",
    ),
}  # fmt: skip
EFFECT_SE: Final = 2.0
WIDTH_IN, ROW_IN, HEAD_IN, DPI = 6.6, 0.135, 0.42, 160


def write_page(rows: pd.DataFrame, docs: Path) -> None:
    """Write ``evidence/what_can_go_wrong/`` below the docs, its drawings into the gallery."""
    for name, commands in DRAWINGS.items():
        chosen = rows[rows["command"].isin(commands) & (rows["violation"] != "none")]
        if len(chosen):
            draw(chosen, commands, docs / "gallery" / f"{STEM}_{name}")
    folder = docs / "evidence" / STEM
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts(rows).items():
        with staged_file(folder / f"{name}.md") as staged:
            Path(staged).write_text(text, encoding="utf-8")


def draw(rows: pd.DataFrame, commands: tuple[str, ...], stem: Path) -> None:
    """One panel a command, one stacked bar a cell; faint where the effect is small."""
    there = [c for c in commands if (rows["command"] == c).any()]
    counts = [int((rows["command"] == c).sum()) for c in there]
    height = sum(counts) * ROW_IN + HEAD_IN * len(there) + 0.5
    with print_style():
        figure = new_figure(WIDTH_IN, height)
        axes = figure.subplots(len(there), 1, height_ratios=counts, squeeze=False)[:, 0]
        for ax, command in zip(axes, there, strict=True):
            _panel(ax, rows[rows["command"] == command], command)
        axes[-1].set_xlabel("part of the records, %")
        # patches of their own: the first bar of a panel may be a faint one
        handles = [Patch(color=colour, label=word) for colour, word in SHARES.values()]
        figure.legend(handles=handles, loc="outside upper center", ncols=2, fontsize=7)
        with staged_file(stem.with_suffix(".png")) as staged:
            figure.savefig(staged, format="png", dpi=DPI, metadata={"Software": None})


def _panel(ax: Any, rows: pd.DataFrame, command: str) -> None:
    place = np.arange(len(rows))
    judged = (rows["effect_in_se"] > EFFECT_SE).to_numpy() & rows["seen"].astype(bool).to_numpy()
    left = np.zeros(len(rows))
    for share, (colour, _) in SHARES.items():
        width = 100 * rows[share].to_numpy(dtype=float)
        bars = ax.barh(place, width, left=left, color=colour, height=0.8)
        for bar, full in zip(bars, judged, strict=True):
            bar.set_alpha(1.0 if full else 0.35)
        left += width
    labels = [
        f"{row.violation}{', ' + row.size if row.size else ''}{'' if row.seen else ' *'}"
        for row in rows.itertuples()
    ]
    ax.set_yticks(place, labels, fontsize=6)
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.set_xlim(0, 100)
    ax.tick_params(axis="x", labelsize=6)
    ax.tick_params(axis="y", length=0)
    ax.set_title(command, loc="left", fontsize=8, fontweight="bold")
    for side in ("top", "right", "left"):
        ax.spines[side].set_visible(False)


def texts(rows: pd.DataFrame) -> dict[str, str]:
    """The pages in words."""
    broken = rows[rows["violation"] != "none"]
    commands = dict.fromkeys(broken["command"])
    tables = {c: _table(broken[broken["command"] == c]) for c in commands}
    return pages(_intro(broken), tables, _clean(rows[rows["violation"] == "none"]))


def _intro(broken: pd.DataFrame) -> list[str]:
    n = int(broken["n"].max())
    judged = broken[(broken["effect_in_se"] > EFFECT_SE) & broken["seen"].astype(bool)]
    quiet = int((judged["silently_wrong"] <= 0.02).sum())
    lines = [
        "Every command assumes something: that the rig imposes a torque, that the person is",
        "relaxed, that channels are on one clock, that newtons are newtons. Each assumption",
        "is violated on purpose in simulated records, many of plants written apart from the",
        "toolkit's own simulators, and the command is run: `python",
        "benchmarks/broken_assumptions.py`. A record is then",
        "",
        "- *refused*: there is no number, and one line says why;",
        "- *named*: there is a number, and a warning bears the name of what is wrong;",
        "- *right or wide*: the printed 95 % interval, widened by half, covers the truth;",
        "- *silently wrong*: none of these (orange).",
        "",
        "*Effect* is the largest error that the violation causes, in standard errors of the",
        "same experiment without it. Below two it does no harm that anyone could see, and the",
        "bars are faint.",
        f"Of {len(broken)} violations, {n} records a cell at most, {len(judged)} are above two;",
        f"{quiet} of these are silently wrong in at most 2 % of the printed numbers.",
        "A star marks what no record can show, such as a gain that is a little off. Only a",
        "calibration helps there.",
        "",
    ]
    for name, commands in DRAWINGS.items():
        if broken["command"].isin(commands).any():
            title = ", ".join(f"`{c}`" for c in commands if (broken["command"] == c).any())
            lines += [
                f"![{name}](../../gallery/{STEM}_{name}.png)",
                "",
                f"*{title.capitalize()}*",
                "",
            ]
    return lines


def _table(rows: pd.DataFrame) -> list[str]:
    lines = []
    for row in rows.itertuples():
        what = f"{row.violation}{', ' + row.size if row.size else ''}"
        size = "-" if not np.isfinite(row.effect_in_se) else f"{row.effect_in_se:.2g}"
        if np.isfinite(row.effect_in_se) and row.effect_in_se >= 100:
            size = "> 100"
        lines.append(f"| {what} | {size} | {seen(row)} | {row.advice} |")
    return lines


def seen(row: Any) -> str:
    """What a user sees, in one sentence of a cell of the table."""
    parts, names = [], str(row.named_by).split("; ")
    alarms = [re.sub(r" \(\d+\)$", "", one) for one in re.split(r"(?<=\)); ", str(row.alarms))]
    naming = [one for one in alarms if any(n in one for n in names)]
    others = [one for one in alarms if one and one not in naming]
    if row.refused > 0.02:
        parts.append(f'refused in {_percent(row.refused)}: "{_short(row.example)}"')
    if row.named > 0.02:
        beside = f", beside intervals that hold the truth in {_percent(row.held)}"
        held = beside if row.named > 0.5 and np.isfinite(row.held) else ""
        # of many different sentences the cell keeps the commonest; the name may not be among them
        name = naming[0] if naming else names[0]
        parts.append(f"a warning in {_percent(row.named)}: *{_short(name)}*{held}")
    if row.wide_or_right > 0.02:
        parts.append(f"an interval that holds the truth in {_percent(row.wide_or_right)}")
    if row.silently_wrong > 0.02:
        blind = ", which no record can show" if not row.seen else ""
        off = f"in {_percent(row.silently_wrong)} a wrong number{blind}"
        parts.append(
            f"**{off}**, beside another warning: *{_short(others[0])}*"
            if others
            else f"**{off} and no word**"
        )
    return "; ".join(parts)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _short(sentence: str, most: int = 110) -> str:
    # a file is called by its name alone
    plain = re.sub(r"(?<!\S)/\S*/", "", re.sub(r"[|*`]", "", sentence))
    return plain if len(plain) <= most else plain[: most - 4].rsplit(" ", 1)[0] + " ..."


def _clean(rows: pd.DataFrame) -> list[str]:
    lines = [
        "A warning on a good record is a false alarm. The last column is of 95 % intervals that",
        "are widened by half, as on the other pages; of those that are printed 5 % may miss.",
        "",
        "| command | rig | alarmed | by | widened intervals that miss |",
        "| --- | --- | --- | --- | --- |",
    ]
    for row in rows.itertuples():
        by = _short(str(row.alarms).split("; ")[0]) if row.false_alarm > 0 else "-"
        lines.append(
            f"| `{row.command}` | {row.rig} | {_percent(row.false_alarm)} | {by} | "
            f"{100 * row.silently_wrong:.1f} % |"
        )
    return lines
