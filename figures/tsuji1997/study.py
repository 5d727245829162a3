"""An experiment on a simulated subject, from the recording to the joint level."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Recording, Subject
from armimpedance.hand.levels import arm_posture_for, to_joint
from armimpedance.hand.still import estimate
from armimpedance.limb.arm import arm_of, hand_inertia
from manipulandum_sim.hand import Truth, simulate

if TYPE_CHECKING:
    import pandas as pd

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class StudiedExperiment:
    """What a figure is drawn from.

    Attributes
    ----------
    name : str
        "postures", "cocontraction" or "force".
    subject : Subject
    trials : DataFrame
        The recording's table of trials.
    truth : Truth
        Of the simulated plant; drawn nowhere as if it were measured.
    hand, joint : tuple of ImpedanceEstimate
        One per condition, in the recording's order.
    samples : Recording or None
        None where they were left behind: most figures need the estimates alone.
    """

    name: str
    subject: Subject
    trials: pd.DataFrame
    truth: Truth
    hand: tuple[ImpedanceEstimate, ...]
    joint: tuple[ImpedanceEstimate, ...]
    samples: Recording | None = None

    @property
    def recording(self) -> Recording:
        """What was measured, with its samples.

        Raises
        ------
        InputError
            They were left behind.
        """
        if self.samples is None:
            raise InputError(f"{self.name} without its samples", expected="the recording")
        return self.samples

    def without_samples(self) -> StudiedExperiment:
        """The same for figures of estimates: a thousandth of the bytes."""
        return replace(self, samples=None)

    def of(self, condition: str) -> ImpedanceEstimate:
        """The hand's estimate of one condition."""
        return next(e for e in self.hand if e.keys["condition"] == condition)

    def model_inertia(self, estimate_: ImpedanceEstimate) -> FloatArray:
        """Lambda_e (17) of a two-link arm from the subject's mass and lengths (Winter), kg."""
        posture, _ = arm_posture_for(estimate_, self.subject)
        mass_matrix = arm_of(self.subject).inertia(posture.joint_angles)
        return hand_inertia(posture.jacobian, mass_matrix)


def study(
    experiment: str,
    *,
    subject: str,
    seed: int,
    sets: int,
    conditions: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> StudiedExperiment:
    """Simulate an experiment with nominal noise behind a servo of finite stiffness; analyse it."""
    recording, truth = simulate(
        experiment, subject=subject, seed=seed, sets=sets, conditions=conditions
    )
    hand = estimate(recording, progress=progress)
    joint = [to_joint(e, arm_posture_for(e, recording.subject)[0]) for e in hand]
    found = (recording.subject, recording.trials, truth, tuple(hand), tuple(joint))
    return StudiedExperiment(experiment, *found, samples=recording)
