"""What a recording holds, whether it can be used, and what is missing."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from dataclasses import replace
from importlib import import_module
from typing import Any, Final, Literal

import numpy as np

from armimpedance.core.arrays import BoolArray, IntArray
from armimpedance.core.conventions import group_name, perturbation_columns
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.findings import Finding
from armimpedance.core.motion import MarkerRecording, MotionRecording
from armimpedance.core.records import Recording, Window, trial_slices
from armimpedance.numerics.criticism import check_copies, refuse_stops
from armimpedance.numerics.signals import (
    check_emg,
    check_recording,
    cut_windows,
    emg_gate,
    multiple_coherence,
)
from armimpedance.recordings import AnyRecording
from armimpedance.show.text import describe, moves_a_robot
from armimpedance.show.verbs.inspected import Fact, Inspection
from armimpedance.show.verbs.sources import PathLike, read

#: What only a topic can judge -> the face that it stands on; loaded when a recording asks for it.
OF_TOPICS: Final = {
    "check_response": "armimpedance.hand.still",
    "Options": "armimpedance.hand.still",
    "check_pushes": "armimpedance.hand.reaching",
    "check_body": "armimpedance.joint.body",
}

#: Checks that fail where nothing pushed the joint and let it return.
OF_DISTURBANCE: Final = ("disturbance", "returns to start", "force sign")

#: Checks of what a fit assumes; where they warn, every result is marked.
OF_THE_FIT: Final = (
    "held",
    "clipping",
    "imposed",
    "axes",
    "own motion",
    "delay",
    "reflex",
    "amplitude",
    "friction",
    "voluntary",
    "lack of fit",
    "gain",
    "reach",
)
#: Motion that explains less of the force than this gives no M, B and K; trials that are asked.
LEAST_COHERENCE: Final = 0.3
MOST_COHERENT: Final = 5
#: More trials than this are not checked before a fit, nor fitted by the checks.
MOST_CHECKED: Final = 4000
#: Of more than ten conditions the four largest keep as many, the others at least so many or none.
LARGEST: Final = 4
OF_THE_LARGEST: Final = 400
LEAST_OF_OTHERS: Final = 16
#: An axis of a robot that travels further than this moves, rad.
MOVES_RAD: Final = 0.05


def inspect(
    recording: AnyRecording | PathLike,
    *,
    force_by: Literal["limb", "device"] | None = None,
    title: str | None = None,
    **options: Any,
) -> Inspection:
    """Say what a recording holds, whether it can be used, and what is missing.

    Parameters
    ----------
    recording : Recording, MarkerRecording, MotionRecording or path
        What is looked at; a path may be of any format that `read` opens.
    force_by : {"limb", "device"}, optional
        Whose force on the other a Kinarm's sensor holds.
    title : str, optional
        What the recording is called in the result; its path if absent.
    **options
        What the file does not say itself; see `read`.

    Returns
    -------
    Inspection
        It prints as the command ``armimpedance inspect`` does.

    Raises
    ------
    InputError
        It cannot be read. A recording that can be read but not used is no error: see
        `Inspection.usable`.

    Examples
    --------
    >>> from armimpedance.show.verbs.inspection import inspect
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> inspected = inspect(recording)
    >>> inspected.usable
    True
    >>> list(inspected.to_frame().columns)
    ['check', 'verdict', 'message']
    """
    opened = read(recording, force_by=force_by, **options)
    if title is None:
        title = os.fspath(recording) if isinstance(recording, str | os.PathLike) else "A recording"
    return Inspection(describe(opened, title), tuple(_findings(opened)), tuple(_facts(opened)))


def _of_topic(name: str) -> Any:
    """A check that a topic makes, from its face."""
    return getattr(import_module(OF_TOPICS[name]), name)


def _facts(recording: AnyRecording) -> list[Fact]:
    """How much a recording holds."""
    rate = float(recording.sample_rate_hz)
    facts = [
        Fact("subject", str(recording.subject.id)),
        Fact("trials", int(recording.n_trials)),
        Fact("conditions", int(recording.trials["condition"].nunique())),
        Fact("duration", len(recording.time_s) / rate, "s"),
        Fact("sample rate", rate, "Hz"),
    ]
    if not isinstance(recording, Recording):
        return facts
    limb = [Fact("limb", recording.kind), Fact("perturbation", recording.perturbation)]
    return [*limb, *facts, Fact("axes", int(recording.axes)), Fact("muscles", _muscles(recording))]


def _muscles(recording: Recording) -> int:
    return 0 if recording.emg is None else len(recording.muscles)


def _findings(recording: AnyRecording) -> list[Finding]:
    if isinstance(recording, Recording):
        return [*recording.findings, *_checks(recording), *_missing(recording)]
    own = (
        _marker_checks(recording)
        if isinstance(recording, MarkerRecording)
        else _plate_checks(recording)
    )
    return [*own, _gate_check(recording)]


def checked(
    recording: AnyRecording,
    despite: str | Collection[str] = (),
    *,
    disturbed: bool = False,
    by: Sequence[str] = ("condition",),
) -> tuple[str, ...]:
    """The gate of every analysis: what `inspect` checks, before anything is fitted.

    Parameters
    ----------
    recording : Recording, MarkerRecording or MotionRecording
        Of more than 4000 trials as many are checked, spread over all.
    despite : str or collection of str
        Names of checks whose STOP is overruled.
    disturbed : bool
        The analysis fits disturbances that return: without any it is refused.
    by : sequence of str
        Columns whose groups are fitted: each must show all directions, not each condition.

    Returns
    -------
    tuple of str
        What each result is to be marked with: the checks that were overruled, and assumptions of
        the fit that the data contradict.

    Raises
    ------
    InputError
        A check says STOP and is not named in `despite`; or `despite` names no check.
    """
    if isinstance(recording, Recording):
        recording = _spread(_in_groups(recording, by))
    if disturbed and isinstance(recording, Recording):
        found = [*recording.findings, *_disturbed_checks(recording), *_driven_checks(recording)]
        # Groups need not be conditions: a fit says itself which of its own lacks a direction.
        found = [one for one in found if one.name != "directions"]
    else:
        found = _findings(recording)
    named = (despite,) if isinstance(despite, str) else tuple(despite)
    overruled = refuse_stops(found, named)
    contradicted = [one for one in found if one.name in OF_THE_FIT and one.verdict == "warning"]
    return (
        *(f"despite {one.sentence}" for one in overruled),
        *(one.sentence for one in contradicted),
    )


def _spread(recording: Recording) -> Recording:
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


def _in_groups(recording: Recording, by: Sequence[str]) -> Recording:
    """The recording with its groups as conditions; as it is where a column is not there."""
    if tuple(by) == ("condition",) or not set(by) <= set(recording.trials):
        return recording
    # without a column: a frame of no columns forgets its rows (pandas 2)
    rows = zip(*(recording.trials[column] for column in by), strict=True) if by else ()
    names = [group_name(dict(zip(by, row, strict=True))) for row in rows]
    names = names or [group_name({})] * len(recording.trials)
    return replace(recording, trials=recording.trials.assign(condition=names))


def _checks(recording: Recording) -> list[Finding]:
    """All checks; a joint that nothing disturbed can still be used by other analyses."""
    if moves_a_robot(recording):
        text = "the motors': `therapy robot`, `arm` and `contribution` take such a recording"
        moving = _moving_axes(replace(recording, perturbation="stochastic"))
        return [*check_recording(moving), Finding("torque", "ok", text)]
    if recording.perturbation == "moving":
        pushes = _of_topic("check_pushes")(recording)
        return [*check_recording(recording), check_copies(recording), *pushes]
    checks = _disturbed_checks(recording)
    if recording.kind != "joint" or "onset_s" in recording.trials:
        return checks
    if all(check.verdict == "ok" for check in checks if check.name in OF_DISTURBANCE):
        return checks
    text = "no returning one is seen: `passive` takes such a recording, `estimate` does not"
    others = check_recording(replace(recording, perturbation="stochastic"))
    return [*others, check_copies(recording), Finding("disturbance", "warning", text)]


def _disturbed_checks(recording: Recording) -> list[Finding]:
    """Checks of a limb that something disturbed; a wrong sign is told once."""
    window = _window(recording)
    first = check_recording(recording, window)
    response: tuple[Finding, ...] = ()
    if not any(one.name == "disturbance" and one.verdict == "unusable" for one in first):
        response = _response(recording, window)
    # Axes that are exchanged may turn the work's sign too; the inertia tells the two apart.
    wrong = {one.name for one in response if one.verdict == "unusable"} & {"force sign", "axes"}
    kept = [one for one in first if not (wrong and one.name == "force sign")]
    return [*kept, *response, *_emg_checks(recording)]


def _driven_checks(recording: Recording) -> list[Finding]:
    """Whether force follows motion well enough for a fit of force on motion, over all frequencies.

    Only `estimate` fits so: `elbow` weighs by noise, and finds what was imposed.
    """
    if recording.perturbation != "stochastic":
        return []
    found = []
    told = recording.imposed in ("force", "torque")
    if told or any(name in recording.extra for name in perturbation_columns(recording.axes)):
        text = (
            "the device imposes the force: noise of the motion makes M, B and K too small here; "
            "`random` takes a hand and `elbow` a joint that is moved so"
        )
        found.append(Finding("imposed", "warning", text))
    low, high = _of_topic("Options")().band_hz
    shared = []
    for row in range(min(recording.n_trials, MOST_COHERENT)):
        at = recording.samples_of(row)
        try:
            coherence = multiple_coherence(
                recording.position[at], recording.force[at], recording.sample_rate_hz
            )
            shared.append(coherence.mean(low, high))
        except ArmImpedanceError:
            continue
    if not shared:
        return found
    text = f"motion explains {100 * np.mean(shared):.0f} % of the force from {low:g} to {high:g} Hz"
    if np.mean(shared) >= LEAST_COHERENCE:
        return [*found, Finding("coherence", "ok", text, smallest=f"{100 * LEAST_COHERENCE:g} %")]
    hint = "nothing that a fit could use moved the limb there; of a joint `elbow` may tell more"
    return [*found, Finding("coherence", "unusable", f"{text}: {hint}")]


def _window(recording: Recording) -> Window | None:
    """All trials around their onsets; None where they cannot be cut, which a check will say."""
    if recording.perturbation != "returning":
        return None
    try:
        return cut_windows(recording)
    except ArmImpedanceError:
        return None


def _response(recording: Recording, window: Window | None) -> tuple[Finding, ...]:
    """Copies of trials, and what the limb's response says."""
    try:
        fitted = _spread(recording)
        found = (check_copies(recording, window), *_of_topic("check_response")(fitted))
    except ArmImpedanceError as error:
        return (Finding("response", "warning", f"cannot be judged: {error}"),)
    return found if fitted is recording else (*found, _part(recording, fitted))


def _part(recording: Recording, fitted: Recording) -> Finding:
    """How much of a large recording the checks have fitted."""
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
    """What later analyses will ask for and this recording does not have."""
    subject, missing = recording.subject, []
    if recording.kind == "hand":
        if recording.shoulder_m is None:
            missing.append("shoulder_m (orientation of ellipses assumes the origin)")
        if subject.upper_arm_m is None or subject.forearm_hand_m is None:
            missing.append("subject.upper_arm_m, forearm_hand_m (needed by 'map --to joint')")
    elif moves_a_robot(recording):
        return [] if subject.mass_kg is not None else [_unknown("subject.mass_kg (`therapy arm`)")]
    elif recording.perturbation == "stochastic" and recording.torque is None:
        missing.append("torque: interaction or commanded (`elbow` refuses a recording without it)")
    if recording.emg is None:
        missing.append("EMG (needed by activation models and EMG laws only)")
    return [*check_handle(recording), *(_unknown(what) for what in missing)]


def check_handle(recording: Recording) -> list[Finding]:
    """Whether M can be freed of what is held: no record shows its mass beside the hand's."""
    if recording.kind != "hand" or recording.handle_mass_kg > 0:
        return []
    text = "its mass is not known (handle_mass_kg): M includes whatever is held"
    return [Finding("handle", "missing", text)]


def _unknown(what: str) -> Finding:
    return Finding("", "missing", f"not known: {what}")


def _marker_checks(recording: MarkerRecording) -> list[Finding]:
    """How many samples of each marker are lost, and whether a skeleton knows them."""
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
        return [_unknown("the skeleton that the markers sit on (skeleton.json)")]
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


def _plate_checks(recording: MotionRecording) -> list[Finding]:
    if recording.wrenches is None:
        return [_unknown("contact forces (`body` needs plates, or a robot's torque)")]
    try:
        _of_topic("check_body")(recording)
    except ArmImpedanceError as error:
        return [Finding("", "unusable", str(error))]
    text = "the plates bear the body's weight, and their moments fit its place"
    return [Finding("", "ok", text)]


def _gate_check(recording: MarkerRecording | MotionRecording) -> Finding:
    if recording.emg is None:
        return _unknown("whether the muscles were silent (no EMG)")
    try:
        return Finding("", "ok", str(emg_gate(recording.emg, recording.trials)))
    except ArmImpedanceError as error:
        return Finding("", "warning", str(error))
