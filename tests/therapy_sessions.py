"""Sessions in the simulated therapy robot that several test modules look at, each run once.

A run costs as much as its longest trial has steps, however many trials go through the plant side by
side; so people share one, and movements are three times as fast as the source's. Studies look at
five people; all other tests look at one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

SEED = 3
SPEED_DEG_S = 60.0
#: Whose trunk moves: the horizontal stiffness is another in every repetition.
RESTLESS = "S4"
#: Fewer speeds and angles than a user gets.
CALIBRATION = {"speeds_deg_s": (10.0, 20.0, 40.0), "held_angles": 5}
#: A sweep goes on steadily for 1.5 s at most, where a user's takes 4 s.
STEADY_S = 1.5
SESSION = {"conditions": ("passive", "half_active"), "speed_deg_s": SPEED_DEG_S}


@dataclass(frozen=True)
class People:
    """Recording and truth by the person's name, and what the progress was told."""

    sessions: dict[str, tuple[Any, Any]]
    told: list[tuple[int, int]]


@pytest.fixture(scope="session")
def therapy_people():
    """Five people side by side, three movements in all conditions."""
    from manipulandum_sim.therapy import TherapyOptions, simulate_therapy_many
    from manipulandum_sim.therapy.subject import find_therapy_subject

    tone = np.array([2.0, 0.5, 0.0, 0.0, 0.0])
    toned = replace(find_therapy_subject("P4"), id="P4t", tone_Nm=tone)
    # an able-bodied person whose horizontal rest angle leaves (4) no denominator
    middle = np.array([1.0, np.pi / 4])
    singular = replace(find_therapy_subject("S2"), id="S2m", rest_rad=middle)
    movements = ("elevation", "horizontal", "lowering")
    told: list[tuple[int, int]] = []
    found = simulate_therapy_many(
        ["S1", RESTLESS, "P6", toned, singular],
        SEED,
        options=TherapyOptions(movements=movements, repetitions=3, speed_deg_s=SPEED_DEG_S),
        progress=lambda done, of: told.append((done, of)),
    )
    return People({truth.subject: (recording, truth) for recording, truth in found}, told)


@pytest.fixture(scope="session")
def therapy_able():
    """An able-bodied person, two movements in the conditions that are not resisted."""
    from manipulandum_sim.therapy import simulate_therapy

    conditions = ("passive", "half_active", "active")
    return simulate_therapy(subject="S1", seed=SEED, conditions=conditions, speed_deg_s=SPEED_DEG_S)


@pytest.fixture(scope="session")
def therapy_alone():
    """One of these people alone: recording and truth."""
    from manipulandum_sim.therapy import simulate_therapy

    return simulate_therapy(subject=RESTLESS, seed=SEED, **SESSION)


@pytest.fixture(scope="session")
def therapy_calibration():
    """The empty robot's sweeps and holds: recording and truth."""
    from manipulandum_sim.therapy import calibration

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(calibration, "_LONGEST", ((90.0, STEADY_S),))
        return calibration.simulate_calibration(seed=SEED, **CALIBRATION)


@pytest.fixture(scope="session")
def therapy_mockup():
    """The weighed pipes: recording and truth."""
    from manipulandum_sim.therapy import simulate_mockup

    return simulate_mockup(seed=SEED, speed_deg_s=SPEED_DEG_S, horizontal_deg_s=SPEED_DEG_S)
