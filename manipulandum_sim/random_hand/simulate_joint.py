"""A session of random perturbations of a wrist or an ankle: (Recording, RandomTruth)."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pandas as pd

from armimpedance.core.conventions import command_columns, perturbation_columns
from armimpedance.core.records import Recording
from manipulandum_sim.random_hand.joint_rig import JointRig
from manipulandum_sim.random_hand.joints import DIRECTIONS, TwoAxisJoint, find_joint
from manipulandum_sim.random_hand.rig import RATE_HZ
from manipulandum_sim.random_hand.simulate import COCONTRACTION, flat, run_session
from manipulandum_sim.random_hand.truth import RandomTruth

#: First number of the random keys of this rig.
JOINT_KEY: Final = 401


def simulate_random_joint(
    *, seed: int, cocontraction: float = COCONTRACTION, **rig: Any
) -> tuple[Recording, RandomTruth]:
    """One person whose wrist or ankle a robot turns at random about both axes.

    Parameters
    ----------
    seed : int
        Every trial draws from a generator of its own.
    cocontraction : float
        Parts of the greatest activation; 0 is a relaxed joint.
    **rig
        Fields of `joint_rig.JointRig`.

    Returns
    -------
    Recording
        Of kind "joint". What the robot was told stands in ``q1_command_rad``, ``q2_command_rad``,
        or ``tau1_perturbation_Nm``, ``tau2_perturbation_Nm`` where the torque is imposed.
    RandomTruth

    Raises
    ------
    InputError
        A number or a name is out of range.
    """
    used = JointRig(**rig)
    limb = find_joint(used.joint, cocontraction, used.reflex.gain if used.reflex else 0.0)
    truth = _truth(used, limb)
    angle, torque, command = run_session(used, limb, truth, seed, JOINT_KEY)
    samples, trials, d = angle.shape
    names = command_columns("joint", d) if used.imposed == "position" else perturbation_columns(d)
    unit = "rad" if used.imposed == "position" else "N m"
    axes = " and ".join(DIRECTIONS[used.joint])
    told = f"simulated {used.joint}, {axes}, random {used.imposed}, {used.size:g} {unit} rms"
    late = f", a reflex of {used.reflex.gain:g} of the muscles' stiffness" if used.reflex else ""
    recording = Recording(
        kind="joint",
        sample_rate_hz=RATE_HZ,
        trials=pd.DataFrame({"trial": np.arange(1, trials + 1), "condition": used.joint}),
        offsets=np.arange(trials + 1) * samples,
        time_s=np.tile(np.arange(samples) / RATE_HZ, trials),
        position=flat(angle),
        force=flat(torque),
        perturbation="stochastic",
        imposed=used.imposed,
        torque="interaction",
        extra=dict(zip(names, flat(command).T, strict=True)),
        provenance=(f"{told}, noise {used.noise!r}{late}", f"seed {seed}"),
    )
    return recording, truth


def _truth(rig: JointRig, limb: TwoAxisJoint) -> RandomTruth:
    M = limb.mass_matrix(limb.posture[None])[0]
    return RandomTruth(
        condition=rig.joint,
        hand=limb.posture,
        force=np.zeros(2),
        M_e=M,
        B_e=limb.viscosity,
        K_e=limb.stiffness,
        M_e_with_handle=M,
        K_e_reflex=limb.reflex,
        reflex_delay_s=rig.reflex.delay_s if rig.reflex else 0.0,
    )
