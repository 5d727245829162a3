"""Windows after the onsets of one phase, and windows of free reaches after the same travel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError, check_number
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.hand.reaching.course import Courses, Pushes, channel, pushes_of
from armimpedance.limb.arm import TwoLinkArm

#: Spacing of the samples in a window (s): the low-pass leaves nothing above 100 Hz.
SPACING_S: Final = 0.005
#: A window ends this long after the push (s), and before a voluntary response (LONGEST_S after the
#: onset).
AFTER_S: Final = 0.1
LONGEST_S: Final = 0.3
#: Latest onset of a reflex that the windows cover (s).
LATEST_S: Final = 0.08
#: Interval of the history, relative to the onset. It ends before the onset because the low-pass
#: spreads a push over some 15 ms before it.
HISTORY_S: Final = (-0.1, -0.015)
HISTORY_STEP_S: Final = 0.01
#: Interval between windows of pushes throughout (s).
STEP_S: Final = 0.1
#: Commands of a robot that pushes throughout are averaged over `BIN_S`, from `BEFORE_S` before the
#: window.
BIN_S: Final = 0.05
BEFORE_S: Final = 0.1
_BIN: Final = round(BIN_S / SPACING_S)
#: Fewest free and pushed trials, for an estimate of their scatter.
LEAST_FREE: Final = 10
LEAST_PUSHED: Final = 8


@dataclass(frozen=True)
class PhaseWindows(FrozenRecord):
    """Windows of n trials, the pushed ones first.

    `pushed` (n,) bool, `trial` (n,) int, `shoulder_m` (2,).
    `lag_s` (S,): time from the onset.
    `channels` (n, L, c): as in `Courses`, over the window and `LATEST_S` before it.
    `history` (n, H): angles, rates and torques before the onset, each kind in units of its spread;
    no columns if pushes go on throughout.
    `direction` (n, 2): unit vectors of the pushes, 0 for free reaches.
    `instruments` (n, d): cause of the response to the pushes: their direction, or the robot's
    commands in each `BIN_S` since `BEFORE_S` before the window.
    `onset` (n,) int: sample of the recording at which the window begins.
    `after_s`: time from the push's onset to the begin of the window.
    """

    lag_s: Annotated[FloatArray, "S"]
    channels: Annotated[FloatArray, "n L c"]
    history: Annotated[FloatArray, "n H"]
    direction: Annotated[FloatArray, "n 2"]
    instruments: Annotated[FloatArray, "n d"]
    pushed: Annotated[BoolArray, "n"]
    trial: Annotated[IntArray, "n"]
    onset: Annotated[IntArray, "n"]
    arm: TwoLinkArm
    shoulder_m: Annotated[FloatArray, "2"]
    after_s: float = 0.0
    notes: tuple[str, ...] = ()

    def of_trials(self, keep: BoolArray) -> PhaseWindows:
        """Select trials by a mask (n,)."""
        history = self.history[keep]
        return replace(
            self,
            channels=self.channels[keep],
            history=history - history.mean(axis=0),
            direction=self.direction[keep],
            instruments=self.instruments[keep],
            pushed=self.pushed[keep],
            trial=self.trial[keep],
            onset=self.onset[keep],
        )

    def part(self, name: str) -> FloatArray:
        """A channel (n, S, width) from the onset on."""
        return self.late(name, 0)

    def late(self, name: str, samples: int) -> FloatArray:
        """A channel (n, S, width), delayed by this many samples."""
        end = self.channels.shape[1] - samples
        return self.channels[:, end - len(self.lag_s) : end, channel(name)]

    @property
    def middle(self) -> int:
        """Index of the sample in the middle of the window, for which the impedance is reported."""
        return len(self.lag_s) // 2

    @property
    def state(self) -> FloatArray:
        """Place and velocity of the hand (n, 4) just before the onset, free of the push."""
        at = self.channels.shape[1] - len(self.lag_s) + round(HISTORY_S[1] / SPACING_S)
        parts = [self.channels[:, at, channel(name)] for name in ("hand", "velocity")]
        return np.concatenate(parts, axis=1)

    @property
    def travel_m(self) -> float:
        """Travel of undisturbed reaches over the window and just before it, m."""
        course = self.channels[~self.pushed][:, :, channel("hand")].mean(axis=0)
        return float(np.hypot(*np.ptp(course, axis=0)))


def _checked_trials(
    pushes: Pushes, rows: IntArray, phase: str, window_s: float | None
) -> tuple[IntArray, IntArray, float]:
    """Pushed and free trials of a phase, and the window's length, checked."""
    of_phase, free = pushes.rows(phase)[rows], ~pushes.pushed[rows]
    _check_counts(phase, int(of_phase.sum()), int(free.sum()))
    if not pushes.throughout(phase):
        _check_directions(phase, pushes.direction[rows[of_phase]])
    length = min(pushes.duration_s + AFTER_S, LONGEST_S) if window_s is None else window_s
    check_number(length, f"a window of {length:g} s", low=10 * SPACING_S, high=2, unit="s")
    return rows[of_phase], rows[free], length


def cut_phase(
    courses: Courses,
    pushes: Pushes,
    rows: IntArray,
    phase: str,
    window_s: float | None = None,
    after_s: float = 0.0,
) -> PhaseWindows:
    """Cut the windows of one phase from the trials `rows`.

    A free reach is aligned where it has travelled as far as the pushed ones at their onset.

    `rows` (R,) int: trials of one condition.
    `window_s`: default: until .1 s after the push, at most .3 s.
    `after_s`: time from the onset to the window, for pushes throughout.
    Raises InputError: there are too few free or pushed trials, all pushes lie along one line, or
    the windows do not fit into the records.
    """
    hit, free, length = _checked_trials(pushes, rows, phase, window_s)
    throughout = pushes.throughout(phase)
    onset = np.array([_sample(courses, int(r), pushes.onset_s[r]) for r in hit])
    others, passing, missed = _passing(courses, free, hit, onset)
    chosen = np.concatenate([hit, others])
    at = np.concatenate([onset, passing]) + round(after_s * courses.sample_rate_hz)
    fits = _fits(courses, chosen, at, length)
    if not fits.any():
        raise InputError(
            f"phase {phase}: no record holds 0.1 s before a push and the window after it",
            expected="longer records, or a shorter --window-s",
        )
    pushed = np.arange(len(chosen)) < len(hit)
    left_out = missed + int((~fits & ~pushed).sum())
    notes = (f"phase {phase}: {left_out} free reaches left out",) if left_out else ()
    lag = np.arange(0.0, length + SPACING_S / 2, SPACING_S)
    chosen, at, pushed = chosen[fits], at[fits], pushed[fits]
    _check_counts(phase, int(pushed.sum()), int((~pushed).sum()))
    return PhaseWindows(
        lag_s=lag,
        channels=_cut(courses, chosen, at, np.concatenate([_before(), lag])),
        # with pushes throughout, the history is also caused by them: projecting it out would
        # correlate the person's own torque with the commands
        history=np.zeros((len(at), 0)) if throughout else _history(courses, chosen, at),
        direction=pushes.direction[chosen],
        instruments=_commands(courses, pushes, chosen, at, lag)
        if throughout
        else pushes.direction[chosen],
        pushed=pushed,
        trial=courses.trial[chosen],
        onset=courses.offsets[chosen] + at,
        arm=courses.arm,
        shoulder_m=courses.shoulder_m,
        after_s=after_s,
        notes=notes,
    )


def windows_of(
    courses: Courses, pushes: Pushes, rows: IntArray, phase: str, window_s: float | None = None
) -> Iterator[tuple[str, PhaseWindows]]:
    """Yield name and windows of one phase; with pushes throughout, a window every `STEP_S`.

    The name is then the middle of the window. Parameters and errors are those of `cut_phase`.
    """
    if not pushes.throughout(phase):
        yield phase, cut_phase(courses, pushes, rows, phase, window_s)
        return
    length = LONGEST_S if window_s is None else window_s
    last = pushes.duration_s - length
    if last < STEP_S:
        raise InputError(
            f"phase {phase}: pushes of {pushes.duration_s:g} s", expected=f"{length + STEP_S:g} s"
        )
    for after_s in np.arange(STEP_S / 2, last, STEP_S):
        windows = cut_phase(courses, pushes, rows, phase, length, float(after_s))
        yield f"{after_s + windows.lag_s[windows.middle]:.3f} s", windows


def _before() -> FloatArray:
    """Lags before the onset that a delayed response depends on."""
    return np.asarray(-SPACING_S * np.arange(round(LATEST_S / SPACING_S), 0, -1))


def _sample(courses: Courses, row: int, time_s: float) -> int:
    return round((time_s - courses.start_s[row]) * courses.sample_rate_hz)


def _passing(
    courses: Courses, free: IntArray, hit: IntArray, onset: IntArray
) -> tuple[IntArray, IntArray, int]:
    """Free reaches that travel as far as the pushed ones, their samples there, number of others.

    The line of travel is that from the mean start to the mean end of the free reaches; a person who
    does not travel is aligned at the same time.
    """
    hands = [courses.of_trial(int(r), "hand") for r in free]
    start = np.mean([h[0] for h in hands], axis=0)
    way = np.mean([h[-1] for h in hands], axis=0) - start
    spread = np.std([h[0] for h in hands], axis=0).max()
    if np.hypot(*way) < 10 * spread + 1e-3:
        return free, np.full(len(free), round(float(np.median(onset)))), 0
    along = way / np.hypot(*way)
    reached = [
        (courses.of_trial(int(r), "hand")[k] - start) @ along
        for r, k in zip(hit, onset, strict=True)
    ]
    beyond = [(h - start) @ along >= np.median(reached) for h in hands]
    reaching = np.array([bool(b.any() and not b[0]) for b in beyond])
    passing = np.array([int(np.argmax(b)) for b in beyond])
    return free[reaching], passing[reaching], int((~reaching).sum())


def _fits(courses: Courses, rows: IntArray, at: IntArray, length_s: float) -> BoolArray:
    rate = courses.sample_rate_hz
    lengths = np.diff(courses.offsets)[rows]
    return (at + HISTORY_S[0] * rate >= 0) & (at + (length_s + SPACING_S) * rate <= lengths - 1)


def _cut(courses: Courses, rows: IntArray, at: IntArray, lag_s: FloatArray) -> FloatArray:
    """Channels (n, S, c) at lags from a sample of each trial."""
    lags = np.rint(lag_s * courses.sample_rate_hz).astype(int)
    return np.asarray(courses.channels[(courses.offsets[rows] + at)[:, None] + lags])


def _commands(
    courses: Courses, pushes: Pushes, rows: IntArray, at: IntArray, lag_s: FloatArray
) -> FloatArray:
    """Means (n, g) of the robot's commands over `BIN_S`, in units of their spread."""
    if pushes.command is None:
        raise InputError("no commands", column="command_x", expected="the robot's command")
    lag = np.arange(-BEFORE_S, lag_s[-1], SPACING_S)
    lag = lag[: len(lag) // _BIN * _BIN]
    lags = np.rint(lag * courses.sample_rate_hz).astype(int)
    commands = pushes.command[(courses.offsets[rows] + at)[:, None] + lags]
    means = commands.reshape(len(rows), -1, _BIN, 2).mean(axis=2).reshape(len(rows), -1)
    return np.asarray(means / max(float(np.sqrt((means**2).mean())), 1e-12))


def _history(courses: Courses, rows: IntArray, at: IntArray) -> FloatArray:
    """History (n, H), centred, each kind of channel in units of its own spread."""
    lag = np.arange(HISTORY_S[0], HISTORY_S[1] + 1e-9, HISTORY_STEP_S)
    before = _cut(courses, rows, at, lag)
    parts = []
    for name in ("angle", "rate", "torque"):
        part = before[:, :, channel(name)].reshape(len(rows), -1)
        part = part - part.mean(axis=0)
        parts.append(part / max(float(np.sqrt((part**2).mean())), 1e-12))
    return np.concatenate(parts, axis=1)


def _check_counts(phase: str, pushed: int, free: int) -> None:
    if free < LEAST_FREE:
        raise InputError(
            f"phase {phase}: {free or 'no'} reaches without a push",
            column="phase",
            expected=f"{LEAST_FREE} or more with an empty cell: they show how reaches differ",
        )
    if pushed < LEAST_PUSHED:
        raise InputError(
            f"phase {phase}: {pushed} pushed reaches", expected=f"{LEAST_PUSHED} or more"
        )


def _check_directions(phase: str, direction: FloatArray) -> None:
    spread = np.linalg.eigvalsh(np.cov(direction.T))
    if spread[0] < 0.02:
        raise InputError(
            f"phase {phase}: all pushes lie along one line",
            column="push_deg",
            expected="directions all around, each with its opposite",
        )


# Findings of `inspect` on pushed reaches.


def check_pushes(recording: Recording) -> list[Finding]:
    """Check the numbers of free and of pushed reaches at each phase, and their directions.

    Parameters
    ----------
    recording : Recording
        Whose ``perturbation`` is "moving".

    Returns
    -------
    list of Finding
        "pushes" and one for each phase.
    """
    try:
        pushes = pushes_of(recording)
    except InputError as error:
        return [Finding("pushes", "unusable", str(error))]
    free = int((~pushes.pushed).sum())
    few = free < LEAST_FREE
    text = f"{free} reaches are free" + (f": {LEAST_FREE} are the least" if few else "")
    findings = [Finding("pushes", "unusable" if few else "ok", text)]
    for phase in pushes.phases:
        rows = pushes.rows(phase)
        mean = np.hypot(*pushes.direction[rows].mean(axis=0))
        text = f"{int(rows.sum())} reaches are pushed"
        if rows.sum() < LEAST_PUSHED:
            findings.append(
                Finding(f"phase {phase}", "unusable", f"{text}, {LEAST_PUSHED} are few")
            )
        elif pushes.throughout(phase):
            findings.append(Finding(f"phase {phase}", "ok", f"{text} throughout"))
        elif mean > 0.3:
            text += " more to one side than to the other: push back and forth alike"
            findings.append(Finding(f"phase {phase}", "warning", text))
        else:
            findings.append(Finding(f"phase {phase}", "ok", f"{text}, to all sides alike"))
    return findings
