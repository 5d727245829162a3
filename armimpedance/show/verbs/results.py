"""The start of every verb: a recording or its path, and groups looked up by their values."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.core.motion import MarkerRecording
from armimpedance.core.records import Recording
from armimpedance.recordings import AnyRecording, ReadOptions, open_recording, read_skeleton
from armimpedance.show.files import read_left_out
from armimpedance.show.verbs.chosen import ChosenPath

# What every analysis starts from: a recording, or the path of one.

#: A path, as functions that take a recording or its path accept it.
PathLike = str | os.PathLike[str]


def read(
    source: AnyRecording | PathLike,
    *,
    force_by: Literal["limb", "device"] | None = None,
    **options: Any,
) -> AnyRecording:
    """The recording at a path, in whichever of the known formats it is.

    Parameters
    ----------
    source : recording or path
        A recording is returned as it is.
    force_by : {"limb", "device"}, optional
        Whose force on the other a Kinarm's sensor holds; without it, it is found from the robot's
        own inertias and motor torques or refused. Other formats say it themselves.
    **options
        Further fields of `recordings.ReadOptions`, such as `side`, `onset_event`, `end_event`,
        `protocols`, `events`, `without_errors`, `where`, `emg_channels`, `mapping`, `skeleton`
        (also the path of a skeleton.json).

    Returns
    -------
    Recording, MarkerRecording or MotionRecording
        Trials of the hand or of joints; markers; joint motion.

    Raises
    ------
    InputError
        There is nothing at the path, it cannot be read, or an option has no meaning for its
        format; the message names file and place.
    TypeError
        Something else is given; the message says what.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> session, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> with TemporaryDirectory() as folder:
    ...     ai.write_recording(session, f"{folder}/session")
    ...     read_back = ai.read(f"{folder}/session")
    >>> read_back.n_trials
    8
    """
    if not isinstance(source, str | os.PathLike):
        if isinstance(source, get_args(AnyRecording)):
            return source
        raise TypeError(
            f"got {type(source).__name__}: a recording or its path is expected; `ai.recording` "
            "makes one of tables and lists of trials"
        )
    if isinstance(source, ChosenPath):
        recording = read(Path(source), force_by=force_by, **{**source.options, **options})
        return recording if source.leave_out is None else _without_trials(recording, source)
    if isinstance(options.get("skeleton"), str | os.PathLike):
        options["skeleton"] = read_skeleton(options["skeleton"])
    return open_recording(source, ReadOptions(force_by=force_by, **options))


def _without_trials(recording: AnyRecording, source: ChosenPath) -> Recording:
    """A recording without the trials of the list that goes with its path."""
    if isinstance(recording, Recording):
        return without_trials(recording, source.leave_out)
    raise InputError(
        "a recording without numbered trials", file=source, expected="none, without --leave-out"
    )


def read_recording(
    source: AnyRecording | PathLike,
    *,
    condition: str | None = None,
    force_by: Literal["limb", "device"] | None = None,
    **options: Any,
) -> Recording:
    """The recording of the hand or of joints at a path; any other one is refused.

    `condition`: only the trials of this condition.
    `**options`: see `read`.
    Raises InputError: as `read`; it is a recording of markers or of joint motion, which other verbs
    take; or there is no such condition.
    """
    recording = read(source, force_by=force_by, **options)
    if isinstance(recording, Recording):
        with naming(source):
            return of_condition(recording, condition)
    what = "markers" if isinstance(recording, MarkerRecording) else "joint motion"
    raise InputError(
        f"a recording of {what}: `passive` and `body` take it",
        file=source if isinstance(source, str | os.PathLike) else None,
        expected="one of the hand or of joints",
    )


def of_condition(recording: Recording, condition: str | None) -> Recording:
    """The trials of one condition; all of them where none is named.

    Raises InputError: there is no such condition; the message lists those that there are.
    """
    if condition is None:
        return recording
    chosen = (recording.trials["condition"].astype(str) == condition).to_numpy()
    if not chosen.any():
        conditions = ", ".join(map(str, recording.trials["condition"].unique()))
        raise InputError(f"no condition {condition!r}", expected=f"one of {conditions}")
    return recording.select(chosen)


#: Trials that are left out by hand: a list that `trials` saved, or numbers, with or without why.
LeftOut = PathLike | Mapping[int, str] | Collection[int]


def without_trials(recording: Recording, left_out: LeftOut | None) -> Recording:
    """The recording without the trials of a list; its provenance names them.

    `left_out`: a path is that of a CSV with the columns ``trial`` and ``why``, as ``armimpedance
    trials`` saves it.
    Returns: the same one where nothing is left out.
    Raises InputError: the list cannot be read, holds a trial that the recording does not, or all of
    them.
    """
    file = left_out if isinstance(left_out, str | os.PathLike) else None
    chosen = left_out_trials(left_out)
    numbers = recording.trials["trial"].to_numpy()
    if unknown := sorted(set(chosen) - set(numbers.tolist())):
        span = f"one of {numbers.min()} to {numbers.max()}"
        raise InputError(f"no trial {unknown[0]} to leave out", file=file, expected=span)
    kept = ~np.isin(numbers, list(chosen))
    if not kept.any():
        raise InputError("every trial is left out", file=file, expected="some that stay")
    if kept.all():
        return recording
    return recording.select(kept).with_step(left_out_sentence(chosen))


def left_out_trials(left_out: LeftOut | None) -> dict[int, str]:
    """The numbers of the trials that are left out, each with its reason, which may be empty."""
    if left_out is None:
        return {}
    if isinstance(left_out, str | os.PathLike):
        return read_left_out(os.fspath(left_out))
    return dict(left_out) if isinstance(left_out, Mapping) else dict.fromkeys(left_out, "")


def left_out_sentence(chosen: Mapping[int, str]) -> str:
    """The sentence for the provenance: ``left out by hand: trials 3 (cough), 7``."""
    listed = ", ".join(f"{n} ({why})" if why else str(n) for n, why in sorted(chosen.items()))
    return f"left out by hand: trial{'s' * (len(chosen) > 1)} {listed}"


@contextmanager
def naming(source: object) -> Iterator[None]:
    """Put a recording's path before what is wrong with it, where no file is named yet.

    `source`: what the caller was given; errors pass unchanged where it is no path.
    """
    path = Path(source) if isinstance(source, str | os.PathLike) else None
    try:
        yield
    except NotIdentifiableError as error:
        if path is None:
            raise
        raise NotIdentifiableError(f"{path}: {error}", error.parameters) from error
    except EstimationError as error:
        if path is None:
            raise
        raise type(error)(f"{path}: {error}") from error
    except InputError as error:
        if path is None or error.file is not None:
            raise
        raise InputError(
            error.problem, file=path, row=error.row, column=error.column, expected=error.expected
        ) from error


def position_of(which: object, groups: Sequence[tuple[Any, ...]]) -> int:
    """Number of the group that a name means.

    `which`: the value of one of the group's columns, or a tuple of the values of all of them.
    `groups`: the values of each group's columns.
    Raises InputError: no group has this name, or several have; the message lists the names.
    """
    wanted = tuple(map(str, which)) if isinstance(which, tuple) else None
    texts = [tuple(map(str, values)) for values in groups]
    fits = [i for i, own in enumerate(texts) if own == wanted or str(which) in own]
    if len(fits) == 1:
        return fits[0]
    problem = "names several groups" if fits else "names no group"
    # a single name is looked up as a text, several as a tuple
    names = ", ".join(repr(own[0] if len(own) == 1 else own) for own in texts)
    raise InputError(f"{which!r} {problem}", expected=f"one of {names}")


def as_columns(by: str | Sequence[str]) -> tuple[str, ...]:
    """One column's name or several as a tuple."""
    return (by,) if isinstance(by, str) else tuple(by)
