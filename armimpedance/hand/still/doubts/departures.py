"""Is the limb the one that the model says? Each departure from it, and what repeats unexplained.

Departures resemble each other, so the one that explains most is named, and another one beside it
only where it is needed too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from scipy.special import fdtrc

from armimpedance.core.arrays import FloatArray, IntArray, once_per_record
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.inner import (
    FEWEST_AXES,
    Inner,
    freedom_told,
    is_wrist_free,
)
from armimpedance.hand.still.doubts.labels import check_labels
from armimpedance.hand.still.doubts.mixture import POSITIVE
from armimpedance.hand.still.doubts.model import (
    COLUMNS,
    Departure,
    Model,
    beside_inner,
    inner_of,
    late_s,
    pooled,
)
from armimpedance.hand.still.doubts.session import SessionBlocks, blocks_of, check_session
from armimpedance.hand.still.doubts.single_trials import check_single_trials
from armimpedance.hand.still.doubts.symmetry import check_symmetry
from armimpedance.hand.still.estimation import DEFAULT_BY, groups_of
from armimpedance.hand.still.modal import mean_of_others
from armimpedance.numerics.signals import cut_windows, disturbance_times

# Does the hand move as it is disturbed? What moves it otherwise is the person's own force.
#
# Where the robot yields, own force moves the hand, and the measured force is the robot's answer to
# that: least squares then finds the robot, not the limb. It shows in trials of the same
# disturbance, whose motions are not alike.

#: Part of the motion's energy that has to repeat. Of servos of 1000, 300 and 100 N/m under nominal
#: noise .97, .8 and .6 do, and K by least squares is 4, 24 and 40 % off; of a robot that imposes a
#: force while the person pushes by 1 N .8, and M comes out negative.
LEAST_REPEATED: Final = 0.9


def check_own_motion(models: Sequence[Model]) -> tuple[Finding, ...]:
    """The finding "own motion"; empty without trials of the same disturbance.

    `models`: of the conditions.
    Returns: None or one.
    """
    found = [part for model in models if (part := _repeated(model)) is not None]
    if not found:
        return ()
    part = float(np.median(found))
    text = f"{100 * part:.0f} % of the hand's motion is that of its disturbance"
    smallest = f"{100 * (1 - LEAST_REPEATED):.0f} % of other motion"
    if part >= LEAST_REPEATED:
        return (Finding("own motion", "ok", text, smallest=smallest),)
    text += (
        ", the rest the person's own: the robot yields to it, and least squares finds the robot "
        "instead of the limb; take --method instruments or frequency, and more trials of each "
        "direction"
    )
    return (Finding("own motion", "warning", text, smallest=smallest),)


def _repeated(model: Model) -> float | None:
    """Part of the displacement's energy that other trials of the disturbance share; None: none."""
    labels = model.equation.disturbance
    if labels is None:
        return None
    counts = np.bincount(labels)[labels]
    shared = counts > 1
    if not shared.any():
        return None
    x = model.equation.motion[:, 2]
    others = mean_of_others(x, labels)
    size = np.maximum((others**2).sum(axis=(1, 2)), 1e-300)
    # the same course at another amplitude is the same disturbance
    along = np.maximum((x * others).sum(axis=(1, 2)), 0.0) / size
    # a trial differs from the mean of n - 1 others by n / (n - 1) times its own variance
    own = ((x - along[:, None, None] * others) ** 2).sum(axis=(1, 2)) * (counts - 1) / counts
    return float(1 - own[shared].sum() / (x[shared] ** 2).sum())


# What repeats in each disturbance beyond the fit, beside what differs between repeats.

#: Lack of fit has no size to weigh, and one recording has few: chance must do much less.
LEVEL_OF_REPEATS: Final = 0.003
#: What repeats unexplained is told from this part of the response on.
LEAST_UNEXPLAINED: Final = 0.03


def lack_of_fit(models: Sequence[Model], *, explained: str) -> tuple[Finding, ...]:
    """The finding "lack of fit", not judged where a departure explains it; empty without repeats.

    `explained`: the departure that is told; "" where there is none.
    """
    found = [one for model in models if (one := _unexplained(model)) is not None]
    if not found:
        return ()
    part, p_value, least = (float(np.median(column)) for column in np.transpose(found))
    told = part > LEAST_UNEXPLAINED and p_value < LEVEL_OF_REPEATS
    if told and explained:
        return (Finding("lack of fit", "cannot tell", f"not judged: after {explained}"),)
    text = (
        f"{100 * part:.1f} % of the response repeats in each direction and is not explained by "
        "M, B and K" + ("; look at it (`--method all`, `reflex`)" if told else "")
    )
    smallest = f"{100 * max(least, LEAST_UNEXPLAINED):.2g} % of the response"
    return (Finding("lack of fit", "warning" if told else "ok", text, smallest=smallest),)


def _unexplained(model: Model) -> tuple[float, float, float] | None:
    """Repeated part of the response, p of none, and the least part seen; None without repeats."""
    labels = model.equation.disturbance
    if labels is None:
        return None
    root = np.linalg.cholesky(model.weight)
    # white residuals r_t^T L (d n,), V = L L^T
    white = model.equation.residual(model.parameters) @ root
    counts = np.bincount(labels)
    chosen = counts[labels] > 1
    if not chosen.any():
        return None
    sums = np.zeros((len(counts), white.shape[1]))
    np.add.at(sums, labels, white)
    mean = (sums / np.maximum(counts, 1)[:, None])[labels]
    groups, rows = int((counts > 1).sum()), white.shape[1]
    apart = (white - mean)[chosen]
    between, within = (mean[chosen] ** 2).sum(), (apart**2).sum()
    free = groups * rows - len(model.parameters), (len(apart) - groups) * rows
    # repeats that are copies of each other have no noise to judge by, which `copies` names
    if free[0] <= 0 or within <= np.finfo(float).eps * between:
        return None
    noise = within / free[1]
    known = _independent(apart, len(apart) - groups) / rows
    response = float(((model.equation.force.reshape(len(white), -1) @ root)[chosen] ** 2).sum())
    part = float(np.sqrt(max(between - free[0] * noise, 0.0) / response))
    # rows that depend on each other are as good as fewer that do not (Satterthwaite)
    p_value = float(fdtrc(known * free[0], known * free[1], between / free[0] / noise))
    least = float(np.sqrt(3 * np.sqrt(2 * free[0] / known) * noise / response))
    return part, p_value, least


def _independent(apart: FloatArray, free: int) -> float:
    """How many independent rows residuals (T, n) are worth: filtered records have few.

    ``(tr C)^2 / tr C^2`` of their covariance C (n, n), free of what C has of chance.
    """
    n = apart.shape[1]
    C = apart.T @ apart / free
    square = float(np.trace(C)) ** 2
    # E[tr C^2] = (1 + 1/f) tr C_true^2 + (tr C_true)^2 / f
    found = (float((C**2).sum()) - square / free) / (1 + 1 / free)
    return float(np.clip(square / max(found, square / n), 1.0, n))


#: The columns for which the smallest visible departure is said.
USUAL: Final = {"reflex": "reflex 0.055", "voluntary": "voluntary 0.13"}
#: What to do about a departure.
ADVICE: Final = {
    "delay": "a millisecond makes B wrong by percents: put the sensors in step",
    "reflex": "`reflex` says more; disturb for a shorter time",
    "amplitude": "K of small deflections asks for smaller disturbances",
    "friction": "a force that has the sign of the velocity: take dry friction out of handle and "
    "seat",
    "voluntary": "tell the person not to intervene; disturb for a shorter time",
}
#: A second cause is told if it explains this part of the first one's standard errors beside it.
BESIDE: Final = 1 / 3
#: Smaller changes of K (parts of K) and smaller delays (s) matter to nobody.
LEAST_SHARE: Final = 0.01
LEAST_DELAY_S: Final = 5e-5
#: Part of a mode's stiffness that a short disturbance shows in K.
USUAL_PART: Final = 0.5
#: With fewer trials nothing can be told; of more conditions than this those with most trials are
#: judged, so that memory has an end.
FEWEST_TRIALS: Final = 8
MOST_CONDITIONS: Final = 32


def _meanings(
    recording: Recording, models: Sequence[Model], names: Mapping[str, str]
) -> dict[str, str]:
    """Name of a check -> what its message says that it makes wrong."""
    way = float(np.median([model.peaks.way for model in models]))
    size = f"{1e3 * way:.1f} {'mm' if recording.kind == 'hand' else 'mrad'}"
    return {
        "reflex": f"an answer some {1e3 * late_s(names['reflex']):.0f} ms late makes K",
        "amplitude": f"a law that is not linear over {size} makes K",
        "friction": "dry friction makes B",
        "voluntary": f"a push from some {1e3 * late_s(names['voluntary']):.0f} ms on makes K",
    }


def check_departures(recording: Recording) -> tuple[Finding, ...]:
    """What departs from M, B and K, and lack of fit; over all conditions together.

    Returns: "own motion", "delay", "reflex", "amplitude", "friction", "voluntary", "lack of fit",
    "gain", "session" and "labels", each with the smallest violation that it would have seen; empty
    where the perturbation is stochastic.
    """
    if recording.perturbation != "returning":
        return ()
    fitted = _models(recording)
    models = [model for _, model in fitted]
    if not models:
        text = f"no condition of {FEWEST_TRIALS} trials to judge by"
        return tuple(Finding(name, "ok", text) for name in COLUMNS)
    own = check_own_motion(models)
    if any(one.verdict == "warning" for one in own):
        hidden = "the person's own motion hides it"
        return (*own, *(Finding(name, "cannot tell", hidden) for name in COLUMNS))
    asked, explained = _asked(recording, models)
    return (
        *own,
        *asked,
        *lack_of_fit(models, explained=explained),
        *check_symmetry(models),
        *check_session(recording, fitted),
        *check_labels(recording, fitted),
        *check_single_trials(recording, fitted),
    )


def _asked(recording: Recording, models: Sequence[Model]) -> tuple[tuple[Finding, ...], str]:
    """The findings of departures and of an inner mode, and the first one that is detected."""
    limb = inner_of(models, freedom_told(recording, np.arange(recording.n_trials)))
    inner = _check_inner(limb)
    beside = beside_inner(limb)
    names = {name: _best(models, columns) for name, columns in COLUMNS.items()}
    single = {name: pooled(models, column, beside) for name, column in names.items()}
    told = _told(models, names, single)
    for name, usual in USUAL.items():
        if name not in told:
            names[name], single[name] = usual, pooled(models, usual, beside)
    what = _meanings(recording, models, names)
    found = [
        _finding(name, one, told, what, limb is not None and limb.wrist)
        for name, one in single.items()
    ]
    told = (*told, *(one.name for one in inner if one.verdict == "warning"))
    return (*found, *inner), told[0] if told else ""


def _finding(
    name: str, one: Departure, told: Sequence[str], what: Mapping[str, str], wrist: bool
) -> Finding:
    """What is said of one departure, where these are told."""
    text, smallest = _delay_text(one) if name == "delay" else _share_text(what[name], one)
    if name not in told and told and _matters(name, one):
        # it resembles what is told, and is not needed beside it
        return Finding(name, "cannot tell", f"not judged: after {told[0]}")
    if name not in told:
        if name in POSITIVE and one.size < 0:
            text = f"none that resists the motion: {_percent_text(what[name][-1], one)}"
        return Finding(name, "ok", text, smallest)
    if name == "reflex" and wrist:
        text = f"{text}, or a free wrist gives way: lock it to tell"
        return Finding(name, "cannot tell", text, smallest)
    return Finding(name, "warning", f"{text}; {ADVICE[name]}", smallest)


def _check_inner(inner: Inner | None) -> tuple[Finding, ...]:
    """The finding "inner mode" of a limb in space; none where the elbow was held as was said."""
    if inner is None or (inner.elbow == "held" and not inner.contradicts):
        return ()
    if inner.seen and inner.mode.carried:
        text = (
            f"a free wrist lets go of forearm and hand at some {inner.mode.hz:g} Hz and makes K "
            "along its soft axes too small: lock the wrist, or stay out for a second"
        )
        return (Finding("inner mode", "warning", text),)
    if inner.seen:
        said = "the elbow was said to be held, and " if inner.contradicts else ""
        text = (
            f"{said}a mode inside the limb, some {inner.mode.hz:g} Hz, makes K along one direction "
            f"up to {100 * USUAL_PART * inner.size:.0f} % of its mean wrong: hold the elbow, or "
            "stay out for 0.3 s and longer"
        )
        return (Finding("inner mode", "warning", text),)
    said = "" if inner.elbow else "; say in a column `elbow` whether it was held or free"
    text = f"no mode of a free elbow stands out of the noise; the intervals allow for one{said}"
    return (Finding("inner mode", "cannot tell", text),)


def _best(models: Sequence[Model], columns: Sequence[str]) -> str:
    """Of one departure's columns the one that explains most."""
    if len(columns) == 1:
        return columns[0]
    signed = columns[0].startswith(POSITIVE)
    found = {column: pooled(models, column) for column in columns}
    size = {column: one.z for column, one in found.items()}
    return max(columns, key=lambda column: size[column] if signed else abs(size[column]))


def _told(
    models: Sequence[Model], names: Mapping[str, str], single: Mapping[str, Departure]
) -> tuple[str, ...]:
    """The departure that explains most, and those that are needed beside it."""
    seen = {name: one for name, one in single.items() if _matters(name, one)}
    if not seen:
        return ()
    first = max(seen, key=lambda name: abs(seen[name].z))
    told = [first]
    for name in seen:
        if name == first:
            continue
        beside = pooled(models, names[name], names[first])
        needed = BESIDE * abs(seen[first].t)
        if _matters(name, beside) and abs(beside.t) > needed:
            told.append(name)
    return tuple(told)


def _matters(name: str, one: Departure) -> bool:
    """Whether this is no chance, and more than a standard error of what it makes wrong."""
    if name in POSITIVE and one.size < 0:
        return False
    if abs(one.share * one.size) < one.known:
        return False
    least = LEAST_DELAY_S if name == "delay" else LEAST_SHARE / max(abs(one.share), 1e-9)
    return abs(one.size) > max(one.limit, least)


def _delay_text(one: Departure) -> tuple[str, str]:
    """What was found, and the smallest delay that would have been seen."""
    which = "late" if one.size >= 0 else "early"
    text = f"force {1e3 * abs(one.size):.2f} ms (sd {1e3 * one.error:.2f}) {which} on the motion"
    return text, f"{1e3 * max(one.limit, LEAST_DELAY_S):.2f} ms"


def _share_text(what: str, one: Departure) -> tuple[str, str]:
    """What was found in parts of K (or B), and the smallest part that would have been seen."""
    smallest = 100 * max(abs(one.share) * one.limit, LEAST_SHARE)
    return f"{what[:-1]}{_percent_text(what[-1], one)} wrong", f"{smallest:.2g} % of {what[-1]}"


def _percent_text(symbol: str, one: Departure) -> str:
    percent = 100 * one.share
    return f"{symbol} {percent * one.size:+.1f} % (sd {abs(percent) * one.error:.1f})"


def _models(recording: Recording) -> list[tuple[IntArray, Model]]:
    """The conditions that are fitted, beside each the rows of the trials that its fit has used."""
    return [(rows[model.usable], model) for rows, model in largest_conditions(recording)]


@once_per_record
def largest_conditions(recording: Recording) -> tuple[tuple[IntArray, Model], ...]:
    """The conditions with most trials, each fitted; all trials together where none can be.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    tuple of (rows, Model)
        `rows`: of the condition's trials, whether they can be used or not.
    """
    for by in (DEFAULT_BY, ()):
        groups = sorted((rows for _, rows in groups_of(recording, by)), key=len, reverse=True)
        groups = groups[:MOST_CONDITIONS]
        fitted = zip(groups, models_of(recording, groups), strict=True)
        if found := tuple((rows, model) for rows, model in fitted if model is not None):
            return found
    return ()


def session_blocks(recording: Recording) -> SessionBlocks | None:
    """M, B and K over a session, block by block of its trials.

    Parameters
    ----------
    recording : Recording
        With disturbances that return.

    Returns
    -------
    SessionBlocks or None
        None where no condition can be fitted.
    """
    models = _models(recording)
    return blocks_of(recording, models) if models else None


def models_of(recording: Recording, groups: Sequence[IntArray]) -> Iterator[Model | None]:
    """The fit of each group of trials, made as it is asked for; None where it cannot be made.

    Raises InputError: the column `wrist` of a recording in space is not as it should be.
    """
    timing = disturbance_times(recording)
    in_space = recording.position.shape[1] >= FEWEST_AXES
    for rows in groups:
        wrist = in_space and is_wrist_free(recording, rows)
        try:
            window = cut_windows(recording, rows, timing)
            enough = window.usable.sum() >= FEWEST_TRIALS
            model = Model.of(window, recording.kind, wrist) if enough else None
        except ArmImpedanceError:
            model = None
        yield model
