"""One joint under a random perturbation: I, B and K."""

from __future__ import annotations

from armimpedance.core.program import software
from armimpedance.core.shown import with_half_width
from armimpedance.joint.elbow.samples import from_recording
from armimpedance.joint.elbow.show.plot import plot_frequency_response
from armimpedance.joint.elbow.show.text import elbow_text
from armimpedance.joint.elbow.show.verb import elbow
from armimpedance.joint.elbow.stationary.methods import METHODS
from armimpedance.numerics.regression import NamedParameter
from armimpedance.show.pages import (
    RUIZ,
    Asked,
    Page,
    Section,
    Table,
    Topic,
    fit_page,
    picture,
)
from armimpedance.show.verbs.results import read_recording


def page_of(asked: Asked) -> Page:
    """The page of a joint's record."""
    recording = read_recording(asked.recording)
    fit = elbow(recording, method=asked.method, despite=asked.despite, progress=asked.progress)
    drawn = plot_frequency_response(from_recording(recording, fit.joint), fit)
    parts = [
        (label, *(_cell(part[name]) for name in ("I", "B", "K")))
        for label, part in fit.parts.items()
    ]
    table = Table("Conditions and trials by themselves", ("part", "I", "B", "K"), tuple(parts))
    method = METHODS.named(fit.method)
    return fit_page(
        asked,
        fit.summary,
        title="Impedance of a joint",
        lead=f"{recording.n_trials} trials at {recording.sample_rate_hz:g} Hz, random "
        f"perturbation; subject {recording.subject.id}.",
        pictures=[
            picture(
                drawn,
                "frequency_response",
                "Measured and fitted compliance: angle over torque, and what I, B and K predict.",
            )
        ],
        sections=[Section("Parts", (table,))] if parts else [],
        printed=elbow_text(fit),
        methods=[
            f"Inertia I, viscosity B and stiffness K of the joint were estimated with {software()} "
            f"as tau = I theta'' + B theta' + K theta about the operating point, from "
            f"{recording.n_trials} trials, by {fit.method} ({method.reference})",
            *fit.preparation,
            f"Intervals are 95 % intervals; covariance: {fit.parameters.covariance_kind}",
        ],
        references=[RUIZ, method.reference],
        options=[("despite", ", ".join(asked.despite))],
    )


def _cell(parameter: NamedParameter) -> str:
    low, high = parameter.ci95
    return with_half_width(parameter.value, (high - low) / 2)


TOPIC = Topic("one joint under a random perturbation", page_of)
