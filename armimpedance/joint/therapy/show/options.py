"""Options of a patient's contribution to movements."""

from __future__ import annotations

from typing import Final

from armimpedance.show.verbs.kinds import AnyWord, PlaceToRead, Switch
from armimpedance.show.verbs.options import DESPITE, Option, Verb

CONTRIBUTION: Final = Verb(
    "contribution",
    (
        Option(
            "robot",
            PlaceToRead("ROBOT.json", "TherapyRobot, RobotCalibration or path"),
            "as `therapy robot` wrote it",
            doc="identified",
            required=True,
        ),
        Option(
            "arm",
            PlaceToRead("ARM.json", "PassiveArm, ArmCalibration or path"),
            "as `therapy arm` wrote it",
            doc="the same person's, measured in the same robot",
            required=True,
        ),
        Option("condition", AnyWord(), "trials of this condition only"),
        Option(
            "unrepeatable",
            Switch(),
            "go on where the passive repetitions of an axis did not agree",
            False,
            doc="go on where the passive repetitions of an axis did not agree; otherwise its "
            "movements are left out",
        ),
        DESPITE,
    ),
)
