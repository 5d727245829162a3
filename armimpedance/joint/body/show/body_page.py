"""Masses and inertias of a moving body, or of a robot."""

from __future__ import annotations

from armimpedance.core.errors import InputError
from armimpedance.core.program import software
from armimpedance.core.records import Recording
from armimpedance.joint.body.methods import METHODS
from armimpedance.joint.body.show.plot import body_figure
from armimpedance.joint.body.show.text import body_text
from armimpedance.joint.body.show.verb import BODY, body
from armimpedance.show.pages import VENTURE_BODY, Asked, Page, Topic, fit_page, picture


def page_of(asked: Asked) -> Page:
    """The page of a body's motion and contact forces."""
    recording = asked.recording
    if isinstance(recording, Recording):
        raise InputError(
            f"a recording of kind {recording.kind!r}", file=asked.source, expected="joint motion"
        )
    chosen = BODY.chosen(asked)
    fit = body(recording, **chosen, progress=asked.progress)
    method = METHODS.named(fit.method)
    motions = ", ".join(dict.fromkeys(fit.choice.motions))
    return fit_page(
        asked,
        fit.summary,
        title="Dynamics of a body",
        lead=f"{fit.base.rank} base parameters from the motions {motions}.",
        pictures=[
            picture(
                body_figure(fit),
                "measured_and_predicted",
                "Contact forces and moments of a motion: measured, and predicted by the fit.",
            )
        ],
        printed=body_text(fit),
        methods=[
            f"{fit.base.rank} base parameters were identified with {software()} from the motions "
            f"{motions}, method {fit.method}, which assumes that {method.assumes}",
            *BODY.differing(chosen),
            *fit.notes,
            "Intervals are 95 % intervals, their covariance clustered by blocks of time",
        ],
        references=[VENTURE_BODY],
        options=[("motions", motions)],
    )


TOPIC = Topic("masses and inertias of a body from its motion and contact forces", page_of)
