"""Checks of a recording before anything is fitted."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, IntArray
from armimpedance.core.conventions import group_name
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.findings import Finding, missing
from armimpedance.core.motion import MarkerRecording, MotionRecording
from armimpedance.core.records import Recording, Window, trial_slices
from armimpedance.numerics.criticism import check_copies, refuse_stops
from armimpedance.numerics.signals import check_emg, check_recording, cut_windows, emg_gate
from armimpedance.recordings import AnyRecording
from armimpedance.show.text import moves_a_robot

# Which trials of a large recording are checked: as many as keep every condition judged.

#: More trials than this are not checked before a fit, nor fitted by the checks.
MOST_CHECKED: Final = 4000
#: Of more than ten conditions the four largest keep as many, the others at least so many or none.
LARGEST: Final = 4
OF_THE_LARGEST: Final = 400
LEAST_OF_OTHERS: Final = 16


def spread(recording: Recording) -> Recording:
    """At most 4000 of the trials, spread over all.

    Of many conditions each would be left with too few trials for a fit of its own: the largest,
    by which departures from the model are judged, keep 400, and some of the others enough.
    """
    if recording.n_trials <= MOST_CHECKED:
        return recording
    conditions = recording.trials.groupby("condition", sort=False).indices.values()
    if len(conditions) <= max(LARGEST, MOST_CHECKED // OF_THE_LARGEST):
        return recording.select(_thinned(np.arange(recording.n_trials), MOST_CHECKED))
    by_size = sorted(map(np.sort, conditions), key=len, reverse=True)
    kept = [_thinned(rows, OF_THE_LARGEST) for rows in by_size[:LARGEST]]
    others, left = by_size[LARGEST:], MOST_CHECKED - sum(map(len, kept))
    each = min(max(LEAST_OF_OTHERS, left // len(others)), len(others[0]))
    chosen = _thinned(np.arange(len(others)), left // each)
    kept += [_thinned(others[i], each) for i in chosen]
    return recording.select(np.sort(np.concatenate(kept)))


def _thinned(rows: IntArray, most: int) -> IntArray:
    """At most so many of the rows, from the first to the last at equal distances."""
    if len(rows) <= most:
        return rows
    return np.asarray(rows[np.linspace(0, len(rows) - 1, most).astype(int)])


#: Checks that fail where nothing pushed the joint and let it return.
OF_DISTURBANCE: Final = ("disturbance", "returns to start", "force sign")

#: An axis of a robot that travels further than this moves, rad.
MOVES_RAD: Final = 0.05


def _nothing(_: object) -> tuple[Finding, ...]:
    return ()


@dataclass(frozen=True)
class TopicChecks:
    """Checks that only a topic can make. A verb passes its own; `inspect` runs those of all topics.

    `response`: of a limb that was pushed and returned: what its response says.
    `pushes`: of reaches: how many are free, how many pushed.
    `plates`: of joint angles: what the contact forces say.
    """

    response: Callable[[Recording], Sequence[Finding]] = _nothing
    pushes: Callable[[Recording], Sequence[Finding]] = _nothing
    plates: Callable[[MotionRecording], Sequence[Finding]] = _nothing


#: Of a verb that judges nothing itself.
NO_CHECKS: Final = TopicChecks()


def findings_of(recording: AnyRecording, own: TopicChecks = NO_CHECKS) -> list[Finding]:
    """All checks of a recording, with those that a topic hands over."""
    if isinstance(recording, Recording):
        return [*recording.findings, *_checks(recording, own), *_missing(recording)]
    if isinstance(recording, MarkerRecording):
        return [*_marker_checks(recording), _gate_check(recording)]
    return [*own.plates(recording), _gate_check(recording)]


def _checks(recording: Recording, own: TopicChecks) -> list[Finding]:
    """All checks; a joint that nothing disturbed can still be used by other analyses."""
    if moves_a_robot(recording):
        text = "the motors': `therapy robot`, `arm` and `contribution` take such a recording"
        moving = _moving_axes(replace(recording, perturbation="stochastic"))
        return [*check_recording(moving), Finding("torque", "ok", text)]
    if recording.perturbation == "moving":
        return [*check_recording(recording), check_copies(recording), *own.pushes(recording)]
    checks = disturbed_checks(recording, own)
    if recording.kind != "joint" or "onset_s" in recording.trials:
        return checks
    if all(check.verdict == "ok" for check in checks if check.name in OF_DISTURBANCE):
        return checks
    text = "no returning one is seen: `passive` takes such a recording, `estimate` does not"
    others = check_recording(replace(recording, perturbation="stochastic"))
    return [*others, check_copies(recording), Finding("disturbance", "warning", text)]


def disturbed_checks(recording: Recording, own: TopicChecks) -> list[Finding]:
    """Checks of a limb that something disturbed; a wrong sign is told once."""
    window = _window(recording)
    first = check_recording(recording, window)
    response: tuple[Finding, ...] = ()
    if not any(one.name == "disturbance" and one.verdict == "unusable" for one in first):
        response = _response(recording, window, own)
    # Axes that are exchanged may turn the work's sign too; the inertia tells the two apart.
    wrong = {one.name for one in response if one.verdict == "unusable"} & {"force sign", "axes"}
    kept = [one for one in first if not (wrong and one.name == "force sign")]
    return [*kept, *response, *_emg_checks(recording)]


def _window(recording: Recording) -> Window | None:
    """All trials around their onsets; None where they cannot be cut, which a check will say."""
    if recording.perturbation != "returning":
        return None
    try:
        return cut_windows(recording)
    except ArmImpedanceError:
        return None


def _response(recording: Recording, window: Window | None, own: TopicChecks) -> tuple[Finding, ...]:
    """Copies of trials, and what the limb's response says."""
    try:
        fitted = spread(recording)
        findings = (check_copies(recording, window), *own.response(fitted))
    except ArmImpedanceError as error:
        return (Finding("response", "warning", f"cannot be judged: {error}"),)
    return findings if fitted is recording else (*findings, _part(recording, fitted))


def _part(recording: Recording, fitted: Recording) -> Finding:
    """The finding that states which part of a large recording the checks fitted."""
    of, whole = (one.trials["condition"].nunique() for one in (fitted, recording))
    text = (
        f"{fitted.n_trials} of {recording.n_trials} trials, of {of} of {whole} conditions, are "
        "fitted to judge units, axes and departures from the model"
    )
    return Finding("part", "ok", text)


def _emg_checks(recording: Recording) -> list[Finding]:
    """Checks of the raw EMG beside a random perturbation; I, B and K can be fitted without it."""
    if recording.perturbation != "stochastic" or recording.emg_unit != "V":
        return []
    return [
        Finding(f"EMG {c.name}", "ok" if c.verdict == "ok" else "warning", c.message)
        for c in (() if recording.emg is None else check_emg(recording))
    ]


def _moving_axes(recording: Recording) -> Recording:
    """The axes that move: one that is held stays within a step or two of its encoder."""
    moves = np.ptp(recording.position, axis=0) > MOVES_RAD
    if not moves.any():
        return recording
    position, force = recording.position[:, moves], recording.force[:, moves]
    return replace(recording, position=position, force=force)


def _missing(recording: Recording) -> list[Finding]:
    """Findings for facts that later analyses need and this recording lacks."""
    subject, absent = recording.subject, []
    if recording.kind == "hand":
        if recording.shoulder_m is None:
            absent.append("shoulder_m (orientation of ellipses assumes the origin)")
        if subject.upper_arm_m is None or subject.forearm_hand_m is None:
            absent.append("subject.upper_arm_m, forearm_hand_m (needed by 'map --to joint')")
    elif moves_a_robot(recording):
        return [] if subject.mass_kg is not None else [missing("subject.mass_kg (`therapy arm`)")]
    elif recording.perturbation == "stochastic" and recording.torque is None:
        absent.append("torque: interaction or commanded (`elbow` refuses a recording without it)")
    if recording.emg is None:
        absent.append("EMG (needed by activation models and EMG laws only)")
    return [*check_handle(recording), *(missing(what) for what in absent)]


def check_handle(recording: Recording) -> list[Finding]:
    """Warn if the handle's mass is unknown: the fit cannot separate it from the hand's."""
    if recording.kind != "hand" or recording.handle_mass_kg > 0:
        return []
    text = "its mass counts as 0 kg (handle_mass_kg): M includes whatever is held, if anything is"
    return [Finding("handle", "missing", text)]


def _marker_checks(recording: MarkerRecording) -> list[Finding]:
    """Findings on lost samples of each marker, and on markers that the skeleton lacks."""
    lost = np.isnan(recording.positions[..., 0])
    findings = []
    for marker in np.flatnonzero(lost.any(axis=0)):
        longest = _longest_gap(lost[:, marker], recording.offsets) / recording.sample_rate_hz
        share = 100 * lost[:, marker].mean()
        text = f"not seen in {share:.1f} % of the frames, for {longest:.2f} s at the longest"
        findings.append(Finding(recording.names[marker], "warning", text))
    if not lost.any():
        findings.append(Finding("", "ok", "all markers are seen in all frames"))
    findings += _skeleton_checks(recording)
    if recording.wrenches is not None:
        text = "the force plates: `body` checks them once the joints' motion is found"
        findings.append(Finding("", "missing", text))
    return findings


def _skeleton_checks(recording: MarkerRecording) -> list[Finding]:
    if recording.skeleton is None:
        return [missing("the skeleton that the markers sit on (skeleton.json)")]
    unknown = sorted(set(recording.names) - set(recording.skeleton.marker_names))
    if not unknown:
        return []
    return [Finding("", "warning", f"the skeleton has no place for {', '.join(unknown)}")]


def _longest_gap(lost: BoolArray, offsets: IntArray) -> int:
    """Most lost samples in a row within one trial."""
    longest = 0
    for trial in trial_slices(offsets):
        edges = np.diff(np.concatenate([[0], lost[trial].astype(int), [0]]))
        runs = np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)
        longest = max(longest, int(runs.max(initial=0)))
    return longest


def _gate_check(recording: MarkerRecording | MotionRecording) -> Finding:
    if recording.emg is None:
        return missing("whether the muscles were silent (no EMG)")
    try:
        return Finding("", "ok", str(emg_gate(recording.emg, recording.trials)))
    except ArmImpedanceError as error:
        return Finding("", "warning", str(error))


# The gate of every analysis: no number of a recording that a check stops.

#: Checks of what a fit assumes; where they warn, every result is marked.
OF_THE_FIT: Final = (
    "held",
    "clipping",
    "imposed",
    "axes",
    "own motion",
    "delay",
    "filter",
    "reflex",
    "amplitude",
    "friction",
    "voluntary",
    "lack of fit",
    "gain",
    "session",
    "single trials",
    "labels",
    "reach",
)


def checked(
    recording: AnyRecording,
    despite: str | Collection[str] = (),
    own: TopicChecks = NO_CHECKS,
) -> tuple[str, ...]:
    """Check a recording as `inspect` does, before anything is fitted.

    `recording`: of more than 4000 trials as many are checked, spread over all.
    `despite`: names of checks whose STOP is overruled.
    `own`: the checks that only the verb's topic can make.
    Returns: what each result is to be marked with; see `marks_of`.
    Raises InputError: a check says STOP and is not named in `despite`; or `despite` names no check.
    """
    if isinstance(recording, Recording):
        recording = spread(recording)
    return marks_of(findings_of(recording, own), despite)


def marks_of(found: Iterable[Finding], despite: str | Collection[str] = ()) -> tuple[str, ...]:
    """Refuse where a check says STOP; what results are marked with where none does.

    `despite`: names of checks whose STOP is overruled.
    Returns: the checks that were overruled, and assumptions of the fit that the data contradict.
    Raises InputError: a check says STOP and is not named in `despite`; or `despite` names no check.
    """
    found = list(found)
    named = (despite,) if isinstance(despite, str) else tuple(despite)
    overruled = refuse_stops(found, named)
    contradicted = [one for one in found if one.name in OF_THE_FIT and one.verdict == "warning"]
    return (
        *(f"despite {one.sentence}" for one in overruled),
        *(one.sentence for one in contradicted),
    )


def in_groups(recording: Recording, by: Sequence[str]) -> Recording:
    """The recording with its groups as conditions; as it is where a column is not there."""
    if tuple(by) == ("condition",) or not set(by) <= set(recording.trials):
        return recording
    # without a column: a frame of no columns forgets its rows (pandas 2)
    rows = zip(*(recording.trials[column] for column in by), strict=True) if by else ()
    names = [group_name(dict(zip(by, row, strict=True))) for row in rows]
    names = names or [group_name({})] * len(recording.trials)
    return replace(recording, trials=recording.trials.assign(condition=names))
