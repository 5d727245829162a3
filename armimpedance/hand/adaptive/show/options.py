"""The options of the next pushes of an experiment."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from armimpedance.hand.show.wish import (
    K_PERCENT,
    MAX_TRIALS,
    ORIENTATION_DEG,
    WISH,
    max_acceleration,
)
from armimpedance.show.verbs.kinds import Milli, Number, SeveralWords, Whole
from armimpedance.show.verbs.options import DESPITE, Option, Verb

_ROBOT: Final = "robot and person"

NEXT: Final = Verb(
    "next_trials",
    (
        K_PERCENT,
        ORIENTATION_DEG,
        Option(
            "joint_percent",
            Number(unit="%", above=0),
            "the joints' K within so many per cent",
            group=WISH,
            doc="as `k_percent`, of the joints' stiffness",
        ),
        Option(
            "reflex_percent",
            Number(unit="%", above=0),
            "an answer 55 ms late within so many per cent of K",
            group=WISH,
            doc="half the interval of an answer to what was 55 ms earlier, in per cent of K",
        ),
        Option(
            "difference_percent",
            Number(unit="%", above=0),
            "tell two conditions apart whose K differs in size by so many per cent",
            group=WISH,
            doc="two conditions whose ellipses of K differ in size by this are to be told apart",
        ),
        Option(
            "between", SeveralWords(python="(str, str)", count=2), "the two conditions", group=WISH
        ),
        Option(
            "power",
            Number(low=0.5, below=1),
            "probability that the two are told apart (default: {default})",
            0.9,
            group=WISH,
        ),
        Option(
            "conditions",
            SeveralWords(python="str or sequence of str"),
            "conditions of the experiment (default: the recording's)",
            group=WISH,
        ),
        Option("count", Whole(low=1), "pushes to choose now (default: {default})", 8, group=WISH),
        MAX_TRIALS,
        Option(
            "seed",
            Whole(low=0),
            "of the order (default: {default})",
            0,
            group=WISH,
            doc="of the order; with the same recording it gives the same pushes",
        ),
        Option(
            "shapes",
            SeveralWords(),
            "courses that the robot can run (default: those that `plan` compares)",
            group=_ROBOT,
            doc="courses that the robot can run, by their names. Default: those that `plan` "
            "compares",
        ),
        Option(
            "amplitude_m",
            Milli(unit="m", above=0),
            "a push is at most so long, mm (default: {default})",
            0.005,
            flag="--amplitude-mm",
            group=_ROBOT,
            doc="a push is at most so long",
        ),
        Option(
            "max_duration_s",
            Number(unit="s", above=0),
            "a push lasts at most so long (default: {default})",
            0.3,
            group=_ROBOT,
        ),
        max_acceleration(_ROBOT),
        Option(
            "most_alike",
            Whole(low=1),
            "pushes along the same way after each other (default: {default})",
            2,
            group=_ROBOT,
            doc="at most so many pushes along the same way after each other",
        ),
        Option(
            "rest_every",
            Whole(low=1),
            "pushes between rests of a minute (default: {default})",
            40,
            group=_ROBOT,
            doc="after so many pushes there is a rest of a minute",
        ),
        replace(DESPITE, group="checks"),
    ),
)
