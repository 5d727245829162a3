"""Whether the hand went where the trial table says that it was pushed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.hand.reaching.windows import PhaseWindows

#: A trial answers a push by 1 where it is pushed as all others are, by 0 where nobody pushes it.
LEAST_ANSWER: Final = 0.4
#: A free reach that answers by more than this was pushed.
MOST_FREE: Final = 0.7
#: Labels are judged where a push accelerates the hand this many times as much as trials differ.
CLEAR: Final = 3.0
#: Commands are believed where chance alone would explain as much more seldom than this.
SELDOM: Final = 1e-3


def check_labels(every: Sequence[PhaseWindows], phase: str) -> None:
    """Refuse trials whose hand did not go where their label says.

    The acceleration that is linear in the push's direction is what all trials of a phase share; how
    much of it a trial shows is 1 but for noise. It is 0 of a reach that nobody pushed, and less of
    one that was pushed elsewhere. Of pushes throughout, all windows are judged together.

    Raises
    ------
    InputError
        Trials of other labels, by their numbers; commands that the hand does not follow.
    """
    if not any(windows.direction.any() for windows in every):
        _check_commands(every, phase)
        return
    (windows,) = every
    a, hit = windows.part("acceleration"), windows.pushed
    D = windows.direction[hit]
    centred = (a[hit] - np.median(a[hit], axis=0)).reshape(len(D), -1)
    # response (2, S d): D (n, 2) response = a (n, S d)
    response = np.linalg.lstsq(D, centred, rcond=None)[0]
    own = np.einsum("nr,nr->n", centred, D @ response) / _energy(D @ response)
    free = (a[~hit] - np.median(a[~hit], axis=0)).reshape(int((~hit).sum()), -1)
    # the push (2,) that explains a free reach best
    seen = np.hypot(*np.linalg.lstsq(response.T, free.T, rcond=None)[0])
    if np.median(_energy(D @ response)) < CLEAR**2 * np.median(_energy(free)):
        return
    wrong = windows.trial[hit][own < LEAST_ANSWER]
    if len(wrong):
        raise InputError(
            f"phase {phase}: the hand did not go where {_trials(wrong)} was pushed to",
            column="push_deg",
            expected="the direction of the robot's push on the hand, in degrees from x towards y",
        )
    pushed = windows.trial[~hit][seen > MOST_FREE]
    if len(pushed):
        raise InputError(
            f"{_trials(pushed)}: no push is told, and the hand went as if there was one",
            column="phase",
            expected=f"{phase}, or a trial that nobody pushed",
        )


def _check_commands(every: Sequence[PhaseWindows], phase: str) -> None:
    """Refuse commands that the hand does not follow.

    Raises
    ------
    InputError
        There are few reaches, or commands explain no more of the motion than chance would.
    """
    from scipy.stats import f

    trials = min(int(windows.pushed.sum()) for windows in every)
    count = max(windows.instruments.shape[1] for windows in every)
    free = trials - 1 - count
    if free < count:
        raise InputError(
            f"phase {phase}: {trials} reaches are pushed throughout",
            expected=f"{2 * count + 1} or more, and better five times as many",
        )
    # forces drive velocities, displacements places
    followed = max(_followed(every, name) for name in ("hand", "velocity", "acceleration"))
    # by chance alone each of the d commands explains as much as each of the rest, on two axes
    if followed * free / count < f.isf(SELDOM, 2 * count, 2 * free):
        raise InputError(
            f"phase {phase}: the hand does not follow the robot's commands",
            column="command_x",
            expected="what the robot was told at each sample, 0 where it let go",
        )


def _followed(every: Sequence[PhaseWindows], name: str) -> float:
    """Variance of a channel that the commands explain, over that which they leave."""
    explained = left = 0.0
    for windows in every:
        hit = windows.pushed
        D, part = windows.instruments[hit], windows.part(name)[hit]
        D, flat = D - D.mean(axis=0), (part - part.mean(axis=0)).reshape(len(part), -1)
        rest = flat - D @ np.linalg.lstsq(D, flat, rcond=None)[0]
        explained += float(_energy(flat).sum() - _energy(rest).sum())
        left += float(_energy(rest).sum())
    return explained / left


def _energy(values: FloatArray) -> FloatArray:
    return np.asarray((values**2).sum(axis=1))


def _trials(numbers: FloatArray) -> str:
    shown = ", ".join(str(int(n)) for n in numbers[:5])
    more = f" and {len(numbers) - 5} more" if len(numbers) > 5 else ""
    return f"trial {shown}{more}"
