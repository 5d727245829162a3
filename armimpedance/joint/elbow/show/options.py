"""The options of the analyses of one joint under a random perturbation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from armimpedance.joint.elbow.cascade.methods import CASCADE_METHODS
from armimpedance.joint.elbow.stationary.methods import METHODS
from armimpedance.joint.elbow.varying.methods import VARYING_METHODS
from armimpedance.show.verbs.kinds import (
    AnyWord,
    MethodName,
    Number,
    OneOf,
    PlaceToRead,
    Switch,
    Whole,
)
from armimpedance.show.verbs.options import DESPITE, Option, Verb


@dataclass(frozen=True)
class CourseMethod(MethodName):
    """The method of a course over time; the option without a name means the cascade."""

    @property
    def argparse(self) -> dict[str, Any]:
        """Keywords of the option for `add_argument`."""
        return {"nargs": "?", "const": CASCADE_METHODS.default, "metavar": self.metavar}


#: Options of every analysis: axis, trials, and the STOP findings to overrule.
_OF_EVERY_ANALYSIS: Final = (
    Option("joint", Whole(low=1), "axis, counted from 1 (default: {default})", 1),
    Option("condition", AnyWord(), "trials of this condition only"),
    DESPITE,
)
#: Options of a fit of I, B and K about an operating point.
_AT_ONE_POINT: Final = (
    Option(
        "method",
        MethodName(values=METHODS.names),
        f"{METHODS.listed()}; arx is the source's",
    ),
    Option(
        "cutoff_hz",
        Number(unit="Hz", above=0, word="auto", nothing="none"),
        "edge of the zero-phase low-pass on torque and angle (default: chosen and reported)",
        "auto",
        doc="edge of the zero-phase low-pass on torque and angle; None: no filter; "
        '"auto": chosen from the spectra. Only "arx" filters: for the others it ends the band',
    ),
    Option(
        "decimation",
        Whole(low=1, word="auto"),
        "keep every N-th sample after the filter (default: chosen and reported)",
        "auto",
        doc="every how many samples one is kept after the filter",
    ),
    Option(
        "lowest_hz",
        Number(unit="Hz", above=0),
        "leave out the motion below this: reflexes and what the subject does (default: all)",
        doc='the motion below this frequency is left out; not for "arx"',
    ),
)
_MUSCLES: Final = (
    Option(
        "flexor",
        AnyWord("MUSCLE"),
        "default: the recording's first muscle",
        doc="the muscle that flexes; by default the recording's first",
    ),
    Option(
        "extensor",
        AnyWord("MUSCLE"),
        "default: the second",
        doc="the muscle that extends; by default the recording's second",
    ),
)

ELBOW: Final = Verb(
    "elbow",
    (
        *_AT_ONE_POINT,
        Option(
            "imposed",
            OneOf(values=("position", "torque", "both")),
            "what the rig imposed on the joint, above what recording.json says; both: a device "
            "of finite impedance (default: what the recording says, else the record is asked)",
            doc='what the rig imposed on the joint, above what the recording says; "both": a '
            "device of finite impedance. Where neither says and no command is recorded, the record "
            "is asked",
        ),
        *_OF_EVERY_ANALYSIS,
    ),
)

ELBOW_OVER_TIME: Final = Verb(
    "elbow_over_time",
    (
        Option(
            "method",
            CourseMethod(values=(*VARYING_METHODS, *CASCADE_METHODS)),
            f"B and K over time: {', '.join(VARYING_METHODS)} (windows are the source's); of an "
            f"imposed angle, with a reflex: {', '.join(CASCADE_METHODS)} (default: "
            f"{CASCADE_METHODS.default})",
            VARYING_METHODS.default,
            flag="--time-varying",
            doc='"smoother", "spline", "windows" (the source\'s), "quadratic" or "emg"; for an '
            'imposed angle, with a reflex beside B and K, "cascade", "cascade-smooth", '
            '"cascade-jumps", "ensemble" or "short-segments"',
        ),
        Option(
            "over",
            AnyWord("VARIABLE"),
            "cascade: courses over angle, torque, emg_MUSCLE, phase (0 to 1) or another column",
            doc="the variable of which B, K and the reflex's gain are functions, of the cascade's "
            'methods: "angle" or "torque" (their slow parts), "emg_<muscle>" (its amplitude), '
            '"phase" or another further column of the recording; by default time',
        ),
        Option(
            "aligned",
            Switch(),
            "cascade: trials are realizations of one course",
            False,
            doc="trials are realizations of one course, for the cascade's methods",
        ),
        Option(
            "window_s",
            Number(unit="s", above=0),
            "windows, quadratic: length",
            doc='length of a window of "windows" and "quadratic"',
        ),
        Option(
            "cutoff_hz",
            Number(unit="Hz", above=0, nothing="auto"),
            "highest frequency of the motion that counts (default: read from the torque's "
            "spectrum)",
        ),
        Option(
            "emg_cutoff_hz",
            Number(unit="Hz", above=0),
            "edge of the amplitudes' low-pass, --time-varying emg: the lower, the less noisy, so "
            "long as the muscles are slower (default: 10)",
            doc='edge of the amplitudes\' low-pass of method "emg" (10)',
        ),
        *_MUSCLES,
        *_OF_EVERY_ANALYSIS,
    ),
)

EMG_LAW: Final = Verb(
    "emg_law",
    (
        *_AT_ONE_POINT,
        *_MUSCLES,
        Option(
            "imcj",
            PlaceToRead(),
            "with --emg-law: isometric torques that calibrate the index of co-contraction",
            doc="isometric trials that calibrate the index of co-contraction, which is then "
            "reported for each trial",
        ),
        *_OF_EVERY_ANALYSIS,
    ),
)
