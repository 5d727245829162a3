"""Checks of the model: each departure of the limb from it, and unexplained repeatable response.

Departures resemble each other. The one that explains most is reported, and a second one only if the
first does not explain it.
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
    is_wrist_free,
    stated_freedom,
)
from armimpedance.hand.still.doubts.labels import check_labels
from armimpedance.hand.still.doubts.mixture import POSITIVE
from armimpedance.hand.still.doubts.model import (
    COLUMNS,
    Departure,
    Model,
    beside_inner,
    inner_of,
    is_of_rate,
    late_s,
    pooled,
)
from armimpedance.hand.still.doubts.session import SessionBlocks, blocks_of, check_session
from armimpedance.hand.still.doubts.single_trials import check_single_trials
from armimpedance.hand.still.doubts.symmetry import check_symmetry
from armimpedance.hand.still.estimation import DEFAULT_BY, groups_of
from armimpedance.hand.still.modal import mean_of_others
from armimpedance.numerics.signals import cut_windows, disturbance_times

# Does the hand move as it is disturbed? Any other motion comes from the person's own force.
# If the robot yields, the person's own force moves the hand, and the measured force is the robot's
# response: least squares then estimates the robot, not the limb. The sign of it are unequal motions
# in trials of the same disturbance.

#: Share of the motion's energy that has to repeat. With servos of 1000, 300 and 100 N/m under
#: nominal noise .97, .8 and .6 repeat, and K by least squares is 4, 24 and 40 % wrong. With a robot
#: that imposes a force while the person pushes by 1 N, .8 repeats, and M comes out negative.
LEAST_REPEATED: Final = 0.9


def check_own_motion(models: Sequence[Model]) -> tuple[Finding, ...]:
    """The finding "own motion"; empty without trials of the same disturbance.

    `models`: one of each condition.
    """
    shares = [share for model in models if (share := _repeated(model)) is not None]
    if not shares:
        return ()
    share = float(np.median(shares))
    text = f"{100 * share:.0f} % of the hand's motion is that of its disturbance"
    smallest = f"{100 * (1 - LEAST_REPEATED):.0f} % of other motion"
    if share >= LEAST_REPEATED:
        return (Finding("own motion", "ok", text, smallest=smallest),)
    text += (
        ", the rest the person's own: the robot yields to it, and least squares finds the robot "
        "instead of the limb; take --method instruments or frequency, and more trials of each "
        "direction"
    )
    return (Finding("own motion", "warning", text, smallest=smallest),)


def _repeated(model: Model) -> float | None:
    """Share of the displacement's energy common to trials of one disturbance, or None."""
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


# Mean residual of each disturbance, compared with the scatter between its repeats.

#: Significance level. It is low because lack of fit has no size to judge by, and a recording shows
#: few of them.
LEVEL_OF_REPEATS: Final = 0.003
#: Smallest unexplained repeatable part that is reported, a share of the response.
LEAST_UNEXPLAINED: Final = 0.03


def lack_of_fit(models: Sequence[Model], *, explained: str) -> tuple[Finding, ...]:
    """The finding "lack of fit", not judged where a departure explains it; empty without repeats.

    `explained`: the departure that is reported; "" if there is none.
    """
    tests = [test for model in models if (test := _unexplained(model)) is not None]
    if not tests:
        return ()
    part, p_value, least = (float(np.median(column)) for column in np.transpose(tests))
    detected = part > LEAST_UNEXPLAINED and p_value < LEVEL_OF_REPEATS
    if detected and explained:
        return (Finding("lack of fit", "cannot tell", f"not judged: after {explained}"),)
    text = (
        f"{100 * part:.1f} % of the response repeats in each direction and is not explained by "
        "M, B and K" + ("; look at it (`--method all`, `reflex`)" if detected else "")
    )
    smallest = f"{100 * max(least, LEAST_UNEXPLAINED):.2g} % of the response"
    return (Finding("lack of fit", "warning" if detected else "ok", text, smallest=smallest),)


def _unexplained(model: Model) -> tuple[float, float, float] | None:
    """Unexplained share of the response, its p-value and the least share that would be significant.

    None without repeats.
    """
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
    # repeats that are copies of each other have no noise to judge by; the check `copies` reports
    # them
    if free[0] <= 0 or within <= np.finfo(float).eps * between:
        return None
    noise = within / free[1]
    independent = _independent(apart, len(apart) - groups) / rows
    response = float(((model.equation.force.reshape(len(white), -1) @ root)[chosen] ** 2).sum())
    part = float(np.sqrt(max(between - free[0] * noise, 0.0) / response))
    # rows that depend on each other are as good as fewer that do not (Satterthwaite)
    p_value = float(fdtrc(independent * free[0], independent * free[1], between / free[0] / noise))
    least = float(np.sqrt(3 * np.sqrt(2 * free[0] / independent) * noise / response))
    return part, p_value, least


def _independent(apart: FloatArray, free: int) -> float:
    """Number of independent rows that residuals (T, n) are worth: few in filtered records.

    ``(tr C)^2 / tr C^2`` of their covariance C (n, n), corrected for the sampling error of C.
    """
    n = apart.shape[1]
    C = apart.T @ apart / free
    square = float(np.trace(C)) ** 2
    # E[tr C^2] = (1 + 1/f) tr C_true^2 + (tr C_true)^2 / f
    squared = (float((C**2).sum()) - square / free) / (1 + 1 / free)
    return float(np.clip(square / max(squared, square / n), 1.0, n))


#: The columns for which the detection limit of a departure is reported.
USUAL: Final = {"reflex": "reflex 0.055", "voluntary": "voluntary 0.13"}
#: Advice for each departure.
ADVICE: Final = {
    "delay": "a millisecond makes B wrong by percents: put the sensors in step",
    "reflex": "`reflex` says more; disturb for a shorter time",
    "amplitude": "K of small deflections asks for smaller disturbances",
    "friction": "a force that has the sign of the velocity: take dry friction out of handle and "
    "seat",
    "voluntary": "tell the person not to intervene; disturb for a shorter time",
}
#: A second cause is reported if, beside the first one, its t is at least this share of the first
#: one's.
BESIDE: Final = 1 / 3
#: Changes of K (a share of K) and delays (s) too small to matter.
LEAST_SHARE: Final = 0.01
LEAST_DELAY_S: Final = 5e-5
#: Share of a mode's stiffness that appears in K when the disturbance is short.
USUAL_PART: Final = 0.5
#: Conditions with fewer trials are not judged. Of more conditions than MOST_CONDITIONS those with
#: most trials are judged, so that memory is bounded.
FEWEST_TRIALS: Final = 8
MOST_CONDITIONS: Final = 32


def _meanings(
    recording: Recording, models: Sequence[Model], names: Mapping[str, str]
) -> dict[str, str]:
    """Name of a check -> beginning of its message, which ends with the matrix that is wrong."""
    way = float(np.median([model.peaks.way for model in models]))
    size = f"{1e3 * way:.1f} {'mm' if recording.kind == 'hand' else 'mrad'}"
    to = " to the velocity" if is_of_rate(names["reflex"]) else ""
    return {
        "reflex": f"an answer{to} some {1e3 * late_s(names['reflex']):.0f} ms late makes K",
        "amplitude": f"a law that is not linear over {size} makes K",
        "friction": "dry friction makes B",
        "voluntary": f"a push from some {1e3 * late_s(names['voluntary']):.0f} ms on makes K",
    }


def check_departures(recording: Recording) -> tuple[Finding, ...]:
    """Check departures from M, B and K, and lack of fit, over all conditions together.

    Returns: "own motion", "delay", "reflex", "amplitude", "friction", "voluntary", "lack of fit",
    "gain", "session" and "labels", each with its detection limit; empty if the perturbation is
    stochastic.
    """
    if recording.perturbation != "returning":
        return ()
    fitted = _models(recording)
    models = [model for _, model in fitted]
    if not models:
        text = f"no condition of {FEWEST_TRIALS} trials to judge by"
        return tuple(Finding(name, "ok", text) for name in COLUMNS)
    own = check_own_motion(models)
    if any(finding.verdict == "warning" for finding in own):
        hidden = "the person's own motion hides it"
        return (*own, *(Finding(name, "cannot tell", hidden) for name in COLUMNS))
    findings, explained = _departure_findings(recording, models)
    return (
        *own,
        *findings,
        *lack_of_fit(models, explained=explained),
        *check_symmetry(models),
        *check_session(recording, fitted),
        *check_labels(recording, fitted),
        *check_single_trials(recording, fitted),
    )


def _departure_findings(
    recording: Recording, models: Sequence[Model]
) -> tuple[tuple[Finding, ...], str]:
    """Findings of departures and of an inner mode, and the name of the first detected one."""
    limb = inner_of(models, stated_freedom(recording, np.arange(recording.n_trials)))
    inner = _check_inner(limb)
    beside = beside_inner(limb)
    names = {name: _best(models, columns) for name, columns in COLUMNS.items()}
    single = {name: pooled(models, column, beside) for name, column in names.items()}
    detected = _detected(models, names, single)
    for name, usual in USUAL.items():
        if name not in detected:
            names[name], single[name] = usual, pooled(models, usual, beside)
    what = _meanings(recording, models, names)
    findings = [
        _finding(name, departure, detected, what, limb is not None and limb.wrist)
        for name, departure in single.items()
    ]
    detected = (
        *detected,
        *(departure.name for departure in inner if departure.verdict == "warning"),
    )
    return (*findings, *inner), detected[0] if detected else ""


def _finding(
    name: str, departure: Departure, detected: Sequence[str], what: Mapping[str, str], wrist: bool
) -> Finding:
    """Finding of one departure, where `told` are the detected departures."""
    text, smallest = (
        _delay_text(departure) if name == "delay" else _share_text(what[name], departure)
    )
    if name not in detected and detected and _matters(name, departure):
        # it resembles the detected departure, which explains it
        return Finding(name, "cannot tell", f"not judged: after {detected[0]}")
    if name not in detected:
        if name in POSITIVE and departure.size < 0:
            text = f"none that resists the motion: {_percent_text(what[name][-1], departure)}"
        return Finding(name, "ok", text, smallest)
    if name == "reflex" and wrist:
        text = f"{text}, or a free wrist gives way: lock it to tell"
        return Finding(name, "cannot tell", text, smallest)
    return Finding(name, "warning", f"{text}; {ADVICE[name]}", smallest)


def _check_inner(inner: Inner | None) -> tuple[Finding, ...]:
    """The finding "inner mode" of a limb in space; empty if the elbow was held, as stated."""
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
    """Column that explains most, of the columns of one departure."""
    if len(columns) == 1:
        return columns[0]
    signed = columns[0].startswith(POSITIVE)
    departures = {column: pooled(models, column) for column in columns}
    size = {column: departure.z for column, departure in departures.items()}
    return max(columns, key=lambda column: size[column] if signed else abs(size[column]))


def _detected(
    models: Sequence[Model], names: Mapping[str, str], single: Mapping[str, Departure]
) -> tuple[str, ...]:
    """Names of the departure that explains most and of those that it does not explain."""
    significant = {
        name: departure for name, departure in single.items() if _matters(name, departure)
    }
    if not significant:
        return ()
    first = max(significant, key=lambda name: abs(significant[name].z))
    detected = [first]
    for name in significant:
        if name == first:
            continue
        beside = pooled(models, names[name], names[first])
        needed = BESIDE * abs(significant[first].t)
        if _matters(name, beside) and abs(beside.t) > needed:
            detected.append(name)
    return tuple(detected)


def _matters(name: str, departure: Departure) -> bool:
    """True if the departure is significant and larger than the standard error of K or B."""
    if name in POSITIVE and departure.size < 0:
        return False
    if abs(departure.share * departure.size) < departure.known:
        return False
    least = LEAST_DELAY_S if name == "delay" else LEAST_SHARE / max(abs(departure.share), 1e-9)
    return abs(departure.size) > max(departure.limit, least)


def _delay_text(late: Departure) -> tuple[str, str]:
    """The estimated delay, and its detection limit."""
    side = "late" if late.size >= 0 else "early"
    text = f"force {1e3 * abs(late.size):.2f} ms (sd {1e3 * late.error:.2f}) {side} on the motion"
    return text, f"{1e3 * max(late.limit, LEAST_DELAY_S):.2f} ms"


def _share_text(what: str, departure: Departure) -> tuple[str, str]:
    """The estimated error of K (or B), and its detection limit, both as shares."""
    smallest = 100 * max(abs(departure.share) * departure.limit, LEAST_SHARE)
    return (
        f"{what[:-1]}{_percent_text(what[-1], departure)} wrong",
        f"{smallest:.2g} % of {what[-1]}",
    )


def _percent_text(symbol: str, departure: Departure) -> str:
    percent = 100 * departure.share
    return f"{symbol} {percent * departure.size:+.1f} % (sd {abs(percent) * departure.error:.1f})"


def _models(recording: Recording) -> list[tuple[IntArray, Model]]:
    """Fitted conditions, each with the rows of the trials that its fit has used."""
    return [(rows[model.usable], model) for rows, model in largest_conditions(recording)]


@once_per_record
def largest_conditions(recording: Recording) -> tuple[tuple[IntArray, Model], ...]:
    """The conditions with most trials, each fitted; all trials together if none can be fitted.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    tuple of (rows, Model)
        `rows`: all trials of the condition, also those that cannot be used.
    """
    for by in (DEFAULT_BY, ()):
        groups = sorted((rows for _, rows in groups_of(recording, by)), key=len, reverse=True)
        groups = groups[:MOST_CONDITIONS]
        fitted = zip(groups, models_of(recording, groups), strict=True)
        if models := tuple((rows, model) for rows, model in fitted if model is not None):
            return models
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
    """Yield the fit of each group of trials, one at a time; None if a group cannot be fitted.

    Raises InputError: the column `wrist` of a recording in space has an unknown value.
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
