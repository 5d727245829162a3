"""Identify intrinsic and reflex pathways of a joint that vary over time or another variable."""

from __future__ import annotations

from dataclasses import replace
from itertools import count
from typing import Any, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, check_number
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.core.progress import Progress
from armimpedance.joint.elbow.cascade.fit import in_rounds
from armimpedance.joint.elbow.cascade.methods import CASCADE_METHODS, CascadeMethod
from armimpedance.joint.elbow.cascade.rows import CascadeRows, block_means, cascade_rows
from armimpedance.joint.elbow.cascade.search import LIMITS, Refined, Searched, refined, searched
from armimpedance.joint.elbow.cascade.task import (
    CascadeCourses,
    CascadeTask,
    beginning,
    task_in_time,
    task_over,
)
from armimpedance.joint.elbow.elbow_result import NAMES, UNITS, ReflexCourse, VaryingImpedance
from armimpedance.joint.elbow.samples import JointSamples
from armimpedance.joint.elbow.varying.data import VaryingData, varying_data
from armimpedance.numerics.regression import Parameters

#: Frequency below which the angle is posture, if the courses are functions of it, Hz.
SLOW_HZ: Final = 0.5
#: Gain in log likelihood from which a reflex is certain: no jump can imitate it.
SURE: Final = 2000.0
#: Beginning of each trial that is not used while the reflex is searched for, s.
LEAD_S: Final = 0.3
#: Relative error of each course due to the derivatives, added to its standard error.
MODEL: Final = 3e-4
#: A variable must vary by more than this share of its size; less is noise.
STILL: Final = 1e-4
#: Grid of the result, s.
EVERY_S: Final = 0.02
#: Largest number of steps that progress reports.
_STEPS: Final = 18


def identify_cascade(
    samples: JointSamples,
    *,
    method: str | None = None,
    reflex: Literal["auto", "none"] = "auto",
    aligned: bool = False,
    over: str | None = None,
    variable: FloatArray | None = None,
    every_s: float | None = None,
    cutoff_hz: float | None = None,
    progress: Progress | None = None,
) -> VaryingImpedance:
    """Identify ``tau = I x'' + B x' + K x + G r + offset``, r the late, low-passed velocity.

    Parameters
    ----------
    samples : JointSamples
        Samples whose angle is imposed.
    method : str, optional
        A name in `CASCADE_METHODS`; its default if none is given.
    reflex : {"auto", "none"}
        "auto": search for a reflex; "none": do not.
    aligned : bool
        Trials are realizations of one course.
    over : str, optional
        Name of the variable of which B, K and G are functions; None: time. "angle" and "torque"
        are the slow parts of the samples' own; a "phase" is cyclic, from 0 to 1.
    variable : (N,), optional
        Its values at the samples; needed unless the name is "angle" or "torque".
    every_s : float, optional
        Grid of the result, s (0.02).
    cutoff_hz : float, optional
        Highest frequency of the motion that is used, Hz.
    progress : callable, optional
        Called with the number of steps that are done and their total.

    Returns
    -------
    VaryingImpedance
        With `reflex` if one was detected.

    Raises
    ------
    InputError
        An unknown method, samples or a variable that cannot be used.
    EstimationError
        The record does not determine the courses.
    """
    chosen = CASCADE_METHODS.named(method)
    _refuse(chosen, samples, aligned, over, every_s)
    done = count(1)

    def tick() -> None:
        if progress is not None:
            progress(min(next(done), _STEPS - 1), _STEPS)

    data = varying_data(samples, cutoff_hz)
    slow_hz = SLOW_HZ if over in ("angle", "torque") else 0.0
    rows = cascade_rows(samples, data, slow_hz, aligned)
    task = _task(samples, data, rows, aligned, over, variable)
    task = replace(task, tick=tick)
    tick()
    search, near = None, None
    if reflex == "auto":
        search = searched(task.settled(LEAD_S))
        settled = task.settled(search.pathway.lead_s)
        search = _contest(search, settled)
        if search.seen:
            near = refined(search.pathway, settled)
            search = replace(search, pathway=near.pathway)
            task = replace(settled, pathway=near.pathway)
    courses = chosen.estimate(task)
    if progress is not None:
        progress(_STEPS, _STEPS)
    return _result(chosen, courses, search, near, every_s)


def _contest(search: Searched, task: CascadeTask) -> Searched:
    """Recompute the gain of a detected reflex with fine courses, which may jump."""
    if not search.seen:
        return search
    short = beginning(task)
    if search.gained > SURE:
        return search
    without = in_rounds(short).estimates.evidence
    with_reflex = in_rounds(replace(short, pathway=search.pathway)).estimates.evidence
    return replace(search, gained=with_reflex - without)


def _refuse(
    method: CascadeMethod,
    samples: JointSamples,
    aligned: bool,
    over: str | None,
    every_s: float | None,
) -> None:
    if every_s is not None:
        check_number(every_s, f"every_s of {every_s:g} s", above=0)
    if over is not None and method.realizations > 1:
        raise InputError(
            f"method {method.name!r} over {over!r}", expected="cascade, or courses over time"
        )
    needed = method.realizations
    if needed > 1 and not (aligned and samples.n_trials >= needed):
        raise InputError(
            f"method {method.name!r} with {samples.n_trials} trials"
            + ("" if aligned else ", not stated to be aligned"),
            expected=f"{needed} trials or more of the same course (--aligned), or cascade",
        )


def _task(
    samples: JointSamples,
    data: VaryingData,
    rows: CascadeRows,
    aligned: bool,
    over: str | None,
    variable: FloatArray | None,
) -> CascadeTask:
    if over is None:
        return task_in_time(samples, data, rows, aligned)
    values = _variable(samples, over, variable)
    at_rows = np.concatenate(
        [block_means(values[samples.samples_of(t)], data.every) for t in range(samples.n_trials)]
    )
    return task_over(samples, data, rows, at_rows, over)


def _variable(samples: JointSamples, over: str, stated: FloatArray | None) -> FloatArray:
    """Return the values (N,) of the variable, checked."""
    if stated is None:
        if over not in ("angle", "torque"):
            raise InputError(f"no variable {over!r}", expected="angle, torque, or its values")
        channel = samples.angle if over == "angle" else samples.torque
        stated = np.concatenate(
            [
                _slow(channel[samples.samples_of(t)], samples.sample_rate_hz)
                for t in range(samples.n_trials)
            ]
        )
    values = np.asarray(stated, dtype=np.float64)
    if values.shape != samples.torque.shape or not np.isfinite(values).all():
        raise InputError(
            f"the variable {over!r} has gaps or another length than the torque",
            expected=f"{len(samples.torque)} finite numbers",
        )
    if over == "phase" and (values.min() < 0 or values.max() > 1):
        raise InputError(
            f"phases from {values.min():.4g} to {values.max():.4g}",
            column=over,
            expected="0 to 1, once round a cycle",
        )
    spread = float(np.ptp(np.quantile(values, (0.05, 0.95))))
    if not spread > STILL * max(float(np.abs(values).max()), 1e-300):
        raise InputError(
            f"the variable {over!r} is {values[0]:.4g} nearly throughout",
            expected="one that varies (take an offset off that says nothing), or courses over time",
        )
    return values


def _slow(signal: FloatArray, rate_hz: float) -> FloatArray:
    """Part of a channel below `SLOW_HZ`, without phase shift."""
    from scipy.signal import butter, sosfiltfilt

    sos = butter(2, SLOW_HZ, fs=rate_hz, output="sos")
    return np.asarray(sosfiltfilt(sos, signal, padlen=min(len(signal) - 1, round(2 * rate_hz))))


def _result(
    method: CascadeMethod,
    courses: CascadeCourses,
    search: Searched | None,
    near: Refined | None,
    every_s: float | None,
) -> VaryingImpedance:
    task, estimates = courses.task, courses.estimates
    at, place, offsets = _grid(task, every_s)
    mean = estimates.mean[at]
    sd = np.sqrt(estimates.variance[at] + (MODEL * mean) ** 2)
    finding = _reflex_finding(search, estimates.mean)
    course = None
    if near is not None:
        sd, course = _with_pathway(near, mean, sd)
    inertia = Parameters(
        NAMES[:1], UNITS[:1], np.array([estimates.inertia]), np.array([[estimates.var_inertia]])
    )
    checks = (finding,) if finding is not None else ()
    trials = task.data.trials if len(offsets) == len(task.data.trials) + 1 else ("all",)
    return VaryingImpedance(
        method=method.name,
        trials=trials,
        offsets=offsets,
        time_s=place,
        B=mean[:, 0],
        K=mean[:, 1],
        sd_B=sd[:, 0],
        sd_K=sd[:, 1],
        parameters=inertia,
        snr=task.data.snr,
        joint=task.samples.joint,
        preparation=(*task.data.notes, *courses.notes),
        warnings=(*_warnings(task.samples), *warnings_of(checks)),
        checks=checks,
        details=_details(courses),
        reflex=course,
        over=task.over,
    )


def _details(courses: CascadeCourses) -> dict[str, Any]:
    order = len(courses.task.noise) - 1
    return {"noise_order": order, "log_evidence": courses.estimates.evidence}


def _grid(task: CascadeTask, every_s: float | None) -> tuple[np.ndarray, FloatArray, np.ndarray]:
    """Cells (L,) of the result, their places, and offsets of the strips."""
    step = max(round((every_s or EVERY_S) / task.width), 1) if task.in_time else 1
    pairs = list(zip(task.strips[:-1].tolist(), task.strips[1:].tolist(), strict=True))
    at = [np.arange(a, b, step) for a, b in pairs]
    offsets = np.concatenate([[0], np.cumsum([len(x) for x in at])])
    within = np.concatenate([x - a for x, (a, _) in zip(at, pairs, strict=True)])
    place = (within + 0.5) * task.width + task.start
    return np.concatenate(at), place, offsets


def _with_pathway(
    near: Refined, mean: FloatArray, sd: FloatArray
) -> tuple[FloatArray, ReflexCourse]:
    """Add the uncertainty of delay and cut-off to every band."""
    G = mean[:, 2]
    level = float(np.abs(G).mean()) or 1.0
    share = np.abs(G) / level
    moved, C = near.moved, near.covariance
    more = np.einsum("ij,ik,kj->j", moved, C, moved)
    sd = np.sqrt(sd**2 + share[:, None] ** 2 * more)
    pathway = near.pathway
    sd_delay, sd_log = np.sqrt(np.diag(C)).tolist()
    return sd, ReflexCourse(
        G=G,
        sd_G=sd[:, 2],
        delay_s=pathway.delay_s,
        sd_delay_s=sd_delay,
        cutoff_hz=pathway.cutoff_hz,
        sd_cutoff_hz=pathway.cutoff_hz * sd_log,
        order=pathway.order,
        side=pathway.side,
    )


def _reflex_finding(search: Searched | None, mean: FloatArray) -> Finding | None:
    if search is None:
        return None
    arc = search.pathway
    kind = "either direction" if arc.side == "both" else f"{arc.side} velocities"
    if not search.seen:
        return Finding(
            "reflex",
            "ok",
            f"none is seen: the likeliest ({1e3 * arc.delay_s:.0f} ms, {kind}) raises the "
            f"logarithm of the likelihood by {search.gained:.1f} only",
        )
    if search.at_limit:
        ends = [1e3 * x for x in LIMITS[0]]
        return Finding(
            "reflex",
            "warning",
            f"the likeliest answers after {1e3 * arc.delay_s:.0f} ms behind a low-pass at "
            f"{arc.cutoff_hz:.2g} Hz, where the search ends ({ends[0]:g} to {ends[1]:g} ms, "
            f"{LIMITS[1][0]:g} to {LIMITS[1][1]:g} Hz): the pathway is another, and the courses "
            "of B, K and G may be wrong",
        )
    return Finding(
        "reflex",
        "ok",
        f"seen after {1e3 * arc.delay_s:.1f} ms, to {kind}, behind a low-pass of order {arc.order} "
        f"at {arc.cutoff_hz:.2g} Hz; mean gain {mean[:, 2].mean():.3g} N m s/rad; logarithm of "
        f"the likelihood +{search.gained:.0f}",
    )


def _warnings(samples: JointSamples) -> tuple[str, ...]:
    if samples.imposed == "position":
        return ()
    note = "" if samples.imposed is None else f" ({samples.imposed})"
    return (
        "the angle is taken as imposed, which the recording does not say"
        f"{note}: where the subject's own torque moves the joint, I, B and K are wrong",
    )
