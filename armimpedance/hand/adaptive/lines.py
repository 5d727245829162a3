"""Interface to a robot: trials arrive as lines, pushes are sent.

A line is a JSON object. The robot asks with ``{"ready": true}``; after each push it sends
``{"trial": {...}}`` with its record. The response to each is one line,

    {"push": {...} or null, "remaining": {condition: pushes}, "met": false}

or ``{"error": "what, expected ..."}``, after which the push is still to be done. The pushes of the
next group are computed while those before are done, so that the response is immediate. The trials
that a group is computed from do not depend on the speed of the machine.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Final

import numpy as np

from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.json_text import is_number
from armimpedance.core.records import Recording
from armimpedance.hand.adaptive.collected import (
    RecordedTrial,
    Setup,
    check_axes,
    recording_of,
)
from armimpedance.hand.adaptive.next_trials import NextTrials
from armimpedance.hand.adaptive.order import Push
from armimpedance.hand.planning import Profile

#: Number of pushes left when the computation of the next group begins.
AHEAD: Final = 2
#: Longest line, in letters: a trial of ten seconds in three axes has half of it.
LONGEST_LINE: Final = 4_000_000

#: The recording so far, or None -> the next pushes.
Chooser = Callable[[Recording | None], NextTrials]


class OneCourse:
    """A chooser that keeps the course that it chose first from measured trials.

    `choose`: called with the recording and the keyword ``course``.
    """

    def __init__(self, choose: Callable[..., NextTrials]) -> None:
        self._choose = choose
        self._course: Profile | None = None

    def __call__(self, recording: Recording | None) -> NextTrials:
        """Choose the next pushes."""
        chosen = self._choose(recording, course=self._course)
        if chosen.targets and chosen.pushes:
            self._course = chosen.pushes[0].profile
        return chosen


class PushSession:
    """Dialogue with a robot: give pushes, receive trials.

    `choose`: called in another thread, one call at a time.
    `setup`: the recording's facts.
    `begun`: trials that were recorded before.
    """

    def __init__(self, choose: Chooser, setup: Setup, begun: Iterable[RecordedTrial] = ()) -> None:
        self._choose, self._setup = choose, setup
        self.trials: list[RecordedTrial] = list(begun)
        self._queue: deque[Push] = deque()
        self._worker = ThreadPoolExecutor(1)
        self._coming: Future[NextTrials] | None = None
        self._last: NextTrials | None = None
        self._ask()

    def close(self) -> None:
        """End the thread."""
        self._worker.shutdown(cancel_futures=True)

    @property
    def met(self) -> bool:
        """True if the requirements are met by the trials before the last group."""
        return self._last is not None and self._last.met

    def push(self) -> Push | None:
        """The push to be done now; None if the requirements are met, or no push can meet them.

        Raises InputError: the trials so far allow no choice.
        """
        if not self._queue and self._coming is not None:
            coming, self._coming = self._coming, None
            self._last = coming.result()
            self._queue.extend(self._last.pushes)
        return self._queue[0] if self._queue else None

    def known(self) -> tuple[Push, ...]:
        """The pushes chosen so far, the next one first; empty if `push` gives None."""
        return () if self.push() is None else tuple(self._queue)

    def add(self, trial: RecordedTrial) -> None:
        """Add the trial of the push.

        Raises InputError: its axes differ from those of the trials before.
        """
        if self.trials:
            check_axes(trial, self.trials[0], len(self.trials) + 1)
        self.trials.append(trial)
        if self._queue:
            self._queue.popleft()
        if len(self._queue) <= AHEAD and self._coming is None:
            self._ask()

    def remaining(self) -> dict[str, int]:
        """Pushes that each condition still needed when the last group was computed."""
        return {} if self._last is None else dict(self._last.remaining)

    def recording(self) -> Recording:
        """Recording of all trials."""
        return recording_of(self.trials, self._setup)

    def _ask(self) -> None:
        self._coming = self._worker.submit(self._chosen, tuple(self.trials))

    def _chosen(self, trials: tuple[RecordedTrial, ...]) -> NextTrials:
        """Choose the pushes after these trials, in the other thread: joining takes a while."""
        return self._choose(recording_of(trials, self._setup) if trials else None)


def answers(session: PushSession, lines: Iterable[str]) -> Iterator[str]:
    """Yield the response to each line; the response to a line that cannot be read is an error.

    Parameters
    ----------
    session : PushSession
    lines : iterable of str
        One JSON object each.

    Yields
    ------
    str
        One JSON object.
    """
    for line in lines:
        if not line.strip():
            continue
        try:
            _take(session, line)
            yield json.dumps(_answer(session))
        except ArmImpedanceError as error:
            yield json.dumps({"error": str(error)})


def _take(session: PushSession, line: str) -> None:
    if len(line) > LONGEST_LINE:
        raise InputError(f"a line of {len(line):,} letters", expected=f"{LONGEST_LINE:,} or fewer")
    try:
        message = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise InputError("a line that is no JSON", expected='{"ready": true}') from error
    if not isinstance(message, dict) or not ({"ready", "trial"} & set(message)):
        raise InputError("a line without ready or trial", expected='{"trial": {...}}')
    if "trial" in message:
        session.add(_trial(message["trial"], session.push()))


def _trial(fields: Any, push: Push | None) -> RecordedTrial:
    """Read a trial from its line; condition and direction are those of the requested push."""
    if not isinstance(fields, dict):
        raise InputError("a trial that is no object", expected="position_m, force_N, onset_s")
    if push is None and "condition" not in fields:
        raise InputError("a trial that was not asked for", expected="its condition and direction")
    condition = str(fields.get("condition", push.condition if push else ""))
    direction = fields.get("direction", push.direction if push else ())
    end = fields.get("end_s")
    onset = _number(fields, "onset_s")
    if end is None and push is not None:
        end = onset + push.profile.duration_s
    angles = fields.get("joint_angles_rad")
    return RecordedTrial(
        condition=condition,
        direction=_array(direction, "direction", 1),
        onset_s=onset,
        end_s=float(_finite(end, "end_s")),
        position=_array(fields.get("position_m"), "position_m", 2),
        force=_array(fields.get("force_N"), "force_N", 2),
        joint_angles=None if angles is None else _array(angles, "joint_angles_rad", 2),
    )


def _number(fields: dict[str, Any], name: str) -> float:
    return _finite(fields.get(name), name)


def _finite(value: Any, name: str) -> float:
    if not is_number(value):
        raise InputError(f"{name} is {str(value)[:40]}", column=name, expected="a number")
    return float(value)


def _array(values: Any, name: str, dimensions: int) -> np.ndarray:
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} holds no numbers", column=name, expected="numbers") from error
    if array.ndim != dimensions or not array.size or not np.isfinite(array).all():
        form = "a list of numbers" if dimensions == 1 else "a list of samples, each of every axis"
        raise InputError(f"{name} of the wrong form", column=name, expected=f"{form}, all finite")
    return array


def _answer(session: PushSession) -> dict[str, Any]:
    push = session.push()
    message = None if push is None else told_push(push)
    return {"push": message, "remaining": session.remaining(), "met": push is None and session.met}


def told_push(push: Push) -> dict[str, Any]:
    """A push as a message to a robot."""
    return {
        "condition": push.condition,
        "direction": [round(u, 9) for u in push.direction],
        "shape": push.profile.shape.name,
        "duration_s": push.profile.duration_s,
        "amplitude_m": push.profile.amplitude_m,
        "pause_s": push.pause_s,
    }
