"""The records that every peer gets: limbs whose M, B, K are known, with the noise of people.

*hand*: `armimpedance.lab.simulate_study.rigs.linear`, a linear limb that is pushed by 5 mm and back
within .3 s in eight directions; tremor, slow voluntary force, drift, sensors' noise and steps.
*joint*: `manipulandum_sim.elbow.simulate_bench`, 10 s of random torque below 10 Hz, both channels
with white noise of 20 dB. *reflex*: the same joint with a torque against the deflection of 60 ms
ago, a quarter of its stiffness. Samples are kept as 32 bit floats, alike for all.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from armimpedance.lab.simulate_study.rigs.linear import LIMB, RATE_HZ, REST_S, linear_window
from manipulandum_sim.elbow import Departures, simulate_bench

#: Trials of a condition.
EACH = 25
#: Hand trials that are simulated at once; a multiple of the eight directions and of EACH.
AT_ONCE = 1000
#: I (kg m^2), B (N m s/rad), K (N m/rad) of a joint that swings.
JOINT = (0.07, 0.6, 20.0)
SNR_DB = 20.0
REFLEX = Departures(answer=JOINT[2] / 4, delay_s=0.06)


def make_hand(folder: Path, trials: int, seed: int = 20) -> np.ndarray:
    """Write `trials` pushes; the first of a larger record are those of a smaller one.

    Returns
    -------
    (12,)
        The truth: M, B, K row by row.
    """
    folder.mkdir(parents=True, exist_ok=True)
    samples = round((0.3 + 2 * REST_S) * RATE_HZ) + 1
    out = {
        name: np.lib.format.open_memmap(
            folder / f"{name}.npy", "w+", np.float32, (trials, samples, 2)
        )
        for name in ("position", "force")
    }
    for block, start in enumerate(range(0, trials, AT_ONCE)):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(block,)))
        window = linear_window("nominal", rng, trials=AT_ONCE)
        stop = min(start + AT_ONCE, trials)
        for name, array in out.items():
            array[start:stop] = getattr(window, name)[: stop - start]
    told = {"rate_hz": RATE_HZ, "rest_s": REST_S, "each": EACH}
    (folder / "told.json").write_text(json.dumps(told))
    return LIMB.ravel()


def make_joint(
    folder: Path, trials: int, seed: int = 20, departures: Departures | None = None
) -> np.ndarray:
    """Write `trials` records of a joint; returns its I, B, K (3,).

    The first of a larger record are those of a smaller one.
    """
    folder.mkdir(parents=True, exist_ok=True)
    recording, _ = simulate_bench(
        *JOINT, snr_db=SNR_DB, trials=trials, seed=seed, departures=departures
    )
    for name, column in (("angle", recording.position), ("torque", -recording.force)):
        np.save(folder / f"{name}.npy", column.reshape(trials, -1).astype(np.float32))
    rate = float(recording.sample_rate_hz)
    (folder / "told.json").write_text(json.dumps({"rate_hz": rate}))
    return np.array(JOINT)


def make_reflex(folder: Path, trials: int) -> np.ndarray:
    """Records of the joint with its reflex; I, B, K are those beside the reflex."""
    return make_joint(folder, trials, departures=REFLEX)


MAKERS = {"hand": make_hand, "joint": make_joint, "reflex": make_reflex}
