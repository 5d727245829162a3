"""What `armimpedance elbow` reads, and the fits of the whole and of parts of a recording."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

from armimpedance.errors import EstimationError, InputError, NotIdentifiableError

if TYPE_CHECKING:
    from armimpedance.elbow import ElbowFit
    from armimpedance.records import Recording
    from armimpedance.signals import EmgAmplitude


#: How a part that is one trial is called.
TRIAL = "trial "


def check_choices(arguments: argparse.Namespace) -> None:
    """Refuse options that do not go together, before anything is read.

    Raises
    ------
    InputError
    """
    varying, law = arguments.time_varying is not None, arguments.emg_law
    if varying and law:
        raise InputError("--time-varying with --emg-law", expected="one of them")
    if varying and arguments.method is not None:
        raise InputError("--method with --time-varying", expected="one of them")
    if arguments.window_s is not None and arguments.time_varying not in ("windows", "quadratic"):
        raise InputError("--window-s", expected="it with --time-varying windows or quadratic")
    if arguments.imcj is not None and not law:
        raise InputError("--imcj", expected="it with --emg-law")
    if (arguments.flexor or arguments.extensor) and not (law or arguments.time_varying == "emg"):
        raise InputError("--flexor, --extensor", expected="them with an analysis of EMG")
    decimation(arguments)
    if arguments.emg_cutoff_hz is not None and arguments.time_varying != "emg":
        raise InputError("--emg-cutoff-hz", expected="it with --time-varying emg")
    emg_cutoff(arguments)
    if varying:
        for given, option in (
            (arguments.decimation != "auto", "--decimation"),
            (arguments.lowest_hz is not None, "--lowest-hz"),
        ):
            if given:
                raise InputError(f"{option} with --time-varying", expected="a fit at one point")
        band_edge(arguments)
    else:
        cutoff(arguments)
        lowest(arguments)


def fit_recording(recording: Recording, arguments: argparse.Namespace) -> ElbowFit:
    """I, B and K of all trials together; errors name the recording."""
    from armimpedance.cli.parts.checks import naming
    from armimpedance.elbow import DEFAULT, from_recording, identify_elbow

    with naming(arguments.recording):
        return identify_elbow(
            from_recording(recording, arguments.joint),
            method=arguments.method or DEFAULT,
            cutoff_hz=cutoff(arguments),
            decimation=decimation(arguments),
            lowest_hz=lowest(arguments),
        )


def fit_parts(recording: Recording, arguments: argparse.Namespace) -> dict[str, ElbowFit]:
    """The same of each condition, where there are several, else of each trial.

    A part that does not allow a fit of its own is left out.
    """
    trials = recording.trials
    conditions = trials["condition"].astype(str)
    label = conditions if conditions.nunique() > 1 else TRIAL + trials["trial"].astype(str)
    parts: dict[str, ElbowFit] = {}
    if label.nunique() < 2:
        return parts
    for name in label.unique():
        try:
            parts[name] = fit_recording(recording.select((label == name).to_numpy()), arguments)
        except (InputError, EstimationError, NotIdentifiableError):
            continue
    return parts


def with_pooling_told(fit: ElbowFit, parts: dict[str, ElbowFit]) -> ElbowFit:
    """The pooled fit, with a warning where conditions differ by more than their intervals allow."""
    from armimpedance.elbow import NAMES

    if any(label.startswith(TRIAL) for label in parts):
        return fit
    apart = []
    for i, name in enumerate(NAMES):
        limits = [(p.interval[i][0], p.interval[i][1], p.values[i]) for p in parts.values()]
        if limits and max(low for low, _, _ in limits) > min(high for _, high, _ in limits):
            values = [value for _, _, value in limits]
            apart.append(f"{name} from {min(values):.3g} to {max(values):.3g}")
    if not apart:
        return fit
    told = f"pooled, though its conditions differ beyond their intervals: {', '.join(apart)}"
    return replace(fit, summary=replace(fit.summary, warnings=(*fit.summary.warnings, told)))


def amplitudes(recording: Recording, arguments: argparse.Namespace) -> EmgAmplitude:
    """EMG amplitude of flexor and extensor, in this order.

    Raises
    ------
    InputError
        As `two_muscles`, or EMG that cannot be used.
    """
    from armimpedance.signals import emg_amplitude

    muscles = two_muscles(recording, arguments)
    return emg_amplitude(muscles, cutoff_hz=emg_cutoff(arguments))


def emg_cutoff(arguments: argparse.Namespace) -> float:
    """Of --emg-cutoff-hz, Hz."""
    from armimpedance.cli.parts.checks import number
    from armimpedance.signals import CUTOFF_HZ

    word = arguments.emg_cutoff_hz
    return CUTOFF_HZ if word is None else number(word, "--emg-cutoff-hz", "more than 0 Hz")


def two_muscles(recording: Recording, arguments: argparse.Namespace) -> Recording:
    """The recording with the EMG of flexor and extensor alone, in this order.

    Raises
    ------
    InputError
        There is no EMG, no such muscle, or which is which is not known.
    """
    muscles = recording.muscles
    if recording.emg is None or not muscles:
        raise InputError("no EMG in the recording", expected="columns emg_<muscle>")
    named = (arguments.flexor, arguments.extensor)
    if named == (None, None) and len(muscles) == 2:
        named = muscles
    if None in named or len(set(named)) != 2 or not set(named) <= set(muscles):
        raise InputError(
            f"which muscle of {', '.join(muscles)} flexes and which extends?",
            expected="--flexor and --extensor, each naming one of them",
        )
    columns = [muscles.index(m) for m in named]
    return replace(recording, emg=recording.emg[:, columns], muscles=named)


def cutoff(arguments: argparse.Namespace) -> float | None | Literal["auto"]:
    """Of --cutoff-hz: Hz, None for no filter, or to be chosen."""
    from armimpedance.cli.parts.checks import number

    word = arguments.cutoff_hz
    if word == "auto":
        return "auto"
    return None if word == "none" else number(word, "--cutoff-hz", "more than 0 Hz, auto or none")


def lowest(arguments: argparse.Namespace) -> float | None:
    """Of --lowest-hz: where the band of the fit begins; None: at the lowest frequency."""
    from armimpedance.cli.parts.checks import number

    word = arguments.lowest_hz
    return None if word is None else number(word, "--lowest-hz", "more than 0 Hz")


def band_edge(arguments: argparse.Namespace) -> float | None:
    """Of --cutoff-hz with --time-varying: the motion's highest frequency; None: to be chosen."""
    found = cutoff(arguments)
    if found is None:
        raise InputError("--cutoff-hz none with --time-varying", expected="Hz or auto")
    return None if found == "auto" else found


def decimation(arguments: argparse.Namespace) -> int | Literal["auto"]:
    """Of --decimation: a whole number, or to be chosen."""
    word = arguments.decimation
    if word == "auto":
        return "auto"
    if not word.isdigit() or int(word) < 1:
        raise InputError(f"--decimation {word}", expected="1, 2, 3, ... or auto")
    return int(word)
