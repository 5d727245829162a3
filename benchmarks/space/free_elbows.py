"""K of hands whose elbow is free, over arms whose swivel has other frequencies and damping.

Every session is another arm: swivel of the elbow -29 to 86 degrees, the hand within 6 cm, 5 to 20 %
co-contraction, up to 5 N along each axis, muscles whose viscosity is 15 to 90 ms of their
stiffness. What a mode leaves of a limb
(`hand/still/doubts/inner.py`) was set on other seeds than the default here.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
from collections import Counter
from collections.abc import Iterator
from typing import Any, Final
from unittest.mock import patch

import numpy as np
from tqdm import tqdm

from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.records import Recording
from armimpedance.hand.still import allowing, check_response, estimate
from armimpedance.limb.arm import SpatialArm, TwoLinkArm
from armimpedance.numerics.regression import t_factor
from manipulandum_sim.hand import find_subject
from manipulandum_sim.space import SpaceArm, SpaceCondition, SpaceTruth, simulate_space

CASES: Final[dict[str, dict[str, Any]]] = {
    "bump": {},
    "designed": {"disturbance": "designed"},
    "plateau": {"disturbance": "plateau", "duration_s": 0.5},
    "quiet sensors": {"noise": "sensor"},
}


def arms(seed: int, count: int, rig: dict[str, Any]) -> Iterator[tuple[Recording, SpaceTruth]]:
    """Sessions of 78 trials, each of another arm in balance."""
    who = find_subject("A")
    here = SpaceArm.of(who)
    middle = here.hand(np.array([SpaceCondition().angles]))[0]
    parts = (who.upper_arm, who.forearm_hand)
    links = TwoLinkArm(
        *(who.upper_arm_m, who.forearm_hand_m),
        *(getattr(part, what) for what in ("mass", "com", "inertia") for part in parts),
    )
    inverse = SpatialArm(links)
    made, number = 0, 0
    while made < count:
        number += 1
        rng = np.random.default_rng([seed, number])
        swivel, hand = rng.uniform(-0.5, 1.5), middle + rng.uniform(-0.06, 0.06, 3)
        level = float(np.exp(rng.uniform(np.log(0.05), np.log(0.2))))
        force = tuple(rng.uniform(-5, 5, 3).tolist())
        lag = float(np.exp(rng.uniform(np.log(0.015), np.log(0.09))))
        try:
            q = tuple(inverse.joint_angles(hand, swivel).tolist())
            with patch("manipulandum_sim.space.muscles.LAG_S", lag):
                yield simulate_space(
                    [SpaceCondition(q, level, force)],
                    seed=1000 * seed + number,
                    sets=3,
                    elbow="free",
                    **rig,
                )
        except ArmImpedanceError:
            continue  # out of reach, or a force that these muscles do not bear
        made += 1


def off(one: ImpedanceEstimate, K: np.ndarray) -> tuple[np.ndarray, float, float, float]:
    """Error over the norm of K, its size, part of elements held, half-width, in %."""
    half = t_factor(one.dof) * np.sqrt(np.diag(one.covariance)[18:]).reshape(3, 3)
    error, norm = one.stiffness - K, float(np.linalg.norm(K))
    held = float(np.mean(np.abs(error) <= half))
    size, width = (100 * float(np.linalg.norm(part)) / norm for part in (error, half))
    return 100 * error / norm, size, 100 * held, width


def main() -> None:
    """Print two lines for each case: as a limb of second order, and as `estimate` tells it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", choices=tuple(CASES), nargs="+", default=list(CASES))
    parser.add_argument("--sessions", type=int, default=50)
    parser.add_argument("--seed", type=int, default=20261127)
    asked = parser.parse_args()
    for case in asked.case:
        rows, words = [], Counter[str]()
        sessions = arms(asked.seed, asked.sessions, CASES[case])
        for recording, truth in tqdm(sessions, case, asked.sessions, leave=False, disable=None):
            plain = estimate(recording)
            told = allowing(plain, recording, ["condition"])
            rows.append([off(one, truth.K_e[0]) for one in (plain[0], told[0])])
            words.update(f.name for f in check_response(recording) if f.verdict == "warning")
        for name, column in zip(("second order", "estimate"), zip(*rows, strict=True), strict=True):
            errors, *numbers = zip(*column, strict=True)
            size, held, width = (float(np.mean(number)) for number in numbers)
            bias = float(np.linalg.norm(np.mean(errors, axis=0)))
            print(
                f"{case}, {name}: K {size:.1f} % off, bias {bias:.1f} %, {held:.0f} % held, "
                f"half-width {width:.1f} %"
            )
        print(f"  words of inspect in {asked.sessions}: {dict(words)}")


if __name__ == "__main__":
    main()
