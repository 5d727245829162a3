"""Submissions of other packages, by what benchmarks/peers makes of a hand or a joint with them.

    PYTHONPATH=benchmarks/peers:benchmarks/open peers-env/bin/python benchmarks/open/peers.py \
        BENCHMARK OUT [NAME ...]

The environment is that of benchmarks/peers/environment.txt, and pyarrow.
"""

from __future__ import annotations

import importlib
import logging
import sys
import warnings
from functools import partial
from pathlib import Path

import numpy as np
from lab_script import trials_of
from record import Hand, Joint
from rows import Answer, write_submission

HANDS = ("hand_ideal", "hand_soft", "hand_reflex", "hand_mixed")
JOINTS = ("joint_torque", "joint_position", "joint_reflex")
#: Of a window that every trial has, s from the onset.
BEFORE_S, AFTER_S = 0.16, 0.46
ELEMENTS = [f"{name}_{i}{j}" for name in "MBK" for i in (1, 2) for j in (1, 2)]
#: Name -> module, function, tasks.
PEERS = {
    "statsmodels": ("with_statsmodels", {"hand": HANDS, "joint": JOINTS}),
    "statsmodels-drift": ("with_statsmodels", {"hand_drift": HANDS}),
    "sippy-arx": ("with_sippy", {"joint_arx": JOINTS}),
    "sippy-oe": ("with_sippy", {"joint_oe": JOINTS}),
    "sippy-parsim-k": ("with_sippy", {"hand": HANDS}),
    "sysidentpy": ("with_sysidentpy", {"joint": JOINTS}),
    "mujoco-sysid": ("with_mujoco", {"hand_inverse": HANDS, "joint": JOINTS}),
}


def hand(record: Path, module: str, function: str) -> Answer:
    """M, B, K of one condition; the handle's mass is taken off M."""
    table, trials, told = trials_of(record)
    rate = told["sample_rate_hz"]
    position, force = [], []
    for (_, row), samples in zip(table.iterrows(), trials, strict=True):
        onset = round(row["onset_s"] * rate)
        rows = slice(onset - round(BEFORE_S * rate), onset + round(AFTER_S * rate) + 1)
        position.append(samples[["x_m", "y_m"]].to_numpy()[rows])
        force.append(samples[["fx_N", "fy_N"]].to_numpy()[rows])
    lag = np.arange(len(position[0])) / rate - BEFORE_S
    given = Hand(rate, lag, np.stack(position), np.stack(force), len(trials))
    values, half = getattr(importlib.import_module(module), function)(given)
    values = values[0] - told.get("handle_mass_kg", 0.0) * np.isin(ELEMENTS, ["M_11", "M_22"])
    return answer(ELEMENTS, values, half[0])


def joint(record: Path, module: str, function: str) -> Answer:
    """I, B, K."""
    _, trials, told = trials_of(record)
    angle, torque = (np.stack([t[c] for t in trials]) for c in ("q1_rad", "tau1_Nm"))
    work = getattr(importlib.import_module(module), function)
    values, half = work(Joint(told["sample_rate_hz"], angle, -torque))
    return answer(list("IBK"), values[0], half[0])


def answer(names: list[str], values: np.ndarray, half: np.ndarray) -> Answer:
    """Rows with limits; a half width of NaN: none."""
    return Answer([(n, v, v - h, v + h) for n, v, h in zip(names, values, half, strict=True)])


def main(benchmark: str, out: str, *names: str) -> None:
    """Write the submissions that are named, or all."""
    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    Path(out).mkdir(parents=True, exist_ok=True)
    for name in names or PEERS:
        module, functions = PEERS[name]
        methods = {
            task: partial(hand if task in HANDS else joint, module=module, function=function)
            for function, tasks in functions.items()
            for task in tasks
        }
        write_submission(Path(benchmark), Path(out) / f"{name}.csv", methods)


if __name__ == "__main__":
    main(*sys.argv[1:])
