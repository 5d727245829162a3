"""A person in a therapy robot: how much of each movement is the person's own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark import AskedGroup
from armimpedance.lab.benchmark_command.task import Made, Task
from armimpedance.lab.parts.simulation import DRAWINGS_FILE

#: One seed for the one robot that all persons sit in.
_ROBOT_SEED: Final = 1
_SPEEDS_DEG_S: Final = (0.5, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0)


def _draw(seed: int) -> Made:
    from manipulandum_sim.therapy import THERAPY_SUBJECTS, simulate_therapy

    rng = np.random.default_rng(seed)
    person = replace(
        THERAPY_SUBJECTS["P3"],
        id="person",
        mass_kg=rng.uniform(50, 95),
        height_m=rng.uniform(1.55, 1.95),
        stiffness=rng.uniform([4.0, 1.0], [12.0, 6.0]),
        rest_rad=rng.uniform([0.6, -0.8], [1.4, 0.4]),
        active_share=rng.uniform(-0.3, 1.0),
    )
    recording, truth = simulate_therapy(
        subject=person, seed=seed, repetitions=3, conditions=("passive", "active"), exact=False
    )
    active = recording.trials["condition"] == "active"
    trials = recording.trials["trial"]
    shares = np.asarray(truth.contribution)
    values = {f"trial_{trials[t]}": float(shares[t]) for t in np.flatnonzero(active)}

    def recordings() -> dict[str, Any]:
        return {"recording": recording}

    return Made((AskedGroup("share", "%", values, 100.0),), recordings, body_told=True)


def _share(folder: Path) -> None:
    """The empty robot, which is the same for all."""
    from armimpedance.joint.therapy.show import write_robot
    from armimpedance.lab.benchmark_command.task import nameless
    from armimpedance.lab.simulated.therapy import drawings_of
    from armimpedance.recordings import write_recording
    from manipulandum_sim.therapy import simulate_calibration, therapy_device

    recording, _ = simulate_calibration(seed=_ROBOT_SEED, speeds_deg_s=_SPEEDS_DEG_S)
    write_recording(nameless(recording, body_told=False), folder / "calibration")
    write_robot(drawings_of(therapy_device()), folder / DRAWINGS_FILE)


TASK: Final = Task(
    line="A patient in a robot for arm therapy: how much of each movement is the patient's own.",
    asks="""
`calibration` holds sweeps and holds of the empty robot, `drawings.json` its links and motors; they
are the same for all records. In a record lies `recording`: movements of a person in it, angles and
motors' torques; first the passive ones, then the active ones. Asked of each active trial:
`100 sum tau_user / sum tau_h` over its samples from onset to end about the moving axis, where
tau_user is the person's torque beyond the passive arm, tau_h what the passive arm needs.
""",
    draw=_draw,
    share=_share,
)
