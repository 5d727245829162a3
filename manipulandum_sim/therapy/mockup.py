"""Two pipes in place of an arm: does the robot measure what they weigh? (Guidali 2013, Fig. 4)"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, get_args

import numpy as np
import pandas as pd

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from manipulandum_sim.therapy.arm import pipe_arm
from manipulandum_sim.therapy.calibration import Seeds, therapy_recording
from manipulandum_sim.therapy.control import POSITION, TherapyController, identified
from manipulandum_sim.therapy.device import RATE_HZ, TherapyDevice, therapy_device
from manipulandum_sim.therapy.people import arm_payload
from manipulandum_sim.therapy.plan import OF_SESSION, Noise, Streams
from manipulandum_sim.therapy.plant import Progress, run
from manipulandum_sim.therapy.record import RUN_IN_S
from manipulandum_sim.therapy.reference import REST_S, Movement, Reference, SPEED_deg_s, reference
from manipulandum_sim.therapy.truth import TherapyMotion, TherapyTruth

#: Elevation up and down through a wide range at constant speed, where only gravity counts; about
#: the vertical axis with the arm level, where only inertia does.
MOCKUP_MOVEMENTS: Final = (
    Movement("elevation", 0, (35.0, 0.0, 0.0, 0.0, 0.0), 130.0),
    Movement("lowering", 0, (130.0, 0.0, 0.0, 0.0, 0.0), 35.0),
    Movement("horizontal", 1, (90.0, 0.0, 0.0, 0.0, 0.0), 90.0),
    Movement("horizontal_back", 1, (90.0, 90.0, 0.0, 0.0, 0.0), 0.0),
)
#: Mean speed about the vertical axis: the faster, the more inertia there is to see.
HORIZONTAL_deg_s: Final = 40.0
#: In which a constant speed is reached and left, s.
RAMP_S: Final = 0.4


def simulate_mockup(
    *,
    seed: int = 0,
    repetitions: int = 3,
    speed_deg_s: float = SPEED_deg_s,
    horizontal_deg_s: float = HORIZONTAL_deg_s,
    noise: Noise = "nominal",
    device: TherapyDevice | None = None,
    progress: Progress | None = None,
) -> tuple[Recording, TherapyTruth]:
    """The mock-up's session, and its truth.

    Parameters
    ----------
    seed : int
        A trial's noise depends on seed and the trial's number alone.
    repetitions : int
        Of each of `MOCKUP_MOVEMENTS`.
    speed_deg_s : float
        Constant, of elevation and lowering.
    horizontal_deg_s : float
        Mean, of the minimum-jerk movements.
    noise : {"nominal", "none"}
    device : TherapyDevice, optional
    progress : function, optional
        Called with how many steps are done, of how many.

    Returns
    -------
    (Recording, TherapyTruth)
        Condition "passive". `onset_s` and `end_s` bracket the constant speed, or the whole of a
        minimum-jerk movement.

    Raises
    ------
    InputError
        An argument that makes no recording.
    """
    if noise not in get_args(Noise):
        raise InputError(f"no noise level {noise!r}", expected=" or ".join(get_args(Noise)))
    if not 1 <= repetitions <= 100:
        raise InputError(f"{repetitions} repetitions", expected="1 to 100")
    own, arm = device or therapy_device(), pipe_arm()
    movements = [movement for movement in MOCKUP_MOVEMENTS for _ in range(repetitions)]
    asked = _reference(movements, speed_deg_s, horizontal_deg_s)
    lengths = np.round((asked.end_s + REST_S) * RATE_HZ).astype(np.int64) + 1
    samples, payload = int(lengths.max()), arm_payload([arm] * len(movements), own)
    model = identified(own, Streams(seed, "").of(OF_SESSION))
    modes = np.full(len(movements), POSITION)
    motion = run(
        own,
        payload,
        asked.start,
        TherapyController.of(model, payload.upper_arm_m, asked, modes),
        samples,
        run_in=round(RUN_IN_S * RATE_HZ),
        measured=noise != "none",
        progress=progress,
    )
    told = np.stack([asked.at(k / RATE_HZ)[0] for k in range(samples)])
    said = f"Simulated: two pipes in the therapy robot {own.name}, seed {seed}, noise {noise}."
    subject = Subject("mock-up", upper_arm_m=arm.upper_arm_m)
    table, seeds = _table(movements, asked, repetitions), Seeds(seed, "mock-up")
    recording = therapy_recording(own, motion, told, table, lengths, seeds, noise, subject, said)
    exact = TherapyMotion.of(motion, lengths)
    fitted = own.adjusted_to(arm.upper_arm_m)
    return recording, TherapyTruth.of("mock-up", "mock-up", fitted, recording.offsets, exact)


def _reference(movements: list[Movement], speed_deg_s: float, horizontal_deg_s: float) -> Reference:
    """Constant speeds about axis 1, minimum jerk about axis 2."""
    steady, smooth = reference(movements, speed_deg_s), reference(movements, horizontal_deg_s)
    raised = np.array([movement.axis == 0 for movement in movements])
    ramps = np.where(raised, RAMP_S, 0.0)
    duration = np.where(raised, steady.duration_s + RAMP_S, smooth.duration_s)
    return replace(smooth, duration_s=duration, ramp_s=ramps)


def _table(movements: list[Movement], asked: Reference, repetitions: int) -> pd.DataFrame:
    count = len(movements)
    return pd.DataFrame(
        {
            "trial": np.arange(count) + 1,
            "condition": "passive",
            "movement": [movement.name for movement in movements],
            "axis": [movement.axis + 1 for movement in movements],
            "onset_s": np.round(asked.begin_s + asked.ramp_s, 6),
            "end_s": np.round(asked.end_s - asked.ramp_s, 6),
            "repetition": np.arange(count) % repetitions + 1,
        }
    )
