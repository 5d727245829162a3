"""The options of a plan."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from armimpedance.hand.planning.shapes import SHAPES
from armimpedance.hand.show.options import FORCE_BY
from armimpedance.hand.show.wish import (
    K_PERCENT,
    MAX_TRIALS,
    ORIENTATION_DEG,
    WISH,
    max_acceleration,
)
from armimpedance.show.verbs.kinds import (
    AnyWord,
    MethodName,
    Milli,
    Number,
    OneOf,
    PlaceToRead,
    Switch,
    Whole,
)
from armimpedance.show.verbs.options import DESPITE, Option, Verb

#: The name for all shapes that are compared.
ALL: Final = "all"
_ARM: Final = "arm and noise"
_COURSE: Final = "disturbance"

PLAN: Final = Verb(
    "plan",
    (
        Option(
            "pilot",
            PlaceToRead(),
            "arm and noise from it",
            group=_ARM,
            doc="disturbances of the hand that return; its own disturbance is put first",
        ),
        Option(
            "results",
            PlaceToRead("RESULTS", "path"),
            "arm from a row of it",
            group=_ARM,
            doc="a RESULTS.csv, instead of a pilot",
        ),
        Option(
            "condition",
            AnyWord(),
            "a condition of the pilot or the results (default: the first)",
            group=_ARM,
        ),
        Option(
            "noise",
            OneOf(values=("nominal", "sensor")),
            "of the measurement (default: nominal); a pilot brings its own",
            group=_ARM,
        ),
        replace(FORCE_BY, group=_ARM, doc=f"{FORCE_BY.doc}, of a pilot"),
        replace(
            DESPITE,
            group=_ARM,
            doc="names of checks of `inspect` whose STOP is overruled for the pilot; the plan "
            "says so",
        ),
        K_PERCENT,
        ORIENTATION_DEG,
        MAX_TRIALS,
        Option(
            "conditions",
            Whole(low=1),
            "conditions of as many trials in a session (default: {default})",
            1,
            group=WISH,
            doc="conditions of as many trials that a session has: together they exclude more "
            "departures, such as a reflex, and their intervals become narrower",
        ),
        Option(
            "shape",
            MethodName(values=(ALL, *SHAPES.names)),
            f"all (default), {SHAPES.listed()}",
            ALL,
            group=_COURSE,
            doc='a shape by its name, such as "minimum_jerk" or "designed", or "all"',
        ),
        Option(
            "duration_s",
            Number(unit="s", low=0.02, high=2),
            "of the disturbance (default: 0.15, 0.2 and 0.3; of a design 0.3)",
            group=_COURSE,
        ),
        Option(
            "amplitude_m",
            Milli(unit="m", above=0, high=0.05),
            "of the disturbance (default: at most 5 mm)",
            flag="--amplitude-mm",
            group=_COURSE,
            doc="default: 0.005, less where the acceleration asks for it. With a shape that is "
            "named, this amplitude is kept or refused",
        ),
        max_acceleration(_COURSE),
        Option(
            "design",
            Switch(),
            "optimise a disturbance",
            False,
            group=_COURSE,
            doc="design a disturbance for this arm, noise, servo and these limits",
        ),
        Option(
            "separate_reflex",
            Switch(),
            "design for K and a reflex apart",
            False,
            group=_COURSE,
        ),
        Option(
            "reflex_delay_s",
            Milli(unit="s", low=0.01, high=0.2),
            "delay of the reflex that is asked about (default: {default} ms)",
            0.055,
            flag="--reflex-delay-ms",
            group=_COURSE,
            doc="delay of the reflex that is asked about; default: 0.055",
        ),
    ),
)
