"""Viscosity and stiffness of one joint over time."""

from __future__ import annotations

from armimpedance.core.program import software
from armimpedance.joint.elbow.elbow_result import VaryingImpedance
from armimpedance.joint.elbow.show.over_time_verb import elbow_over_time
from armimpedance.joint.elbow.show.plot import plot_varying_both
from armimpedance.joint.elbow.show.text import varying_text
from armimpedance.joint.elbow.varying.methods import VARYING_METHODS
from armimpedance.show.pages import (
    RUIZ,
    Asked,
    Page,
    Section,
    Topic,
    methods_of,
    page_from,
    parameter_table,
    picture,
    reviewed,
    told_by,
)
from armimpedance.show.text import counted
from armimpedance.show.verbs.results import read_recording


def _sentences(course: VaryingImpedance) -> list[str]:
    return [
        "Viscosity B and stiffness K of the joint were estimated over time, its inertia "
        f"constant, with {software()}, method {course.method}",
        *course.preparation,
        *course.notes,
        "Bands are pointwise 95 % intervals of the t distribution",
    ]


def page_of(asked: Asked) -> Page:
    """The page of a course over time."""
    recording = read_recording(asked.recording)
    method = asked.method or VARYING_METHODS.default
    course = elbow_over_time(
        recording, method=method, despite=asked.despite, progress=asked.progress
    )
    messages = told_by(course.warnings, (*course.checks, *asked.checks_without_emg))
    pictures = tuple(
        picture(
            plot_varying_both(course, row),
            f"course_{row + 1}",
            f"B and K over time with pointwise 95 % bands, trial {name}.",
        )
        for row, name in enumerate(course.trials[:4])
    )
    return page_from(
        asked,
        messages,
        title="Impedance of a joint over time",
        lead=f"{counted(len(course.trials), 'trial')} at {recording.sample_rate_hz:g} Hz; subject "
        f"{recording.subject.id}.",
        count=f"{len(course.time_s)} points in time",
        next_step=_next(course),
        reader=(
            Section("Course of B and K", pictures),
            Section("Constant", (parameter_table(tuple(course.parameters)),)),
        ),
        reviewer=reviewed(messages, varying_text(course)),
        methods=methods_of(_sentences(course), [RUIZ], messages),
        options=[("method", course.method), ("despite", ", ".join(asked.despite))],
        data={
            "course": course.to_frame().drop(columns=["method", "warnings"]),
            "parameters": course.parameters.to_frame().reset_index(),
        },
    )


def _next(course: VaryingImpedance) -> str:
    half = float((course.band("K")[:, 1] - course.K).mean() / abs(course.K.mean()))
    return (
        f"K's band is ± {100 * half:.2g} % on average: faster changes than its smoothness allows "
        "are not in it."
    )


TOPIC = Topic("B and K of one joint over time", page_of)
