"""What `armimpedance elbow` is asked: which analysis, and which options have a meaning in it."""

from __future__ import annotations

import argparse
from typing import Any, Final, Literal

from armimpedance.core.errors import InputError

#: Analyses beside the courses over time, which have their methods' names.
FIT: Final = "fit"
LAW: Final = "law"
_AT_ONE_POINT: Final = ((FIT, LAW), "it without --time-varying")
#: Methods for two pathways that take trials as they come.
_PRIORS: Final = ("cascade", "cascade-smooth", "cascade-jumps")
#: Option -> the analyses in which it has a meaning, and how a message puts that.
_MEANT_FOR: Final[dict[str, tuple[tuple[str, ...], str]]] = {
    "--method": _AT_ONE_POINT,
    "--decimation": _AT_ONE_POINT,
    "--lowest-hz": _AT_ONE_POINT,
    "--imposed": ((FIT,), "it without --time-varying and --emg-law"),
    "--window-s": (("windows", "quadratic"), "it with --time-varying windows or quadratic"),
    "--imcj": ((LAW,), "it with --emg-law"),
    "--flexor": ((LAW, "emg"), "it with an analysis of EMG: --emg-law or --time-varying emg"),
    "--extensor": ((LAW, "emg"), "it with an analysis of EMG: --emg-law or --time-varying emg"),
    "--emg-cutoff-hz": (("emg",), "it with --time-varying emg"),
    "--over": (_PRIORS, "it with --time-varying cascade"),
    "--aligned": ((*_PRIORS, "ensemble", "short-segments"), "it with --time-varying cascade"),
}


def analysis_of(arguments: argparse.Namespace) -> str:
    """Which analysis is asked for: "fit", "law" or a time-varying method's name.

    Raises InputError: two of them, an unknown method, or an option that has no effect on this one.
    """
    from armimpedance.joint.elbow.cascade.methods import CASCADE_METHODS
    from armimpedance.joint.elbow.stationary.methods import METHODS
    from armimpedance.joint.elbow.varying.methods import VARYING_METHODS

    course = arguments.time_varying
    if course is not None and arguments.emg_law:
        raise InputError("--time-varying with --emg-law", expected="one of them")
    METHODS.named(arguments.method)
    analysis = LAW if arguments.emg_law else FIT
    if course is not None:
        names = (*VARYING_METHODS, *CASCADE_METHODS)
        if course not in names:
            raise InputError(f"unknown method {course!r}", expected=f"one of {', '.join(names)}")
        analysis = course
    for option, (analyses, expected) in _MEANT_FOR.items():
        given = getattr(arguments, option[2:].replace("-", "_")) not in (None, False, "auto")
        if given and analysis not in analyses:
            raise InputError(f"{option} has no effect here", expected=expected)
    return analysis


def options_of(arguments: argparse.Namespace, analysis: str) -> dict[str, Any]:
    """The options of this analysis as its verb takes them.

    Raises InputError: a word that is no number, or none that the option allows.
    """
    common = {name: getattr(arguments, name) for name in ("joint", "condition", "despite")}
    muscles = {"flexor": arguments.flexor, "extensor": arguments.extensor}
    if analysis in (FIT, LAW):
        at_one_point = {
            "method": arguments.method,
            "cutoff_hz": _cutoff(arguments.cutoff_hz),
            "decimation": _decimation(arguments.decimation),
            "lowest_hz": _positive(arguments.lowest_hz, "--lowest-hz"),
        }
        of_fit, of_law = {"imposed": arguments.imposed}, {**muscles, "imcj": arguments.imcj}
        return {**common, **at_one_point, **(of_fit if analysis == FIT else of_law)}
    edge = _cutoff(arguments.cutoff_hz)
    if edge is None:
        raise InputError("--cutoff-hz none with --time-varying", expected="Hz or auto")
    return {
        **common,
        **muscles,
        "method": analysis,
        "window_s": arguments.window_s,
        "over": arguments.over,
        "aligned": arguments.aligned,
        "cutoff_hz": None if edge == "auto" else edge,
        "emg_cutoff_hz": _positive(arguments.emg_cutoff_hz, "--emg-cutoff-hz"),
    }


def _cutoff(word: str) -> float | None | Literal["auto"]:
    """Hz, None for no filter, or to be chosen."""
    from armimpedance.show.command.outputs import number

    if word == "auto":
        return "auto"
    return None if word == "none" else number(word, "--cutoff-hz", "more than 0 Hz, auto or none")


def _positive(word: str | None, option: str) -> float | None:
    from armimpedance.show.command.outputs import number

    return None if word is None else number(word, option, "more than 0 Hz")


def _decimation(word: str) -> int | Literal["auto"]:
    """A whole number, or to be chosen."""
    if word == "auto":
        return "auto"
    if not word.isdigit() or int(word) < 1:
        raise InputError(f"--decimation {word}", expected="1, 2, 3, ... or auto")
    return int(word)
