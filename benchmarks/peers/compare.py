"""From what the peers found to tables: errors against the truth, coverage, ratios to ours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.stats import t
from table import HAND, JOINT, PEERS, Peer

Costs = dict[str, float | str]

#: Conditions of the accuracy table: more would make no row surer than its neighbour.
MOST = 400
#: How sure a difference must be.
SURE = 0.995
OURS = {"hand": HAND, "joint": JOINT, "reflex": JOINT}
NAMES = {"hand": ("M", "B", "K"), "joint": ("I", "B", "K"), "reflex": ("I", "B", "K")}


def squared(values: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Squared relative Frobenius errors (C, 3) of M, B, K."""
    wrong = (values - truth).reshape(len(values), 3, -1)
    return (wrong**2).sum(axis=2) / (truth.reshape(3, -1) ** 2).sum(axis=1)


def accuracy(values: np.ndarray, half: np.ndarray, truth: np.ndarray) -> dict[str, object]:
    """Bias, rms error and coverage of M, B, K in %; conditions without a result are counted."""
    fine = np.isfinite(values).all(axis=1)
    values, half = values[fine], half[fine]
    error, size = values - truth, np.linalg.norm(truth.reshape(3, -1), axis=1)
    inside = (np.abs(error) <= half).reshape(len(values), 3, -1)
    bias = np.linalg.norm(error.mean(axis=0).reshape(3, -1), axis=1) / size
    told = np.isfinite(half).all()
    return {
        "conditions": len(fine),
        "failed": int((~fine).sum()),
        "bias": (100 * bias).tolist(),
        "rmse": (100 * np.sqrt(squared(values, truth).mean(axis=0))).tolist(),
        "coverage": (100 * inside.mean(axis=(0, 2))).tolist() if told else None,
    }


def against(values: np.ndarray, own: np.ndarray, truth: np.ndarray) -> dict[str, object]:
    """Rms errors over ours on the same conditions, and whether they are clearly smaller."""
    n = min(len(values), len(own))
    both = np.isfinite(values[:n]).all(axis=1)
    theirs, ours = squared(values[:n][both], truth), squared(own[:n][both], truth)
    apart = theirs - ours
    allowed = t.ppf(SURE, len(apart) - 1) * apart.std(axis=0, ddof=1) / np.sqrt(len(apart))
    return {
        "ratio": np.sqrt(theirs.mean(axis=0) / ours.mean(axis=0)).tolist(),
        "clearly_better": (apart.mean(axis=0) + allowed < 0).tolist(),
    }


def found_by(peer: Peer, rows: dict, out: Path) -> tuple[np.ndarray, np.ndarray] | None:
    """Values and half widths of the largest size that it did."""
    done = [size for size, costs in rows[peer.name].items() if "reason" not in costs]
    if not done:
        return None
    with np.load(out / f"{peer.module}_{peer.function}_{max(done)}.npz") as found:
        return found["values"][:MOST], found["half"][:MOST]


def summary(results: dict, out: Path) -> dict:
    """The same with accuracies, and ratios to this package."""
    for rig, part in results["rigs"].items():
        truth = np.array(part["truth"])
        found = {p: found_by(p, part["rows"], out / rig) for p in PEERS if rig in p.rigs}
        values = {p.name: f[0] for p, f in found.items() if f is not None}
        part["accuracy"] = {
            p.name: accuracy(*f, truth) | against(f[0], values[p.beside], truth)
            for p, f in found.items()
            if f is not None
        }
    return results


def verdicts(results: dict) -> list[str]:
    """Where a peer is clearly more accurate on clean records, in words."""
    lost = []
    for peer in (p for p in PEERS if not p.ours):
        rig = peer.rigs[0]
        found = results["rigs"].get(rig, {"accuracy": {}})["accuracy"].get(peer.name)
        for i in np.flatnonzero([] if found is None else found["clearly_better"]):
            name, ratio = NAMES[rig][i], found["ratio"][i]
            lost.append(f"{peer.name}: rms error of {name} {ratio:.2f} of {peer.beside}'s")
    return lost


def _slashed(numbers: list[float] | None, digits: int) -> str:
    if numbers is None:
        return "none given"
    return " / ".join(
        f"{n:.0f}" if n >= 10**digits else f"{n:#.{digits}g}".rstrip(".") for n in numbers
    )


def _accuracy_table(part: dict, rig: str) -> list[str]:
    names = " / ".join(NAMES[rig])
    titles = (rig, "n", f"bias of {names}, %", "rms error, %", "over ours", "interval holds, %")
    lines = [_row(titles), _row(["---"] * len(titles))]
    for name, found in part["accuracy"].items():
        numbers = [_slashed(found[k], d) for k, d in (("bias", 2), ("rmse", 2), ("ratio", 2))]
        count = str(found["conditions"]) + (f" ({found['failed']} no limb)" * bool(found["failed"]))
        lines.append(_row([name, count, *numbers, _slashed(found["coverage"], 3)]))
    return lines


def _row(cells: list[str] | tuple[str, ...]) -> str:
    return "| " + " | ".join(cells) + " |"


def _cost(costs: Costs, own: Costs, itself: bool) -> str:
    if "reason" in costs:
        return str(costs["reason"])
    if itself or "reason" in own:
        return f"{costs['processor_s']:.3g} s / {costs['peak_mb']:.0f} MB"
    ratios = (costs[k] / own[k] for k in ("processor_s", "peak_mb"))
    return " / ".join(f"{r:.2g}" for r in ratios)


def _cost_table(part: dict, rig: str) -> list[str]:
    own = part["rows"][OURS[rig]]
    titles = [f"{rig}: time / memory over ours", *(f"{n:,}" for n in part["sizes"])]
    lines = [_row(titles), _row(["---"] * len(titles))]
    for name, rows in part["rows"].items():
        itself = name == OURS[rig]
        cells = [_cost(rows[n], own[n], itself) if n in rows else "" for n in part["sizes"]]
        lines.append(_row([name, *cells]))
    return lines


def markdown(results: dict) -> str:
    """Two tables of each rig."""
    parts = []
    for rig, part in results["rigs"].items():
        parts += [_accuracy_table(part, rig), _cost_table(part, rig)]
    return "\n\n".join("\n".join(lines) for lines in parts) + "\n"
